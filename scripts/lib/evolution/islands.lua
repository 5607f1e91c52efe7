--- islands.lua: populations that evolve side by side in one population of the engine, and exchange
--- robots. The record of a robot has the number of its `island`. Survival and selection see one
--- island at a time, as a scored population of its robots; their indices are mapped back here.

local population = require "limax.evolution.population"

local islands = {}

--- The island of a robot of the first generation: equal parts, in order.
---@param config table of the experiment
---@param index integer of the robot
---@return integer|nil island nil without islands
function islands.first(config, index)
  return config.islands and math.ceil(index * config.islands.count / config.population) or nil
end

-- A scored population of each island's robots: a field that is not a list of robots is that of the
-- whole population, in which `places` are its robots.
local function views(robots, count)
  local list, place = {}, {}
  for k = 1, count do
    local view = population.without_robots(robots)
    view.island, view.records, view.places, view.ranked = k, {}, {}, {}
    list[k] = view
  end
  for i, record in ipairs(robots.records) do
    local view = list[record.island]
    place[i] = #view + 1
    view[place[i]], view.records[place[i]], view.places[place[i]] = robots[i], record, i
  end
  for _, i in ipairs(robots.ranked) do
    local ranked = list[robots.records[i].island].ranked
    ranked[#ranked + 1] = place[i]
  end
  return list
end

-- The island that sends robots to each island, by topology; nil for all others.
local sources = {
  ring = function(k, count) return (k - 2) % count + 1 end,
  complete = function() return nil end,
  random = function(k, count, random)
    local other = random:integer(count - 1)
    return other < k and other or other + 1
  end,
}

-- The best robots that island `k` receives, without those that go on there anyway.
local function migrants(robots, k, survivors, options, random)
  local from, there, list = sources[options.topology](k, options.count, random), {}, {}
  for _, i in ipairs(survivors) do there[robots.records[i].id] = true end
  for _, i in ipairs(robots.ranked) do
    local record = robots.records[i]
    local comes = record.island ~= k and (not from or record.island == from)
    if #list < options.migrants and comes and not there[record.id] then
      list[#list + 1], there[record.id] = i, true
    end
  end
  return list
end

---@class limax.islands.steps what islands take from the loop
---@field survive fun(view: table): integer[], table survivors, and the pool of parents
---@field choose fun(pool: table, child: integer): (integer|limax.archive.row)[] two parents
---@field random limax.random of the topology

-- The robots that go on, island by island, by their indices in the whole population.
local function go_on(robots, lists, options, generation, steps)
  local size, arriving = #robots / options.count, {}
  for k, list in ipairs(lists) do
    arriving[k] = generation % options.every == 0
      and migrants(robots, k, list, options, steps.random) or {}
  end
  for k, list in ipairs(lists) do
    -- migrants take the places of the worst survivors where no offspring would be left
    for place = #list, size - #arriving[k], -1 do list[place] = nil end
    for _, i in ipairs(arriving[k]) do list[#list + 1] = i end
  end
end

--- Survivors and migrants of all islands, which come first in the next generation, and a pair of
--- parents per robot of it.
---@param robots limax.population.scored
---@param options table `islands` of the configuration
---@param generation integer the next one
---@param steps limax.islands.steps
---@return integer[] elites
---@return (integer|limax.archive.row)[][] parents
---@return integer[] homes the island of each robot of the next generation
function islands.select(robots, options, generation, steps)
  local groups, pools, lists = views(robots, options.count), {}, {}
  for k, view in ipairs(groups) do
    lists[k] = {}
    if #view.ranked > 0 then
      local survivors
      survivors, pools[k] = steps.survive(view)
      for place, index in ipairs(survivors) do lists[k][place] = view.places[index] end
    else
      -- an island without a scored robot begins anew from all others
      groups[k], pools[k] = robots, robots
    end
  end
  go_on(robots, lists, options, generation, steps)
  local elites, parents, homes = {}, {}, {}
  for k, list in ipairs(lists) do
    for _, i in ipairs(list) do
      elites[#elites + 1], parents[#parents + 1], homes[#homes + 1] = i, { i, i }, k
    end
  end
  for k, view in ipairs(groups) do
    for _ = #lists[k] + 1, #robots / options.count do
      local child = #parents + 1
      local pair = steps.choose(pools[k], child)
      -- a row of the archive belongs to no island
      for side, parent in ipairs(pair) do
        pair[side] = type(parent) == "table" and parent or view.places and view.places[parent]
          or parent
      end
      parents[child], homes[child] = pair, k
    end
  end
  return elites, parents, homes
end

return islands
