--- metrics.lua: the lines of a run's metrics.jsonl as rows of plain values, for tables and curves:
--- `quantiles.q10` is the field q10 of the object quantiles.

local choice = require "limax.base.choice"
local csv = require "limax.base.csv"
local flat = require "limax.base.flat"
local host = require "limax.host"
local input = require "limax.tools.convert.input"

local metrics = {}

local function plain(value)
  if type(value) ~= "table" and value ~= host.json.null then return value end
end

-- Where repetitions and generations begin, and most of either.
local LEAST, MOST = { repetition = 1, generation = 0 }, 1e6

-- The lines of one file of a run folder, decoded; each is of a repetition and a generation.
local function lines_of(path)
  local list, number = {}, 0
  for line in input.read(path):gmatch "[^\n]+" do
    number = number + 1
    local where = ("line %d"):format(number)
    local value, message = host.json.decode(line, where)
    if type(value) ~= "table" then
      input.refuse(path, "%s", message or where .. ": expected an object")
    end
    for _, field in ipairs { "repetition", "generation" } do
      local given, least = value[field], LEAST[field]
      if type(given) ~= "number" or given ~= math.floor(given) or given < least or given > MOST then
        input.refuse(path, "%s: %s: expected a whole number from %d to %d", where, field, least,
          MOST)
      end
    end
    list[number] = value
  end
  if number == 0 then input.refuse(path, "holds no generation yet") end
  return list
end

--- Rows of a run, in its order.
---@param folder string
---@return table<string, any>[] rows by name of column
---@return string[] names repetition and generation, then the rest in order of the alphabet
function metrics.read(folder)
  local rows, seen = {}, {}
  for i, line in ipairs(lines_of(folder .. "/metrics.jsonl")) do
    line.schema = nil
    rows[i] = flat.add(line, "", {}, plain)
    for name in pairs(rows[i]) do seen[name] = true end
  end
  seen.repetition, seen.generation = nil, nil
  local names = { "repetition", "generation" }
  for _, name in ipairs(choice.sorted_keys(seen)) do names[#names + 1] = name end
  return rows, names
end

-- Seconds since 1970 of "2026-11-21T10:15:03Z": days from the civil calendar, whose year is taken
-- to begin in March, so that the leap day is its last.
local function seconds_of(text)
  local year, month, day, hour, minute, second =
    tostring(text):match "^(%d%d%d%d)-(%d%d)-(%d%d)T(%d%d):(%d%d):(%d%d)Z$"
  if not year then return 0 end
  year, month = tonumber(year), tonumber(month)
  if month <= 2 then year, month = year - 1, month + 12 end
  local days = 365 * year + math.floor(year / 4) - math.floor(year / 100) + math.floor(year / 400)
    + math.floor((153 * (month - 3) + 2) / 5) + day - 1 - 719468
  return ((days * 24 + hour) * 60 + minute) * 60 + second
end

--- When each generation ended, s since 1970: [repetition][generation].
---@param folder string
---@return table<integer, table<integer, number>>
function metrics.times(folder)
  local times = {}
  for _, line in ipairs(lines_of(folder .. "/timing.jsonl")) do
    times[line.repetition] = times[line.repetition] or {}
    times[line.repetition][line.generation] = seconds_of(line.ended)
  end
  return times
end

--- A table of a run's metrics as CSV (RFC 4180); what a line lacks is empty.
---@param folder string
---@return string
function metrics.csv(folder)
  local rows, names = metrics.read(folder)
  return csv.encode(names, rows)
end

return metrics
