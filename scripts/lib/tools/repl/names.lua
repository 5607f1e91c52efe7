--- names.lua: the names that what is typed sees: its own, which no module sees, the prompt's words,
--- `limax`, and the locked globals. `_` is the last value, `_1` the one before it, up to `_9`.

local suggest = require "limax.engine.suggest"

local names = {}

-- What is often typed at a prompt and is no name of Lua.
local MEANT = { exit = "Ctrl-D ends", quit = "Ctrl-D ends",
  help = "?name tells what a name is, ? alone what there is" }

-- how many values before the last one are kept
local KEPT = 9

---@class limax.repl.names
---@field own table<string, any> what was typed
---@field environment table what a chunk runs in: `own`, which finds the others too
---@field words table<string, any> the prompt's own
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

--- A name's value, nil where there is none; nothing is raised.
---@param name string
---@return any
function Names:get(name)
  local value = rawget(self.own, name)
  if value == nil then value = self.words[name] end
  if value == nil then value = rawget(_G, name) end
  if value == nil and name == "limax" then value = require "limax" end
  return value
end

--- Takes note of a value that was shown.
---@param value any
function Names:remember(value)
  -- to look at it again makes no new value
  local own = self.own
  if rawequal(value, rawget(own, "_")) then return end
  for k = KEPT, 2, -1 do own["_" .. k] = rawget(own, "_" .. k - 1) end
  own._1, own._ = rawget(own, "_"), value
end

--- These names may be read although nothing was assigned: `local x`.
---@param list string[]
function Names:declare(list)
  for _, name in ipairs(list) do self.declared[name] = true end
end

--- The names that were typed, sorted, without those of the last values.
---@return string[]
function Names:typed()
  local list = {}
  for name in pairs(self.own) do
    if type(name) == "string" and not name:match "^_%d?$" then list[#list + 1] = name end
  end
  table.sort(list)
  return list
end

--- Makes the names of one prompt.
---@param words table<string, any>
---@return limax.repl.names
function names.new(words)
  local self = setmetatable({ own = {}, words = words, declared = { _ = true } }, Names)
  for k = 1, KEPT do self.declared["_" .. k] = true end
  self.environment = setmetatable(self.own, {
    __index = function(_, name)
      local value = self:get(name)
      if value == nil and not self.declared[name] then
        local nearest = type(name) == "string" and suggest(name, self:all())
        local ending = MEANT[name] and "; " .. MEANT[name]
          or nearest and ("; did you mean %q?"):format(nearest) or ""
        error(("undefined name '%s'%s"):format(tostring(name), ending), 2)
      end
      return value
    end,
  })
  return self
end

return names
