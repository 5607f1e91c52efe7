--- metrics.lua: metrics.jsonl of a run as rows of plain values: `quantiles.q10` is the field q10 of
--- the object quantiles.

local choice = require "limax.base.choice"
local csv = require "limax.base.csv"
local flat = require "limax.base.flat"
local host = require "limax.host"
local input = require "limax.tools.convert.input"
local timestamp = require "limax.base.timestamp"

local metrics = {}

local function is_count(value)
  return type(value) == "number" and value >= 0 and value == math.floor(value)
end

-- The lines of a file of a run folder, decoded.
local function lines_of(path)
  local list = {}
  for line in input.read(path):gmatch "[^\n]+" do
    local value = host.json.decode(line)
    if type(value) ~= "table" or not is_count(value.repetition)
      or not is_count(value.generation) then
      input.refuse(path, "line %d: expected an object of a repetition and a generation", #list + 1)
    end
    list[#list + 1] = value
  end
  if #list == 0 then input.refuse(path, "holds no generation yet") end
  return list
end

local function plain(value)
  if type(value) ~= "table" and value ~= host.json.null then return value end
end

--- The rows of a run, in the order of its file.
---@param folder string
---@return table<string, any>[] rows by name of column
---@return string[] names repetition and generation, then the others sorted
function metrics.read(folder)
  local rows, seen = {}, {}
  for i, line in ipairs(lines_of(folder .. "/metrics.jsonl")) do
    line.schema = nil
    rows[i] = flat.add(line, "", {}, plain)
    for name in pairs(rows[i]) do seen[name] = true end
  end
  seen.repetition, seen.generation = nil, nil
  local names = choice.sorted_keys(seen)
  table.insert(names, 1, "generation")
  table.insert(names, 1, "repetition")
  return rows, names
end

--- When each generation ended, seconds since 1970: [repetition][generation].
---@param folder string
---@return table<integer, table<integer, number>>
function metrics.times(folder)
  local times = {}
  for _, line in ipairs(lines_of(folder .. "/timing.jsonl")) do
    times[line.repetition] = times[line.repetition] or {}
    times[line.repetition][line.generation] = timestamp.seconds(line.ended) or 0
  end
  return times
end

--- The metrics of a run as CSV (RFC 4180). Missing values are empty.
---@param folder string
---@return string
function metrics.csv(folder)
  local rows, names = metrics.read(folder)
  return csv.encode(names, rows)
end

return metrics
