--- strict.lua: errors for what Lua would ignore or name badly: arguments beyond the parameters of a
--- function, methods called with a dot, names that a module or an object does not have, and
--- assignments to their fields.

local fault = require "limax.engine.fault"
local schema = require "limax.engine.schema"
local suggest = require "limax.engine.suggest"

local strict = {}

-- The name of each checked function, as in a call.
local name_of = setmetatable({}, { __mode = "k" })

-- `name` as in a call, and the number of arguments of the call: all parameters, of a method all but
-- the object.
local function checked(name, call, arguments, parameters)
  local expected = arguments == 0 and "no argument"
    or ("at most %d argument%s"):format(arguments, arguments == 1 and "" or "s")
  return function(...)
    if arguments < parameters then
      local kind = type((...))
      if kind ~= "cdata" and not (kind == "table" and getmetatable((...))) then
        fault.raise(("%s is called with a colon, not with a dot"):format(name))
      end
    end
    local extra = select(parameters + 1, ...)
    if extra ~= nil then
      fault.raise(("%s takes %s, got %s"):format(name, expected, schema.show(extra)))
    end
    return call(...)
  end
end

--- The name of a function of a module, "limax.control.reflex"; nil for a script's own function.
function strict.name_of(value) return name_of[value] end

--- Raises for a name that `what` does not have.
---@param ... table tables whose keys are the names that there are
function strict.unknown(what, name, ...)
  local names = {}
  for i = 1, select("#", ...) do
    for key in pairs((select(i, ...))) do names[#names + 1] = key end
  end
  fault.raise(("%s has no %s%s"):format(what, schema.show(name), suggest.ending(name, names)))
end

-- Makes a table whose functions are checked as they are added; `wrap` makes the function that is
-- kept of each.
local function collector(prefix, implied, own, wrap)
  return setmetatable(own or {}, { __newindex = function(self, name, value)
    local info = type(value) == "function" and debug.getinfo(value, "u")
    if info and not info.isvararg then
      value = checked(prefix .. name, value, info.nparams - implied, info.nparams)
      if wrap then value = wrap(value) end
      name_of[value] = prefix .. name
    end
    rawset(self, name, value)
  end })
end

--- A table for the functions of a module; `strict.close` ends it.
---@param wrap? fun(call: function): function makes the function that is kept of each
function strict.module(module, wrap) return collector(module .. ".", 0, nil, wrap) end

--- An `__newindex` that raises.
---@param what string "a robot"
---@param advice string the next step
---@return fun(object: table, name: any)
function strict.read_only(what, advice)
  return function(_, name)
    fault.raise(("%s is read-only (assignment to %s); %s"):format(what, schema.show(name), advice))
  end
end

--- Makes reading or setting a name that a module does not have an error.
---@return table list
function strict.close(module, list)
  local function unknown(_, name)
    local entries = rawget(list, "entries")
    if entries and entries[name] then
      fault.raise(("%s has no %s: an experiment names it by its text, %s"):format(module,
        schema.show(name), schema.show(name)))
    end
    strict.unknown(module, name, list, entries or {})
  end
  return setmetatable(list, { __index = unknown,
    __newindex = strict.read_only(module, "an experiment takes your own function itself, such as"
      .. " fitness = my_fitness") })
end

--- A table for the methods of a class, which are called with a colon.
---@param own table|nil fields that it has already
function strict.methods(class, own) return collector(class .. ":", 1, own) end

return strict
