--- curves.lua: the curves of runs as panels, which figures, the page and the terminal draw alike.
--- A line is the centre of an arm's repetitions; its band is their spread.

local bootstrap = require "limax.base.statistics.bootstrap"
local changes = require "limax.run.changes"
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
-- letters of a name beside its curve
local MOST_LETTERS = 22

-- A name that fits beside a curve; letters of UTF-8 stay whole.
local function short(name)
  if #name <= MOST_LETTERS then return name end
  return name:sub(1, MOST_LETTERS - 1):gsub("[\192-\255][\128-\191]*$", "") .. "…"
end

--- Explains lines and bands, "Lines: median of n = 3 runs per arm; band: lowest to highest of 3.",
--- and the dashed lines where scores change their meaning.
function curves.meaning(list)
  local texts = {}
  for k, arm in ipairs(list) do
    local n, many = #arm.runs, #arm.runs >= sample.LEAST_FOR_MEAN
    local text = n == 1 and "Lines: one run (n = 1)" or ("Lines: %s of n = %d runs"):format(
      many and "interquartile mean" or "median", n)
    if #list > 1 then text = text .. " per arm" end
    if n > 1 and #list <= MOST_BANDS then
      text = text .. (many and "; band: 95 % bootstrap interval of the interquartile mean"
        or ("; band: lowest to highest of %d"):format(n))
    end
    texts[k] = text
  end
  local changed = {}
  for _, arm in ipairs(list) do
    for _, text in ipairs(runs.changed(arm.runs, function() return arm.name end)) do
      changed[#changed + 1] = text
    end
  end
  return table.concat(runs.distinct(texts), ". Or: ") .. "." .. (changed[1]
    and (" Dashed: what scores mean changed (%s)."):format(table.concat(changed, "; ")) or "")
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

-- Where the scores of any run change their meaning; one line for a generation.
local function changes_of(list)
  local found, seen = {}, {}
  for _, run in ipairs(runs.of(list)) do
    for _, change in ipairs(run.changes or {}) do
      if change.generation < #run.lines and not seen[change.generation] then
        seen[change.generation] = true
        found[#found + 1] = { x = change.generation, text = short(changes.names(change)) }
      end
    end
  end
  return found
end

local function panel_of(list, title, label)
  return { title = title, x = { label = "generation", whole = true },
    y = { label = label, whole = label == "robots" or label == "bodies" },
    curves = {}, bands = {}, changes = changes_of(list) }
end

-- Adds the k-th line, and its band if there is one.
local function add(panel, name, k, points, band)
  local color, dash = palette.line(k)
  panel.curves[#panel.curves + 1] = { name = short(name), points = points, color = color,
    dash = dash, width = 2, marker = #points == 1 and "dot" or "none" }
  if #band > 1 then
    panel.bands[#panel.bands + 1] = { name = short(name), points = band, color = color }
  end
end

--- A value by generation, a line for each arm that has it.
---@param label string with the unit
function curves.panel(list, title, label, value)
  local panel = panel_of(list, title, label)
  for k, arm in ipairs(list) do
    local points, band = curves.over(arm, value, #list <= MOST_BANDS)
    if #points > 0 then add(panel, arm.name, k, points, band) end
  end
  return panel
end

--- Several values of one arm by generation.
---@param values { [1]: string, [2]: fun(line: table): number|nil }[] name and value of each line
function curves.values(arm, title, label, values)
  local panel = panel_of({ arm }, title, label)
  for k, each in ipairs(values) do add(panel, each[1], k, curves.over(arm, each[2])) end
  return panel
end

local function mean(line) return line.mean end

--- The best of each generation under the first materials; of one arm its mean too.
function curves.learning(list, label)
  if #list > 1 then return curves.panel(list, "best of the generation", label, runs.score) end
  return curves.values(list[1], "best and mean", label, { { "best", runs.score },
    { "mean", mean } })
end

--- One arm's population: best, median and mean, over a band from the 10 % to the 90 % quantile; of
--- several repetitions the centre of each.
function curves.population(arm, label)
  local panel = curves.values(arm, "population of " .. arm.name, label, {
    { "best", runs.score }, { "median", function(line) return line.median end },
    { "mean", mean } })
  local function points_of(name)
    return (curves.over(arm, function(line) return line.quantiles and line.quantiles[name] end,
      false))
  end
  local low, high, band = points_of "q10", points_of "q90", {}
  for k, point in ipairs(low) do band[k] = { point[1], point[2], high[k][2] } end
  panel.bands = { { points = band, color = "#56b4e9", opacity = 0.22, name = "q10 to q90" } }
  panel.note = "band: 10 to 90 % of the robots"
  return panel
end

--- Robots of a generation without a score.
---@param line table of metrics
function curves.failed(line)
  return line.failed.invalid + line.failed.diverged + line.failed.fitness
end

return curves
