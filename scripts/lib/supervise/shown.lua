--- shown.lua: a copy of the history for a user's function, so that its assignments do not change
--- the run, and a misspelt name is an error.

local choice = require "limax.base.choice"
local fault = require "limax.engine.fault"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local source = require "limax.base.source"
local strict = require "limax.engine.strict"

local shown = {}

-- The key of the entry that a view shows.
local ENTRY = {}

-- Fields that an entry may lack; any other name must be in the entry.
local KNOWN = {}
for _, rows in ipairs { records.history, records.generation } do
  for _, name in ipairs(record_rules.names(rows)) do KNOWN[name] = true end
end

local function unknown_parameter(parameters)
  return function(_, name) strict.unknown("parameters", name, parameters) end
end

-- Each reader gets copies of tables: it may make a proposal of one.
local View = { __newindex = strict.read_only("a generation of the history",
  "a supervisor returns what it proposes, such as { mutation_rate = 0.1 }") }

function View:__index(key)
  local value = rawget(self, ENTRY)[key]
  if value == nil and not KNOWN[key] then
    strict.unknown("a generation", key, KNOWN)
  elseif key == "parameters" then
    return setmetatable(source.copy(value), { __index = unknown_parameter(value) })
  end
  return key ~= "population" and source.copy(value) or value
end

function View:__pairs()
  local fields, k = {}, 0
  for _, names in ipairs { KNOWN, rawget(self, ENTRY) } do
    for name in pairs(names) do fields[name] = self[name] end
  end
  local names = choice.sorted_keys(fields)
  return function()
    k = k + 1
    return names[k], fields[names[k]]
  end
end

-- `history.best` instead of `history[#history].best`
local List = { __index = function(_, key)
  if type(key) == "number" then return nil end
  fault.raise(("the history is a list of generations: history[#history].%s is that of the newest")
    :format(tostring(key)))
end }

--- A history for one call of a user's function.
---@param views? limax.generation[] of an earlier call, whose entries are used again
function shown.of(history, views)
  views = views or {}
  local list = setmetatable({}, List)
  for k, entry in ipairs(history) do
    if not views[k] or rawget(views[k], ENTRY) ~= entry then
      views[k] = setmetatable({ [ENTRY] = entry }, View)
    end
    list[k] = views[k]
  end
  return list
end

return shown
