--- figures.lua: the data of the paper's figures, each as CSV with a line per run and generation,
--- and as SVG: learning curves, diversity curves, what the supervisor changed, generation 0 against
--- the last. Curves show the centre of an arm's runs; of up to four arms each run, too, as a thin
--- line.

local choice = require "limax.base.choice"
local csv = require "limax.base.csv"
local curves = require "limax.tools.compare.curves"
local figure = require "limax.draw.chart.figure"
local outcome = require "limax.tools.compare.outcome"
local palette = require "limax.draw.palette"
local runs = require "limax.tools.compare.runs"
local sample = require "limax.base.statistics.sample"
local supervise = require "limax.supervise"

local figures = {}

-- places at which curves over evaluations are drawn
local PLACES = 120
-- more arms than this and the lines of single runs hide each other
local MOST_WITH_RUNS = 4
-- mm
local WIDTH = 175

-- Adds an arm's curve, and its runs' thin ones. `points_of(run)` are { x, y }; `xs` the places.
local function add_curves(panel, arm, k, count, xs, points_of)
  local color, dash = palette.line(k)
  local of_runs, middle = {}, {}
  for i, run in ipairs(arm.runs) do
    of_runs[i] = points_of(run)
    if count <= MOST_WITH_RUNS then
      table.insert(panel.curves, { points = of_runs[i], color = color, width = 0.5,
        marker = "none" })
    end
  end
  for _, x in ipairs(xs) do
    local values = {}
    for _, points in ipairs(of_runs) do
      -- a run does not count beyond its end
      local last = points[#points]
      values[#values + 1] = last and x <= last[1] and curves.at(points, x) or nil
    end
    if #values == #of_runs then middle[#middle + 1] = { x, (sample.centre(values)) } end
  end
  table.insert(panel.curves, { name = arm.name, points = middle, color = color, dash = dash,
    width = 2, marker = "none" })
end

local function panel_of(title, x_label, y_label)
  return { title = title, x = { label = x_label, linear = true },
    y = { label = y_label, linear = true }, curves = {} }
end

-- Places between the first generation and the longest run.
local function places(list, points_of)
  local low, high, xs = math.huge, 0, {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      local points = points_of(run)
      if #points > 0 then
        low, high = math.min(low, points[1][1]), math.max(high, points[#points][1])
      end
    end
  end
  for k = 0, PLACES do xs[k + 1] = low + (high - low) * k / PLACES end
  return xs
end

local function by_evaluations(list, title, label, value)
  local panel = panel_of(title, "evaluations", label)
  local function points_of(run) return curves.points(run, value) end
  local xs = places(list, points_of)
  for k, arm in ipairs(list) do add_curves(panel, arm, k, #list, xs, points_of) end
  return panel
end

-- ---- data ---------------------------------------------------------------------------------------

-- CSV with a row per run and generation; `values(line)` are the named columns of a row.
local function by_line(list, names, values)
  local rows, columns = {}, { "arm", "seed", "repetition", "generation", "evaluations" }
  for _, name in ipairs(names) do columns[#columns + 1] = name end
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      local spent = run.before
      for _, line in ipairs(run.lines) do
        spent = spent + line.evaluations
        local row = { arm = arm.name, seed = run.seed, repetition = run.repetition,
          generation = line.generation, evaluations = spent }
        local own = values(line)
        for _, name in ipairs(names) do row[name] = own[name] end
        rows[#rows + 1] = row
      end
    end
  end
  return csv.encode(columns, rows)
end

local function learning(list)
  return { name = "learning", title = "Learning curves",
    text = "The best of each generation under the first materials. What is tested: "
      .. outcome.TEXT .. ".",
    panels = { by_evaluations(list, "best_standard", "fitness", runs.score),
      by_evaluations(list, "mean of the population", "fitness",
        function(line) return line.mean end) },
    csv = by_line(list, { "best_standard", "best", "mean", "median", "worst" },
      function(line) return line end) }
end

local function diversity(list)
  local function of(name)
    return function(line) return line.diversity.all and line.diversity.all[name] end
  end
  return { name = "diversity", title = "Diversity curves",
    text = "Over all robots with a score. A distinct design may lower the mean distance: look"
      .. " at both.",
    panels = { by_evaluations(list, "voxels in which two robots differ", "share", of "hamming"),
      by_evaluations(list, "different bodies", "number", of "distinct"),
      by_evaluations(list, "spread of the genes", "standard deviation", of "genotype") },
    csv = by_line(list, { "hamming", "distinct", "genotype", "hamming_top", "distinct_top" },
      function(line)
        local all, top = line.diversity.all or {}, line.diversity.top or {}
        return { hamming = all.hamming, distinct = all.distinct, genotype = all.genotype,
          hamming_top = top.hamming, distinct_top = top.distinct }
      end) }
end

-- Fields of materials that any run changed, as "MATERIAL.FIELD".
local function changed_materials(list)
  local found = {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      local first = run.lines[1].materials
      for _, line in ipairs(run.lines) do
        for name, fields in pairs(line.materials) do
          for field, value in pairs(fields) do
            if value ~= first[name][field] then found[name .. "." .. field] = true end
          end
        end
      end
    end
  end
  return choice.sorted_keys(found)
end

-- Does a value change within a run of this arm?
local function moves(arm, value)
  for _, run in ipairs(arm.runs) do
    for _, line in ipairs(run.lines) do
      if value(line) ~= value(run.lines[1]) then return true end
    end
  end
  return false
end

-- A value by generation, of the arms in which it moves; of all if it moves in none.
local function by_generation(list, title, value)
  local panel = panel_of(title, "generation", title)
  local function points_of(run)
    local points = {}
    for k, line in ipairs(run.lines) do points[k] = { line.generation, value(line) } end
    return points
  end
  local longest, xs, still = 0, {}, 0
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do longest = math.max(longest, #run.lines) end
    still = still + (moves(arm, value) and 0 or 1)
  end
  for generation = 0, longest - 1 do xs[#xs + 1] = generation end
  local all = still == #list
  for k, arm in ipairs(list) do
    if all or moves(arm, value) then add_curves(panel, arm, k, #list, xs, points_of) end
  end
  if still > 0 and not all then
    panel.note = ("unchanged in %d of the arms, which are not drawn"):format(still)
  end
  return panel
end

-- Every entry of every ledger, except those that were kept.
local function ledger_csv(list)
  local rows = {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.ledger) do
        for _, entry in ipairs(line.entries) do
          if entry.outcome ~= "kept" then
            rows[#rows + 1] = { arm = arm.name, seed = run.seed, repetition = run.repetition,
              generation = line.generation, supervisor = line.supervisor, source = line.source,
              field = entry.field, before = entry.before, proposed = entry.proposed,
              applied = entry.applied, outcome = entry.outcome, reason = entry.reason }
          end
        end
      end
    end
  end
  return csv.encode({ "arm", "seed", "repetition", "generation", "supervisor", "source", "field",
    "before", "proposed", "applied", "outcome", "reason" }, rows)
end

local function changes(list)
  local panels = {}
  for _, name in ipairs(supervise.parameters) do
    panels[#panels + 1] = by_generation(list, name, function(line) return line.parameters[name] end)
  end
  for _, path in ipairs(changed_materials(list)) do
    local material, field = path:match "^(.*)%.([^.]*)$"
    panels[#panels + 1] = by_generation(list, path,
      function(line) return line.materials[material][field] end)
  end
  return { name = "changes", title = "What the supervisors changed",
    text = "As applied, after the ledger's limits; changes.csv has each proposal and its outcome.",
    panels = panels, csv = ledger_csv(list) }
end

local ENDS = { [0] = "generation 0", [1] = "the last" }

local function first_last(list, outcomes)
  local panel = panel_of("best_standard", "", "fitness")
  panel.x.low, panel.x.high = -0.1, 1.02
  panel.x.text = function(value) return ENDS[value] end
  local rows = {}
  for k, arm in ipairs(list) do
    local first, last = {}, {}
    for i, run in ipairs(arm.runs) do
      local points = curves.points(run, runs.score)
      local a, b = run.lines[1], run.lines[#run.lines]
      first[i], last[i] = points[1] and points[1][2] or 0, curves.last(run)
      rows[#rows + 1] = { arm = arm.name, seed = run.seed, repetition = run.repetition,
        generations = #run.lines, evaluations = run.evaluations, best_first = first[i],
        best_last = last[i], outcome = outcomes[run], mean_first = a.mean, mean_last = b.mean,
        hamming_first = a.diversity.all and a.diversity.all.hamming,
        hamming_last = b.diversity.all and b.diversity.all.hamming }
    end
    local color, dash = palette.line(k)
    panel.curves[k] = { name = arm.name, color = color, dash = dash, width = 2, marker = "dot",
      points = { { 0, (sample.centre(first)) }, { 1, (sample.centre(last)) } } }
  end
  return { name = "first_last", title = "Generation 0 against the last", panels = { panel },
    text = "Arms of equal seeds and repetitions begin with the same populations.",
    csv = csv.encode({ "arm", "seed", "repetition", "generations", "evaluations", "best_first",
      "best_last", "outcome", "mean_first", "mean_last", "hamming_first", "hamming_last" }, rows) }
end

--- All figures of a comparison: file name to text.
---@param list limax.compare.arm[]
---@param outcomes table<limax.compare.run, number>
---@return table<string, string>
function figures.files(list, outcomes)
  local files, count = {}, #list[1].runs
  local centre = count >= sample.LEAST_FOR_MEAN and "interquartile mean" or "median"
  for _, each in ipairs { learning(list), diversity(list), changes(list),
    first_last(list, outcomes) } do
    each.foot = ("%s %d arms, %d runs in the first; curves: the %s of the runs."):format(each.text,
      #list, count, centre)
    files[each.name .. ".svg"] = figure.draw("svg", each, WIDTH)
    files[each.name .. ".csv"] = each.csv
  end
  return files
end

return figures
