--- facts.lua: the tables of a report: results, costs, configurations and their differences,
--- proposals of supervisors.

local choice = require "limax.base.choice"
local charts = require "limax.tools.report.charts"
local curves = require "limax.tools.report.curves"
local flat = require "limax.base.flat"
local host = require "limax.host"
local duration = require "limax.base.duration"
local runs = require "limax.tools.report.runs"
local schema = require "limax.engine.schema"

local facts = {}

-- Rows of proposals: enough to follow a run, few enough to scroll.
local MOST_PROPOSALS = 200

local function seconds_of(run)
  local sum, parts = 0, {}
  for _, line in ipairs(run.timing) do
    for name, value in pairs(line.seconds) do
      sum, parts[name] = sum + value, (parts[name] or 0) + value
    end
  end
  return sum, parts
end

--- One row for each repetition of each run.
function facts.final(list)
  local rows, measures = {}, charts.measure_names(list)
  local columns = { "arm", "seed", "repetition", "state", "generations", "evaluations",
    "best of generation 0", "best of the last", "best of all", "mean of the last",
    "diversity of the last", "failed robots", "moved too far in a step", "time" }
  for _, name in ipairs(measures) do columns[#columns + 1] = name .. " of its champion" end
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      local first, last, failed, coarse = run.lines[1], run.lines[#run.lines], 0, 0
      local most = -math.huge
      for _, line in ipairs(run.lines) do
        failed, coarse = failed + curves.failed(line), coarse + (line.coarse or 0)
      end
      for _, line in ipairs(runs.comparable(run)) do
        most = math.max(most, runs.score(line) or -math.huge)
      end
      local row = { arm.name, run.seed, run.repetition, run.state,
        #run.lines, run.evaluations, runs.score(first) or "-", runs.score(last) or "-",
        most > -math.huge and most or "-", last.mean or "-",
        last.diversity.all and last.diversity.all.hamming or "-", failed,
        coarse, (duration((seconds_of(run)))) }
      for _, name in ipairs(measures) do
        row[#row + 1] = runs.measure(last, name) or "-"
      end
      rows[#rows + 1] = row
    end
  end
  return columns, rows
end

-- The parts of a generation's time, in their order.
local PARTS = { "supervise", "breed", "express", "simulate", "fitness", "write" }
-- The costs of a model: fields of a line of timing, and their columns.
local MODEL = { { "asks", "model's questions" }, { "fallen_back", "without its answer" },
  { "model_seconds", "waiting for it, s" }, { "input_tokens", "tokens read" },
  { "output_tokens", "tokens written" }, { "cost", "cost" } }

--- Time by part, and what a model cost where one was asked.
function facts.cost(list)
  local columns, rows, asked = { "arm", "runs", "evaluations" }, {}, false
  for k, arm in ipairs(list) do
    local row, sums, model = { arm.name, #arm.runs, 0 }, {}, {}
    for _, run in ipairs(arm.runs) do
      row[3] = row[3] + run.evaluations
      local _, parts = seconds_of(run)
      for name, value in pairs(parts) do sums[name] = (sums[name] or 0) + value end
      for _, line in ipairs(run.timing) do
        for _, field in ipairs(MODEL) do
          local value = (line.supervision or {})[field[1]]
          if type(value) == "boolean" then value = value and 1 or 0 end
          if value then model[field[1]] = (model[field[1]] or 0) + value end
        end
      end
    end
    asked = asked or model.asks ~= nil
    for _, name in ipairs(PARTS) do row[#row + 1] = sums[name] or 0 end
    for _, field in ipairs(MODEL) do row[#row + 1] = model[field[1]] or "-" end
    rows[k] = row
  end
  for _, name in ipairs(PARTS) do columns[#columns + 1] = name .. ", s" end
  for _, field in ipairs(asked and MODEL or {}) do columns[#columns + 1] = field[2] end
  return columns, rows
end

-- A value of a configuration in a table; a list of values is one.
local function shown(value)
  if value == host.json.null then return "null" end
  if type(value) ~= "table" or #value == 0 then return flat.text(value) end
  local texts = {}
  for k, entry in ipairs(value) do
    if type(entry) == "table" then return nil end
    texts[k] = schema.show(entry)
  end
  return table.concat(texts, ", ")
end

--- A configuration as rows of path and value.
function facts.configuration(config)
  local fields, rows = flat.add(config, "", {}, shown), {}
  for _, path in ipairs(choice.sorted_keys(fields)) do rows[#rows + 1] = { path, fields[path] } end
  return rows
end

--- Fields in which configurations differ: a column for each folder.
function facts.differences(folders)
  local all, paths, columns, rows = {}, {}, { "field" }, {}
  for k, folder in ipairs(folders) do
    all[k], columns[k + 1] = flat.add(folder.config, "", {}, shown), folder.path
    for path in pairs(all[k]) do paths[path] = true end
  end
  for _, path in ipairs(choice.sorted_keys(paths)) do
    local row, differs = { path }, false
    for k = 1, #all do
      row[k + 1] = all[k][path] or "absent"
      differs = differs or row[k + 1] ~= row[2]
    end
    if differs then rows[#rows + 1] = row end
  end
  return columns, rows
end

--- The changes by supervisors, with reasons, the newest last.
---@return string[] columns
---@return any[][] rows
---@return integer left out
function facts.proposals(list)
  local rows = {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.ledger) do
        local changes = {}
        for _, entry in ipairs(line.entries) do
          if entry.outcome ~= "kept" then
            changes[#changes + 1] = ("%s %s %s%s"):format(entry.field or "-", entry.outcome or "-",
              entry.applied ~= nil and ("%.4g"):format(entry.applied) or "",
              entry.reason and " (" .. tostring(entry.reason) .. ")" or "")
          end
        end
        if line.reason or #changes > 0 then
          rows[#rows + 1] = { line.generation, arm.name, run.repetition,
            line.source or line.supervisor or "-", line.reason or "", table.concat(changes, "; ") }
        end
      end
    end
  end
  local out = math.max(0, #rows - MOST_PROPOSALS)
  local kept = { unpack(rows, out + 1) }
  return { "generation", "arm", "repetition", "by", "reason", "changes" }, kept, out
end

return facts
