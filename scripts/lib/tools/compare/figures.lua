--- figures.lua: the data of the paper's figures, each as CSV with a line per run and generation,
--- and as SVG: learning curves, diversity curves, what the supervisor changed, generation 0 against
--- the last. Curves are those of a report.

local csv = require "limax.base.csv"
local exploratory = require "limax.tools.compare.exploratory"
local figure = require "limax.draw.chart.figure"
local outcome = require "limax.tools.compare.outcome"
local panels = require "limax.tools.report.curves"
local parameters = require "limax.tools.report.parameters"
local runs = require "limax.tools.compare.runs"
local supervise = require "limax.supervise"

local figures = {}

-- mm
local WIDTH = 175

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
    panels = { panels.by_evaluations(list, "best_standard", "fitness", runs.score),
      panels.by_evaluations(list, "mean of the population", "fitness",
        function(line) return line.mean end) },
    csv = by_line(list, { "best_standard", "best", "mean", "median", "worst" },
      function(line) return line end) }
end

local function diversity(list)
  return { name = "diversity", title = "Diversity curves", panels = panels.diversity(list),
    text = "Over all robots with a score. A distinct design may lower the mean distance: look"
      .. " at both.",
    csv = by_line(list, { "hamming", "distinct", "genotype", "hamming_top", "distinct_top" },
      function(line)
        local all, top = line.diversity.all or {}, line.diversity.top or {}
        return { hamming = all.hamming, distinct = all.distinct, genotype = all.genotype,
          hamming_top = top.hamming, distinct_top = top.distinct }
      end) }
end

-- A field by generation, of the arms in which it changes; of all if it changes in none.
local function by_generation(list, path)
  local title, changing = path:gsub("^materials%.", ""), {}
  for _, arm in ipairs(list) do
    if parameters.changes(arm, path) then changing[#changing + 1] = arm end
  end
  local panel = panels.panel(#changing > 0 and changing or list, title, title,
    parameters.reader(path))
  if #changing > 0 and #changing < #list then
    panel.note = ("unchanged in %d of the arms, which are not drawn"):format(#list - #changing)
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
  local drawn = {}
  for _, name in ipairs(supervise.parameters) do drawn[#drawn + 1] = by_generation(list, name) end
  for _, path in ipairs((parameters.fields(list))) do
    if path:find "^materials%." then drawn[#drawn + 1] = by_generation(list, path) end
  end
  return { name = "changes", title = "What the supervisors changed", panels = drawn,
    text = "As applied, after the ledger's limits; changes.csv has each proposal and its outcome.",
    csv = ledger_csv(list) }
end

local function first_last(list, outcomes)
  local rows = {}
  local function first_of(run)
    local points = panels.points(run, runs.score)
    return points[1] and points[1][2] or 0
  end
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      local a, b = run.lines[1], run.lines[#run.lines]
      rows[#rows + 1] = { arm = arm.name, seed = run.seed, repetition = run.repetition,
        generations = #run.lines, evaluations = run.evaluations, best_first = first_of(run),
        best_last = exploratory.last(run), outcome = outcomes[run], mean_first = a.mean,
        mean_last = b.mean, hamming_first = a.diversity.all and a.diversity.all.hamming,
        hamming_last = b.diversity.all and b.diversity.all.hamming }
    end
  end
  return { name = "first_last", title = "Generation 0 against the last",
    panels = { panels.first_last(list, "best_standard", "fitness", first_of, exploratory.last) },
    text = "Arms of equal seeds and repetitions begin with the same populations.",
    csv = csv.encode({ "arm", "seed", "repetition", "generations", "evaluations", "best_first",
      "best_last", "outcome", "mean_first", "mean_last", "hamming_first", "hamming_last" }, rows) }
end

--- All figures of a comparison: file name to text.
---@param outcomes table<limax.compare.run, number>
---@return table<string, string>
function figures.files(list, outcomes)
  local files = {}
  -- an arm's line has the same colour in every panel
  for k, arm in ipairs(list) do arm.line = k end
  for _, each in ipairs { learning(list), diversity(list), changes(list),
    first_last(list, outcomes) } do
    each.foot = ("%s %s"):format(each.text, panels.meaning(list))
    files[each.name .. ".svg"] = figure.draw("svg", each, WIDTH)
    files[each.name .. ".csv"] = each.csv
  end
  return files
end

return figures
