--- axes.lua: the matrix of a test: what it names of devices, precisions, integrators, numbers of
--- threads and seeds, checked, and one instance for every combination.

local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local suggest = require "limax.engine.suggest"

local axes = {}

---@class limax.test_axis
---@field option string what a test names it by
---@field field string what `t` and an instance call it
---@field kind "string"|"number" of its values
---@field all string[]|nil what "all" stands for; a value must be one of these
---@field least integer|nil of numbers, which are whole

-- In the order in which a label names them.
---@type limax.test_axis[]
axes.list = {
  -- the CPU first: what fails there fails everywhere
  { option = "devices", field = "device", kind = "string", all = { "cpu", "cuda" } },
  { option = "precisions", field = "precision", kind = "string", all = defaults.precisions },
  { option = "integrators", field = "integrator", kind = "string", all = defaults.integrators },
  { option = "threads", field = "threads", kind = "number", least = 1 },
  { option = "seeds", field = "seed", kind = "number", least = 0 },
}

-- Beyond it not every whole number is one of Lua's.
local LARGEST = 2 ^ 53

-- Integrators that a GPU has not (scripts/EXTENDING.md, "How exact it is").
local CPU_ALONE = { rk4 = true, xpbd = true }

local function fail(what, expected, value)
  engine.fail(("%s: expected %s, got %s"):format(what, expected, tostring(value)))
end

--- A list of values of one kind; a single value is a list of one, nil stays nil.
---@param what string what messages call it
---@param value any
---@param kind "string"|"number"
---@return any[]|nil
function axes.list_of(what, value, kind)
  if value == nil then return nil end
  if type(value) ~= "table" then value = { value } end
  for i, entry in ipairs(value) do
    if type(entry) ~= kind then fail(("%s[%d]"):format(what, i), "a " .. kind, entry) end
  end
  return value
end

local function checked(axis, value)
  if axis.all and value == "all" then return axis.all end
  local values = axes.list_of(axis.option, value, axis.kind)
  if values and #values == 0 then fail(axis.option, "one value at least", "an empty list") end
  local seen = {}
  for i, value_here in ipairs(values or {}) do
    local what = ("%s[%d]"):format(axis.option, i)
    if seen[value_here] then
      engine.fail(("%s: %s stands there twice"):format(what, tostring(value_here)))
    end
    seen[value_here] = true
    local least = axis.least
    if least and not (value_here >= least and value_here <= LARGEST and value_here % 1 == 0) then
      fail(what, ("a whole number from %d to 2^53"):format(least), value_here)
    end
  end
  for _, name in ipairs(axis.all and values or {}) do
    local known = false
    for _, each in ipairs(axis.all) do known = known or each == name end
    if not known then
      engine.fail(("%s: unknown %s %q%s"):format(axis.option, axis.field, name,
        suggest.ending(name, axis.all)))
    end
  end
  return values
end

--- The axes that a test names, by field.
---@param options table of the test
---@return table<string, any[]>
function axes.read(options)
  local named = {}
  for _, axis in ipairs(axes.list) do named[axis.field] = checked(axis, options[axis.option]) end
  return named
end

local function shown(axis, value)
  if axis.field == "threads" then return value == 1 and "1 thread" or value .. " threads" end
  if axis.field == "seed" then return ("seed %.17g"):format(value) end
  return value
end

--- Every combination of what a test names, the last axis the fastest: its values by field, and
--- what a label calls it.
---@param named table<string, any[]>
---@return { values: table<string, any>, text: string }[]
function axes.combinations(named)
  local list = { { values = {}, parts = {} } }
  for _, axis in ipairs(axes.list) do
    local values = named[axis.field]
    if values then
      local longer = {}
      for _, before in ipairs(list) do
        for _, value in ipairs(values) do
          local one = { values = { [axis.field] = value }, parts = { unpack(before.parts) } }
          for field, each in pairs(before.values) do one.values[field] = each end
          table.insert(one.parts, shown(axis, value))
          longer[#longer + 1] = one
        end
      end
      list = longer
    end
  end
  for _, one in ipairs(list) do one.text = table.concat(one.parts, ", ") end
  return list
end

--- Why a combination cannot be; nil where it can.
---@param values table<string, any>
---@return string|nil
function axes.impossible(values)
  if values.device == "cuda" and CPU_ALONE[values.integrator] then
    return ("%s runs on the cpu alone"):format(values.integrator)
  end
end

return axes
