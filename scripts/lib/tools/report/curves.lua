--- curves.lua: the curves of runs as panels, which figures, the page and the terminal draw alike:
--- learning, diversity, failures, time. A line is the centre of an arm's repetitions; its band is
--- their spread.

local bootstrap = require "limax.base.statistics.bootstrap"
local choice = require "limax.base.choice"
local palette = require "limax.draw.palette"
local runs = require "limax.tools.report.runs"
local sample = require "limax.base.statistics.sample"

local curves = {}

-- resamples of a bootstrap: the ends of a band move by less than a twentieth of its width
local RESAMPLES = 1000
-- more bands than these hide each other
local MOST_BANDS = 4
-- places of a band: a bootstrap takes 2 ms each
local BAND_PLACES = 150
-- places at which curves over evaluations are drawn
local PLACES = 60
-- letters of a name beside its curve
local MOST_LETTERS = 22

-- A name that fits beside a curve; letters of UTF-8 stay whole.
local function short(name)
  if #name <= MOST_LETTERS then return name end
  return name:sub(1, MOST_LETTERS - 1):gsub("[\192-\255][\128-\191]*$", "") .. "…"
end

--- What the bands of this many repetitions show; nil where there are none: for one repetition, and
--- for too many arms.
---@return string|nil
function curves.band_text(count, arms)
  if count < 2 or arms > MOST_BANDS then return nil end
  if count < sample.LEAST_FOR_MEAN then return ("band: lowest to highest of %d"):format(count) end
  return "band: 95 % bootstrap interval of the interquartile mean"
end

