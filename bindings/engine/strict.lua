--- strict.lua: functions that refuse arguments beyond their parameters, which Lua would ignore.

local fault = require "limax.engine.fault"
local schema = require "limax.engine.schema"

local strict = {}

-- `name` as it is called, and how many of the parameters are arguments there.
local function checked(name, call, arguments, parameters)
  local expected = arguments == 0 and "no argument"
    or ("at most %d argument%s"):format(arguments, arguments == 1 and "" or "s")
  return function(...)
    local extra = select(parameters + 1, ...)
    if extra ~= nil then
      fault.raise(("%s takes %s, got %s"):format(name, expected, schema.show(extra)))
    end
    return call(...)
  end
end

-- Makes a table whose functions are checked as they are added.
local function collector(prefix, implied)
  return setmetatable({}, { __newindex = function(self, name, value)
    local info = type(value) == "function" and debug.getinfo(value, "u")
    if info and not info.isvararg then
      value = checked(prefix .. name, value, info.nparams - implied, info.nparams)
    end
    rawset(self, name, value)
  end })
end

--- A table for the functions of a module.
---@param module string
---@return table
function strict.functions(module) return collector(module .. ".", 0) end

--- A table for the methods of a class, which are called with a colon.
---@param class string
---@return table
function strict.methods(class) return collector(class .. ":", 1) end

return strict
