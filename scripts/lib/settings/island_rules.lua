--- island_rules.lua: the field `islands` of an experiment, and whether the population, or each
--- island, has enough robots.

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

--- A note about islands that never exchange a robot; nil if they do.
function island_rules.note(config)
  local options = config.islands
  if not options or options.every < config.generations or options.migrants == 0 then return nil end
  return ("islands.every: no robot is exchanged: %d generations between exchanges, and the run has"
    .. " %d"):format(options.every, config.generations)
end

--- Describes the first problem of a configuration's islands; nil if there is none.
---@param parts { survival: limax.survival, archive: limax.archive.definition|nil }
function island_rules.problem(config, parts)
  local options, survival, archive = config.islands, parts.survival, parts.archive
  local size = config.population / (options and options.count or 1)
  if survival.newcomers and survival.newcomers >= size and size % 1 == 0 then
    return ("survival.newcomers: expected at most %d, one robot less than %s has, got %d"):format(
      size - 1, options and "an island" or "the population", survival.newcomers)
  end
  if not options then return nil end
  if size % 1 ~= 0 or size < 2 then
    local counts = {}
    for count = 2, config.population / 2 do
      if config.population % count == 0 then counts[#counts + 1] = count end
    end
    return ("islands.count: the population of %d robots does not make %d equal islands of at least"
      .. " 2 robots%s"):format(config.population, options.count,
      counts[1] and "; it makes " .. table.concat(counts, ", ", 1, math.min(#counts, 12)) or "")
  elseif options.migrants >= size then
    return ("islands.migrants: expected at most %d, one robot less than an island has, got %d")
      :format(size - 1, options.migrants)
  elseif survival.name == "map_elites" and archive.name ~= "grid" and archive.name ~= "cvt" then
    return ('islands: with the survival "map_elites" each has its own archive "grid" or "cvt", not'
      .. " %q"):format(archive.name)
  end
end

return island_rules
