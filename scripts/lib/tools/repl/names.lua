--- names.lua: the names that are visible at the prompt: its own, which no module sees, the prompt's
--- words, `limax`, and the locked globals. `_` is the last value, `_1` the one before it, up to
--- `_9`.

local suggest = require "limax.engine.suggest"

local names = {}

-- Names that are often typed at a prompt but undefined.
local HINTS = { exit = "Ctrl-D ends", quit = "Ctrl-D ends",
  help = "?name describes a name, ? lists all topics" }

-- number of values that are kept before the last one
local KEPT = 9

---@class limax.repl.names
---@field own table<string, any> defined at the prompt
---@field environment table of chunks: `own`, which also finds the others
---@field words table<string, any> that only the prompt has
local Names = {}
Names.__index = Names

-- Every name that can be typed, sorted.
function Names:all()
  local seen, list = {}, {}
  for _, source in ipairs { self.own, self.words, _G, { limax = true } } do
    for name in pairs(source) do
      if type(name) == "string" and not seen[name] then
        seen[name], list[#list + 1] = true, name
      end
    end
  end
  table.sort(list)
  return list
end

--- The value of a name, or nil. Raises no error.
function Names:get(name)
  local value = rawget(self.own, name)
  if value == nil then value = self.words[name] end
  if value == nil then value = rawget(_G, name) end
  if value == nil and name == "limax" then value = require "limax" end
  return value
end

--- Stores a value that was shown as `_`.
function Names:remember(value)
  -- showing it again does not shift the others
  local own = self.own
  if rawequal(value, rawget(own, "_")) then return end
  for k = KEPT, 2, -1 do own["_" .. k] = rawget(own, "_" .. k - 1) end
  own._1, own._ = rawget(own, "_"), value
end

--- Names that may be read although nothing was assigned: `local x`.
function Names:declare(list)
  for _, name in ipairs(list) do self.declared[name] = true end
end

--- The names that were defined, sorted, without those of the last values.
function Names:typed()
  local list = {}
  for name in pairs(self.own) do
    if type(name) == "string" and not name:match "^_%d?$" then list[#list + 1] = name end
  end
  table.sort(list)
  return list
end

--- The names of a prompt.
---@param words table<string, any>
function names.new(words)
  local self = setmetatable({ own = {}, words = words, declared = { _ = true } }, Names)
  for k = 1, KEPT do self.declared["_" .. k] = true end
  self.environment = setmetatable(self.own, {
    __index = function(_, name)
      local value = self:get(name)
      if value == nil and not self.declared[name] then
        local nearest = type(name) == "string" and suggest(name, self:all())
        local ending = HINTS[name] and "; " .. HINTS[name]
          or nearest and ("; did you mean %q?"):format(nearest) or ""
        error(("undefined name '%s'%s"):format(tostring(name), ending), 2)
      end
      return value
    end,
  })
  return self
end

return names
