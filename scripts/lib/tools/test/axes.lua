--- axes.lua: the matrix of a test: the devices, precisions, integrators, numbers of threads and
--- seeds that it names, and one instance for each combination.

local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local suggest = require "limax.engine.suggest"

local axes = {}

---@class limax.test_axis
---@field option string of `suite:test`
---@field field string of `t` and of an instance
---@field kind "string"|"number" of its values
---@field all string[]|nil the valid values, which "all" selects
---@field least integer|nil of whole numbers

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

-- Integrators that run only on the CPU (scripts/EXTENDING.md, "How exact it is").
local CPU_ONLY = { rk4 = true, xpbd = true }

local function check(axis, what, value)
  local expected
  if type(value) ~= axis.kind then
    expected = "a " .. axis.kind
  elseif axis.least and not (value >= axis.least and value <= 2 ^ 53 and value % 1 == 0) then
    expected = ("a whole number from %d to 2^53"):format(axis.least)
  end
  if expected then
    engine.fail(("%s: expected %s, got %s"):format(what, expected, tostring(value)))
  end
  if axis.all and not choice.contains(axis.all, value) then
    engine.fail(("%s: unknown %s %q%s"):format(axis.option, axis.field, value,
      suggest.ending(value, axis.all)))
  end
end

local function checked(axis, value)
  if value == nil then return nil end
  if axis.all and value == "all" then return axis.all end
  local values, seen = type(value) == "table" and value or { value }, {}
  if #values == 0 then engine.fail(axis.option .. ": expected at least one value") end
  for i, each in ipairs(values) do
    local what = ("%s[%d]"):format(axis.option, i)
    check(axis, what, each)
    if seen[each] then engine.fail(("%s: %s is listed twice"):format(what, tostring(each))) end
    seen[each] = true
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

--- Every combination, the last axis varying fastest: its values by field, and its label.
---@param named table<string, any[]>
---@return { values: table<string, any>, text: string }[]
function axes.combinations(named)
  local list = { { values = {}, text = "" } }
  for _, axis in ipairs(axes.list) do
    if named[axis.field] then
      local longer = {}
      for _, before in ipairs(list) do
        for _, value in ipairs(named[axis.field]) do
          local values = { [axis.field] = value }
          for field, each in pairs(before.values) do values[field] = each end
          longer[#longer + 1] = { values = values,
            text = before.text .. (before.text == "" and "" or ", ") .. shown(axis, value) }
        end
      end
      list = longer
    end
  end
  return list
end

--- Why a combination cannot run; nil if it can.
---@param values table<string, any>
---@return string|nil
function axes.impossible(values)
  if values.device == "cuda" and CPU_ONLY[values.integrator] then
    return ("%s runs only on the cpu"):format(values.integrator)
  end
end

return axes
