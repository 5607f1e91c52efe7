--- axes.lua: the matrix of a test: the devices, precisions, integrators, numbers of threads and
--- seeds that it names, and one instance for each combination.

local defaults = require "limax.settings.defaults"
local schema = require "limax.engine.schema"

local axes = {}

-- `option` of `suite:test`, `field` of `t`, `rule` of one value, and `all` that "all" selects.
local function words(option, field, all)
  return { option = option, field = field, all = all, rule = schema.choice(all) }
end

-- In the order in which a label names them.
axes.list = {
  -- the CPU first: what fails there fails everywhere
  words("devices", "device", { "cpu", "cuda" }),
  words("precisions", "precision", defaults.precisions),
  words("integrators", "integrator", defaults.integrators),
  { option = "threads", field = "threads", rule = schema.whole(1, 2 ^ 53) },
  { option = "seeds", field = "seed", rule = schema.whole(0, 2 ^ 53) },
}

-- Integrators that run only on the CPU (scripts/EXTENDING.md, "How exact it is").
local CPU_ONLY = { rk4 = true }

local function checked(axis, value)
  if value == nil then return nil end
  if axis.all and value == "all" then return axis.all end
  local values = type(value) == "table" and value or { value }
  if #values == 0 then schema.refuse(axis.option, "at least one value", values) end
  for i, each in ipairs(values) do
    schema.demand(axis.rule, each, ("%s[%d]"):format(axis.option, i))
  end
  return values
end

--- The axes that a test names, by field.
---@param options table of the test
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
function axes.impossible(values)
  if values.device == "cuda" and CPU_ONLY[values.integrator] then
    return ("%s runs only on the cpu"):format(values.integrator)
  end
end

return axes
