--- metrics.lua: the metrics of a run as rows of plain values: `quantiles.q10` is the field q10 of
--- the object quantiles.

local choice = require "limax.base.choice"
local csv = require "limax.base.csv"
local failure = require "limax.base.failure"
local flat = require "limax.base.flat"
local host = require "limax.host"
local runs = require "limax.tools.report.runs"
local timestamp = require "limax.base.timestamp"

local metrics = {}

local function plain(value)
  if type(value) ~= "table" and value ~= host.json.null then return value end
end

--- The rows of a run: repetition by repetition, generation by generation.
---@return table<string, any>[] rows by name of column
---@return string[] names repetition and generation, then the others sorted
---@return number[] times when each generation ended, seconds since 1970, 0 if unknown
function metrics.read(folder)
  local rows, seen, times = {}, {}, {}
  for _, run in ipairs(runs.read(folder).runs) do
    for k, line in ipairs(run.lines) do
      rows[#rows + 1] = flat.add(line, "", {}, plain)
      rows[#rows].schema = nil
      for name in pairs(rows[#rows]) do seen[name] = true end
      times[#rows] = timestamp.seconds((run.timing[k] or {}).ended) or 0
    end
  end
  if #rows == 0 then failure.raise(2, folder .. ": no generation has been scored yet") end
  seen.repetition, seen.generation = nil, nil
  return rows, { "repetition", "generation", unpack(choice.sorted_keys(seen)) }, times
end

--- The metrics of a run as CSV (RFC 4180). Missing values are empty.
function metrics.csv(folder)
  local rows, names = metrics.read(folder)
  return csv.encode(names, rows)
end

return metrics
