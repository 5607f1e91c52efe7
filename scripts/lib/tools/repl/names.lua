--- names.lua: the names that are visible at the prompt: its own, which no module sees, the prompt's
--- words, `limax`, and the locked globals. `_` is the last value.

local suggest = require "limax.engine.suggest"

local names = {}

--- The functions that only the prompt has: words.lua adds them.
names.words = {}

-- Names that are often typed at a prompt but undefined.
local HINTS = { exit = "Ctrl-D ends", quit = "Ctrl-D ends",
  help = "?name describes a name, ? lists all topics" }

-- Lua's own, which are locked
local globals = getmetatable(_G).__index

-- defined at the prompt
local own = {}
-- may be read although nothing was assigned
local declared = { _ = true }

-- Names among the keys of some tables, sorted.
local function sorted(tables)
  local seen, list = {}, {}
  for _, source in ipairs(tables) do
    for name in pairs(source) do
      if type(name) == "string" and not seen[name] then
        seen[name], list[#list + 1] = true, name
      end
    end
  end
  table.sort(list)
  return list
end

--- Every name that can be typed, sorted.
function names.all() return sorted { own, names.words, globals, { limax = true } } end

--- The value of a name, or nil. Raises no error.
function names.get(name)
  for _, source in ipairs { own, names.words, globals } do
    local value = rawget(source, name)
    if value ~= nil then return value end
  end
  return name == "limax" and require "limax" or nil
end

--- Stores a value that was shown as `_`.
function names.remember(value) own._ = value end

--- Names that may be read although nothing was assigned: `local x`.
function names.declare(list)
  for _, name in ipairs(list) do declared[name] = true end
end

--- The names that were defined, sorted, without `_`.
function names.typed()
  local list = {}
  for _, name in ipairs(sorted { own }) do
    if name ~= "_" then list[#list + 1] = name end
  end
  return list
end

--- The environment of chunks: the prompt's own names, and through it all others.
names.environment = setmetatable(own, {
  __index = function(_, name)
    local value = names.get(name)
    if value == nil and not declared[name] then
      local nearest = suggest.nearest(name, names.all())
      local ending = HINTS[name] and "; " .. HINTS[name]
        or nearest and ("; did you mean %q?"):format(nearest) or ""
      error(("undefined name '%s'%s"):format(tostring(name), ending), 2)
    end
    return value
  end,
})

return names