--- What lines and bands show: "Lines: median of n = 3 runs per arm; band: lowest to highest of 3."
function curves.meaning(list)
  local texts, seen = {}, {}
  for _, arm in ipairs(list) do
    local n = #arm.runs
    local centre = n == 1 and "Lines: one run (n = 1)" or ("Lines: %s of n = %d runs"):format(
      n >= sample.LEAST_FOR_MEAN and "interquartile mean" or "median", n)
    local band = curves.band_text(n, #list)
    local text = centre .. (#list > 1 and " per arm" or "") .. (band and "; " .. band or "")
    if not seen[text] then
      seen[text] = true
      texts[#texts + 1] = text
    end
  end
  return table.concat(texts, ". Or: ") .. "."
end

local function interval(values)
  if #values < sample.LEAST_FOR_MEAN then
    return math.min(unpack(values)), math.max(unpack(values))
  end
  return bootstrap.interval(values, sample.interquartile_mean, 0.95, RESAMPLES)
end

local function unfinished(arm)
  for _, run in ipairs(arm.runs) do
    if run.state ~= "done" then return true end
  end
  return false
end

--- A value of each generation over the repetitions of an arm: the centre, and the band where there
--- are several. The curve ends with the first repetition that ends; of runs that are not done those
--- count that have come so far.
---@param value fun(line: table, k: integer, run: limax.report.run): number|nil
---@param banded? boolean false: the band is left out
---@return number[][] points { generation, centre }
---@return number[][] band { generation, low, high }, of some generations of a long run
function curves.over(arm, value, banded)
  local points, band, longest, open = {}, {}, 0, unfinished(arm)
  for _, run in ipairs(arm.runs) do longest = math.max(longest, #run.lines) end
  local every = math.ceil(longest / BAND_PLACES)
  for k = 1, longest do
    local values, generation = {}, nil
    for _, run in ipairs(arm.runs) do
      local line = run.lines[k]
      values[#values + 1] = line and value(line, k, run) or nil
      generation = line and line.generation or generation
    end
    if #values == #arm.runs or #values > 0 and open then
      points[#points + 1] = { generation, (sample.centre(values)) }
      local place = (k - 1) % every == 0 or k == longest
      if #arm.runs > 1 and banded ~= false and place then
        band[#band + 1] = { generation, interval(values) }
      end
    end
  end
  return points, band
end

local function panel_of(title, label)
  return { title = title, x = { label = "generation", linear = true, whole = true },
    y = { label = label, linear = true }, curves = {}, bands = {} }
end

-- Adds the k-th line, and its band if there is one.
local function add(panel, name, k, points, band)
  local color, dash = palette.line(k)
  panel.curves[#panel.curves + 1] = { name = short(name), points = points, color = color,
    dash = dash, width = 2, marker = #points == 1 and "dot" or "none" }
  if band and #band > 1 then
    panel.bands[#panel.bands + 1] = { name = short(name), points = band, color = color }
  end
end

--- A value by generation, a line for each arm.
---@param list limax.report.arm[] an arm's `line` chooses its colour, else its place
---@param label string with the unit
---@param value fun(line: table, k: integer, run: limax.report.run): number|nil
---@return limax.chart.panel
function curves.panel(list, title, label, value)
  local panel = panel_of(title, label)
  for k, arm in ipairs(list) do
    add(panel, arm.name, arm.line or k, curves.over(arm, value, #list <= MOST_BANDS))
  end
  return panel
end

--- A value of a run by the evaluations that it took: points { evaluations, value }, generation by
--- generation. A generation without a value repeats the one before. An evaluation is one simulation
--- of a robot for its score; elites that keep their score need none, those of a tuning come first.
---@param value fun(line: table): number|nil
---@return number[][]
function curves.points(run, value)
  local points, spent, before = {}, run.before, nil
  for _, line in ipairs(run.lines) do
    spent = spent + line.evaluations
    before = value(line) or before
    if before then points[#points + 1] = { spent, before } end
  end
  return points
end

--- The value at a number of evaluations: that of the last generation that was complete by then; nil
--- before the first.
---@return number|nil
function curves.at(points, evaluations)
  local value
  for _, point in ipairs(points) do
    if point[1] > evaluations then break end
    value = point[2]
  end
  return value
end

--- A value against the simulations that it took, which are the budget; over the part that all runs
--- of an arm have.
---@param label string with the unit
---@param value fun(line: table): number|nil
---@return limax.chart.panel
function curves.by_evaluations(list, title, label, value)
  local panel = panel_of(title, label)
  panel.x.label = "evaluations (robots simulated)"
  for k, arm in ipairs(list) do
    local of_runs, low, high = {}, 0, math.huge
    for i, run in ipairs(arm.runs) do
      local points = curves.points(run, value)
      of_runs[i] = points
      low = math.max(low, points[1] and points[1][1] or math.huge)
      high = math.min(high, points[#points] and points[#points][1] or -math.huge)
    end
    local points, band = {}, {}
    for place = 0, low <= high and PLACES or -1 do
      local x, values = low + (high - low) * place / PLACES, {}
      for i, of_run in ipairs(of_runs) do values[i] = curves.at(of_run, x) end
      points[#points + 1] = { x, (sample.centre(values)) }
      if #values > 1 and #list <= MOST_BANDS then band[#band + 1] = { x, interval(values) } end
    end
    add(panel, arm.name, arm.line or k, points, band)
  end
  return panel
end

--- One arm's population: best, mean and median, over bands from the 10 % to the 90 % and from the
--- 25 % to the 75 % quantile; of several repetitions the centre of each.
---@return limax.chart.panel
function curves.population(arm, label)
  local panel = panel_of("population of " .. arm.name, label)
  local function points_of(name)
    return (curves.over(arm, function(line) return line.quantiles and line.quantiles[name] end,
      false))
  end
  for _, pair in ipairs { { "q10", "q90" }, { "q25", "q75" } } do
    local low, high, points = points_of(pair[1]), points_of(pair[2]), {}
    for k, point in ipairs(low) do points[k] = { point[1], point[2], high[k][2] } end
    panel.bands[#panel.bands + 1] = { points = points, color = "#56b4e9", opacity = 0.22,
      name = ("%s to %s"):format(pair[1], pair[2]) }
  end
  add(panel, "best", 1, (curves.over(arm, runs.score, false)))
  for k, name in ipairs { "median", "mean" } do
    add(panel, name, k + 1, (curves.over(arm, function(line) return line[name] end, false)))
  end
  panel.note = "bands: 10 to 90 % and 25 to 75 % of the robots"
  return panel
end

--- The best of each generation under the first materials; of one arm its mean too.
---@return limax.chart.panel
function curves.learning(list, label)
  local panel = curves.panel(list, "best of the generation", label, runs.score)
  if #list == 1 then
    panel.title = "best and mean"
    panel.curves[1].name = "best"
    if panel.bands[1] then panel.bands[1].name = "best" end
    add(panel, "mean", 2, curves.over(list[1], function(line) return line.mean end))
  end
  return panel
end

local ENDS = { [0] = "generation 0", [1] = "last" }

--- The first and the last value of each arm; of several runs each as a thin line.
---@param first_of fun(run: limax.report.run): number
---@param last_of fun(run: limax.report.run): number
---@return limax.chart.panel
function curves.first_last(list, title, label, first_of, last_of)
  local panel = panel_of(title, label)
  panel.x = { label = "", linear = true, low = -0.15, high = 1.1,
    text = function(value) return ENDS[value] end }
  for k, arm in ipairs(list) do
    local color, dash = palette.line(arm.line or k)
    local first, last = {}, {}
    for i, run in ipairs(arm.runs) do
      first[i], last[i] = first_of(run), last_of(run)
      if #arm.runs > 1 then
        panel.curves[#panel.curves + 1] = { color = color, width = 0.6, marker = "none",
          points = { { 0, first[i] }, { 1, last[i] } },
          title = ("%s, seed %s, repetition %d"):format(arm.name, run.seed, run.repetition) }
      end
    end
    panel.curves[#panel.curves + 1] = { name = short(arm.name), color = color, dash = dash,
      width = 2, points = { { 0, (sample.centre(first)) }, { 1, (sample.centre(last)) } } }
  end
  return panel
end

--- Three measures of diversity over the robots with a score.
---@return limax.chart.panel[]
function curves.diversity(list)
  local panels = {}
  for k, row in ipairs {
    { "voxels in which two robots differ", "share of voxels (1)", "hamming" },
    { "different bodies", "bodies", "distinct" },
    { "spread of the genes", "standard deviation (1)", "genotype" } } do
    panels[k] = curves.panel(list, row[1], row[2],
      function(line) return line.diversity.all and line.diversity.all[row[3]] end)
    panels[k].y.whole = row[3] == "distinct"
  end
  return panels
end

--- The names of the numbers that the fitness of any run returns beside its score, sorted.
function curves.measure_names(list)
  local named = {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.lines) do
        for name in pairs(line.measures or {}) do named[name] = true end
      end
    end
  end
  return choice.sorted_keys(named)
end

--- The champions' value of each of these numbers; empty where there is none.
---@return limax.chart.panel[]
function curves.measures(list)
  local panels = {}
  for k, name in ipairs(curves.measure_names(list)) do
    panels[k] = curves.panel(list, name .. " of the champion", name,
      function(line) return runs.measure(line, name) end)
  end
  return panels
end

--- Robots of a generation without a score.
---@param line table of metrics
function curves.failed(line)
  return line.failed.invalid + line.failed.diverged + line.failed.fitness
end

--- Robots that failed, of one arm by how they failed.
---@return limax.chart.panel
function curves.failures(list)
  local title = "robots without a score"
  local panel = #list > 1 and curves.panel(list, title, "robots", curves.failed)
    or panel_of(title, "robots")
  for k, name in ipairs(#list > 1 and {} or { "invalid", "diverged", "fitness" }) do
    add(panel, name, k, curves.over(list[1], function(line) return line.failed[name] end))
  end
  panel.y.whole = true
  return panel
end

--- Seconds that a generation took in all, and those of its simulation.
---@return limax.chart.panel[]
function curves.time(list)
  local function of(part)
    return function(_, k, run)
      local seconds, sum = run.timing[k] and run.timing[k].seconds, 0
      for name, value in pairs(seconds or {}) do
        if not part or part == name then sum = sum + value end
      end
      return seconds and sum
    end
  end
  return { curves.panel(list, "time of a generation", "seconds (s)", of()),
    curves.panel(list, "of which simulation", "seconds (s)", of "simulate") }
end

return curves
