--- run_metrics.lua: the metrics of a run as CSV.

local choice = require "limax.base.choice"
local csv = require "limax.base.csv"
local failure = require "limax.base.failure"
local flat = require "limax.base.flat"
local host = require "limax.host"
local runs = require "limax.tools.report.runs"

local run_metrics = {}

local function plain(value)
  if type(value) ~= "table" and value ~= host.json.null then return value end
end

--- The metrics of a run as CSV (RFC 4180), a row for each repetition and generation, which are the
--- first columns; the others are sorted. `quantiles.q10` is the field q10 of the object quantiles.
--- Missing values are empty.
function run_metrics.csv(folder)
  local rows, seen = {}, {}
  for _, run in ipairs(runs.read(folder).runs) do
    for _, line in ipairs(run.lines) do
      rows[#rows + 1] = flat.add(line, "", {}, plain)
      rows[#rows].schema = nil
      for name in pairs(rows[#rows]) do seen[name] = true end
    end
  end
  if #rows == 0 then failure.raise(2, folder .. ": no generation has been scored yet") end
  seen.repetition, seen.generation = nil, nil
  return csv.encode({ "repetition", "generation", unpack(choice.sorted_keys(seen)) }, rows)
end

return run_metrics
