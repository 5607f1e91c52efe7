--- island_rules.lua: the field `islands` of an experiment, and whether it fits the other fields.

local defaults = require "limax.settings.defaults"
local schema = require "limax.engine.schema"

local island_rules = {}

local topology = schema.choice(defaults.topologies)
local rules = { topology = function(value, path)
  return topology(value == nil and defaults.topologies[1] or value, path)
end }
for name, field in pairs(defaults.fields.islands) do rules[name] = schema.number(field) end
local complete = schema.fields(rules)

--- The rule of the field; an experiment without islands has none.
function island_rules.check(value, path)
  if value == nil then return nil end
  return complete(value, path)
end

--- What is wrong with the islands of a configuration; nil if nothing.
---@param config table
---@param survival string a library name, or "function"
---@return string|nil message
function island_rules.problem(config, survival)
  local options = config.islands
  if not options then return nil end
  local size = config.population / options.count
  if size % 1 ~= 0 or size < 2 then
    return ("islands.count: the population of %d robots does not make %d equal islands of at least"
      .. " 2 robots"):format(config.population, options.count)
  elseif options.migrants >= size then
    return ("islands.migrants: expected at most %d, one robot less than an island has, got %d")
      :format(size - 1, options.migrants)
  elseif survival == "map_elites" then
    return 'islands: the survival "map_elites" breeds all robots from one archive, so islands would'
      .. " not differ; leave out one of them"
  end
end

return island_rules
