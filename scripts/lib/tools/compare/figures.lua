--- figures.lua: the folder that `limax compare --out DIR` and a study write: the comparison as
--- text, CSV, JSON and LaTeX, and the figures as SVG, each with its data as CSV: learning curves,
--- diversity curves, what the supervisor changed, generation 0 against the last. Curves are those
--- of a report.

local csv = require "limax.base.csv"
local failure = require "limax.base.failure"
local figure = require "limax.draw.chart.figure"
local host = require "limax.host"
local measures = require "limax.tools.compare.measures"
local panels = require "limax.tools.report.curves"
local parameters = require "limax.tools.report.parameters"
local runs = require "limax.tools.compare.runs"
local source = require "limax.base.source"
local supervise = require "limax.supervise"
local tables = require "limax.tools.compare.tables"

local figures = {}

-- mm
local WIDTH = 175

-- CSV of rows that `add_rows(run, add)` adds for each run, after columns that identify the run.
local function csv_of(list, names, add_rows)
  local columns, rows = { "arm", "seed", "repetition", unpack(names) }, {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      add_rows(run, function(fields)
        local row = { arm = arm.name, seed = run.seed, repetition = run.repetition }
        for _, name in ipairs(names) do row[name] = fields[name] end
        rows[#rows + 1] = row
      end)
    end
  end
  return csv.encode(columns, rows)
end

-- CSV with a row per run and generation; `values(line)` has the named columns of a row.
local function by_line(list, names, values)
  return csv_of(list, { "generation", "evaluations", unpack(names) }, function(run, add)
    local spent = run.before
    for _, line in ipairs(run.lines) do
      spent = spent + line.evaluations
      add(setmetatable({ generation = line.generation, evaluations = spent },
        { __index = values(line) }))
    end
  end)
end

local function learning(list, result)
  return { name = "learning", title = "Learning curves",
    text = "The best of each generation under the first materials. What is tested: "
      .. result.outcome .. ".",
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

local function changes(list)
  local drawn = {}
  for _, name in ipairs(supervise.parameters) do drawn[#drawn + 1] = by_generation(list, name) end
  for _, path in ipairs((parameters.fields(list))) do
    if path:find "^materials%." then drawn[#drawn + 1] = by_generation(list, path) end
  end
  return { name = "changes", title = "What the supervisors changed", panels = drawn,
    text = "As applied, after the ledger's limits; changes.csv has each proposal and its outcome.",
    csv = csv_of(list, { "generation", "supervisor", "source", "field", "before", "proposed",
      "applied", "outcome", "reason" }, function(run, add)
      for _, line in ipairs(run.ledger) do
        for _, entry in ipairs(line.entries) do
          local row = setmetatable({ generation = line.generation, supervisor = line.supervisor,
            source = line.source }, { __index = entry })
          if entry.outcome ~= "kept" then add(row) end
        end
      end
    end) }
end

local function first_last(list, outcomes)
  local function first_of(run)
    local points = panels.points(run, runs.score)
    return points[1] and points[1][2] or 0
  end
  return { name = "first_last", title = "Generation 0 against the last",
    panels = { panels.first_last(list, "best_standard", "fitness", first_of, measures.last) },
    text = "Arms of equal seeds and repetitions begin with the same populations.",
    csv = csv_of(list, { "generations", "evaluations", "best_first", "best_last", "outcome",
      "mean_first", "mean_last", "hamming_first", "hamming_last" }, function(run, add)
      local a, b = run.lines[1], run.lines[#run.lines]
      add { generations = #run.lines, evaluations = run.evaluations, best_first = first_of(run),
        best_last = measures.last(run), outcome = outcomes[run], mean_first = a.mean,
        mean_last = b.mean, hamming_first = a.diversity.all and a.diversity.all.hamming,
        hamming_last = b.diversity.all and b.diversity.all.hamming }
    end) }
end

--- Writes a comparison in every form, with the figures and their data.
---@param outcomes table<limax.compare.run, number>
function figures.write(folder, result, list, outcomes)
  local made, message = host.file.mkdir(folder)
  if not made then failure.raise(2, message) end
  local function write(name, text) source.write(folder .. "/" .. name, text) end
  write("compare.txt", tables.text(result, { color = false, ascii = true, width = 80 }))
  write("compare.csv", tables.csv(result))
  write("compare.json", tables.json(result))
  write("compare.tex", tables.latex(result))
  -- an arm's line has the same colour in every panel
  for k, arm in ipairs(list) do arm.line = k end
  for _, each in ipairs { learning(list, result), diversity(list), changes(list),
    first_last(list, outcomes) } do
    each.foot = ("%s %s"):format(each.text, panels.meaning(list))
    write(each.name .. ".svg", figure.draw("svg", each, WIDTH))
    write(each.name .. ".csv", each.csv)
  end
end

return figures
