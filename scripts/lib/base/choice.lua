--- choice.lua: how an experiment names a piece of the library: a name, or { name, option = value }.
--- The rules of the piece check its options and fill in their defaults.

local engine = require "limax.engine"
local schema = require "limax.engine.schema"
local suggest = require "limax.engine.suggest"

local choice = {}

---@class limax.choice.entry
---@field options? table<string, schema.rule>

--- Keys of a table as a sorted list: numbers, then the others by their text.
function choice.sorted_keys(t)
  local keys = {}
  for key in pairs(t) do keys[#keys + 1] = key end
  table.sort(keys, function(a, b)
    local a_number, b_number = type(a) == "number", type(b) == "number"
    if a_number and b_number then return a < b end
    if a_number ~= b_number then return a_number end
    return tostring(a) < tostring(b)
  end)
  return keys
end

--- Is a value in a list?
function choice.contains(list, value)
  for _, each in ipairs(list) do
    if each == value then return true end
  end
  return false
end

--- Reads a name, or { name, option = value }; raises at the user's line.
---@param kind string "fitness", "selection", "supervisor", for messages
---@param entries table<string, limax.choice.entry>
---@return string name
---@return table options defaults filled in
function choice.read(kind, spec, entries)
  local name, own = spec, {}
  if type(spec) == "table" then
    name = spec[1]
    for key, value in pairs(spec) do
      if key ~= 1 then own[key] = value end
    end
  end
  local names = choice.sorted_keys(entries)
  if type(name) ~= "string" then
    local came = type(spec) == "table" and "a table that does not begin with a name"
      or schema.show(spec)
    local ending = kind == "archive" and "" or " or a function"
    engine.fail(('%s: expected a name (%s) or { "name", option = value }%s, got %s')
      :format(kind, table.concat(names, ", "), ending, came))
  end
  local positive = name:match "^%-(.*)"
  if positive and kind == "fitness" and entries[positive] then
    engine.fail(("fitness: the largest value is the best; for the smallest: fitness ="
      .. " function(robot) return -limax.fitness.%s(robot) end"):format(positive))
  end
  if not entries[name] then
    engine.fail(("%s: unknown name %s%s")
      :format(kind, schema.show(name), suggest.ending(name, names)))
  end
  local check = schema.fields(entries[name].options or {})
  local options, message = check(own, ("%s %q"):format(kind, name))
  if not options then engine.fail(message) end
  return name, options
end

return choice
