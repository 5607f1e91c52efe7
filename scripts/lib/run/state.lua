--- state.lua: the state of a script: a plain table that every function of an experiment receives,
--- that is written with each generation and restored when a run continues. After each generation
--- the run goes on with what a reader of the file would get, so that a continued run cannot differ
--- from one that was never interrupted.

local failure = require "limax.base.failure"
local host = require "limax.host"
local schema = require "limax.engine.schema"

local state = {}

-- Describes the first value at or below `path` that cannot be written; nil if all can. `above`
-- holds the tables around the value.
local function problem(value, path, above)
  local kind = type(value)
  if kind == "string" or kind == "boolean" then return nil end
  if kind == "number" then
    if value - value == 0 then return nil end
    return ("%s is %s, and no file can hold it"):format(path, tostring(value))
  elseif kind ~= "table" then
    return ("%s is %s; it may hold numbers, texts, true and false, and tables of these"):format(
      path, schema.show(value))
  elseif above[value] then
    return ("%s is a table that contains itself"):format(path)
  elseif getmetatable(value) ~= nil then
    return ("%s is an object; keep the numbers and texts that are needed of it"):format(path)
  end
  above[value] = true
  local count, places, names = #value, 0, 0
  for key, entry in pairs(value) do
    local is_place = type(key) == "number" and key >= 1 and key <= count and key % 1 == 0
    if not is_place and type(key) ~= "string" then
      local remedy = type(key) == "number" and "; an id is a name as tostring(id)" or ""
      return ("%s has the key %s; keys are names, or 1, 2, 3 without a gap%s"):format(path,
        schema.show(key), remedy)
    end
    if is_place then places = places + 1 else names = names + 1 end
    local message = problem(entry, path .. (is_place and ("[%d]") or ".%s"):format(key), above)
    if message then return message end
  end
  above[value] = nil
  if places < count then
    return ("%s is a list with gaps; table.remove(list, k) leaves none"):format(path)
  elseif count > 0 and names > 0 then
    return path .. " has both names and places 1, 2, ...; use two tables"
  end
end

--- The text of a state; ends the run if it is not plain data.
function state.encode(value)
  if type(value) ~= "table" then
    failure.raise(1, "state: expected a table, got " .. schema.show(value))
  end
  local message = problem(value, "state", {})
  if message then failure.raise(1, message) end
  return host.json.encode(value) .. "\n"
end

-- Plain tables, without the marks that keep an empty list a list.
local function plain(value)
  if type(value) ~= "table" then return value end
  local copy = {}
  for key, entry in pairs(value) do copy[key] = plain(entry) end
  return copy
end

--- The state of a text that `encode` made.
function state.decode(text) return plain((host.json.decode(text))) end

--- A copy, for calls that must not change the state of a run.
function state.copy(value) return value and state.decode(state.encode(value)) end

return state
