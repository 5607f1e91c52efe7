--- islands.lua: populations that evolve side by side in one population of the engine, and exchange
--- robots. The row of a robot has the number of its `island`. Survival and selection see one
--- island at a time, as a scored population of its robots; their indices are mapped back here.

local generations = require "limax.evolution.generation"
local metrics = require "limax.run.metrics"
local rows = require "limax.robot.rows"

local islands = {}

-- Makes a scored population of the robots of each island from `first` to `last`. `places` are their
-- indices in the whole population, whose other fields it shares.
---@param share limax.share|nil the robots of these islands; all if left out
---@param ranked integer[] the scored ones, best first
---@return table<integer, limax.population.scored> by island
local function views(robots, first, last, share, ranked)
  local all, list, place = robots.rows, {}, {}
  for k = first, last do
    local view = generations.part(robots)
    view.island, view.rows, view.places, view.ranked, view.whole = k, {}, {}, {}, robots
    list[k] = view
  end
  for n = 1, (share or all).count do
    local i = share and share:number(n) or n
    local view = list[rows.island(all, i)]
    local at = #view.places + 1
    place[i], view.places[at] = at, i
    view[at], view.rows[at] = robots[i], all[i]
  end
  for _, view in pairs(list) do view.count = all.only_own and #view.places or nil end
  for _, i in ipairs(ranked) do
    local its = list[rows.island(all, i)].ranked
    its[#its + 1] = place[i]
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

-- The best robots that island `k` receives, without those that survive there already.
local function migrants(robots, k, survivors, options, random)
  local all, from = robots.rows, sources[options.topology](k, options.count, random)
  local there, list = {}, {}
  for _, i in ipairs(survivors) do there[rows.id(all, i)] = true end
  for _, i in ipairs(robots.ranked) do
    local home, id = rows.island(all, i), rows.id(all, i)
    local comes = home ~= k and (not from or home == from)
    if #list < options.migrants and comes and not there[id] then
      list[#list + 1], there[id] = i, true
    end
  end
  return list
end

--- Do islands exchange robots before a generation?
---@param options table `islands` of the configuration
function islands.exchange_before(options, generation)
  return options.migrants > 0 and generation % options.every == 0
end

---@class limax.islands.steps functions of the loop that work on one island
---@field survive fun(view: table): integer[], table survivors, and the pool of parents
---@field choose fun(pool: table, child: integer): table two parents
---@field share fun(elites: integer[]): limax.share robots that get parents, by the elites of each
--- island
---@field random limax.random of the topology

-- The survivors of an island by their indices in the whole population, and the pool of parents.
local function survivors_of(view, steps)
  local list, survivors, pool = {}, steps.survive(view)
  for place, index in ipairs(survivors) do list[place] = view.places[index] end
  return list, pool
end

-- Adds migrants to the survivors of each island.
local function add_migrants(robots, lists, options, steps)
  local size, arriving = robots.rows.count / options.count, {}
  for k, list in ipairs(lists) do
    arriving[k] = migrants(robots, k, list, options, steps.random)
  end
  for k, list in ipairs(lists) do
    -- migrants take the places of the worst survivors where no offspring would be left
    for place = #list, size - #arriving[k], -1 do list[place] = nil end
    for _, i in ipairs(arriving[k]) do list[#list + 1] = i end
  end
end

-- Puts the survivors of all islands first, and chooses two parents per robot that follows.
---@param lists table<integer, integer[]> survivors of islands; what follows leaves out the others
---@param pools table<integer, limax.population.scored> of the same
---@param of_islands integer[] survivors of all islands
---@return limax.chosen
local function arrange(robots, lists, pools, of_islands, steps)
  local elites, parents, homes, size = {}, {}, {}, robots.rows.count / #of_islands
  for k, count in ipairs(of_islands) do
    for place = 1, count do
      local i, at = lists[k] and lists[k][place] or false, #elites + 1
      elites[at], parents[at], homes[at] = i, i and { i, i } or nil, k
    end
  end
  local share, last = steps.share(of_islands), #elites
  for k, count in ipairs(of_islands) do
    for child = last + 1, lists[k] and last + size - count or last do
      local pair = share:at(child) and steps.choose(pools[k], child)
      -- a row of the archive belongs to no island
      for side, parent in ipairs(pair or {}) do
        local places = pools[k].places
        pair[side] = type(parent) == "table" and parent or places and places[parent] or parent
      end
      parents[child], homes[child] = pair or nil, k
    end
    last = last + size - count
  end
  return { elites = elites, parents = parents, homes = homes, of_islands = of_islands }
end

--- Survivors and migrants of all islands, which come first in the next generation, and a pair of
--- parents per robot of it.
---@param options table `islands` of the configuration
---@param generation integer the next one
---@return limax.chosen
function islands.select(robots, options, generation, steps)
  local groups = views(robots, 1, options.count, nil, robots.ranked)
  local lists, pools, of_islands = {}, {}, {}
  for k, view in ipairs(groups) do
    if #view.ranked > 0 then
      lists[k], pools[k] = survivors_of(view, steps)
    else
      lists[k], pools[k] = {}, robots -- it begins anew from all others
    end
  end
  if islands.exchange_before(options, generation) then
    add_migrants(robots, lists, options, steps)
  end
  for k, list in ipairs(lists) do of_islands[k] = #list end
  return arrange(robots, lists, pools, of_islands, steps)
end

--- The same for the islands of this rank, whose robots were scored, where none are exchanged. The
--- numbers of robots are right if all islands of all ranks have as many survivors.
---@return limax.chosen|nil nil if those of this rank have not
function islands.select_own(robots, options, steps)
  local share = robots.share
  local first, last = share.islands.first, share.islands.last
  local groups = views(robots, first, last, share, metrics.rank(robots.rows, share))
  local lists, pools, of_islands = {}, {}, {}
  for k = first, last do
    if #groups[k].ranked == 0 then return nil end
    lists[k], pools[k] = survivors_of(groups[k], steps)
    if #lists[k] ~= #lists[first] then return nil end
  end
  for k = 1, options.count do of_islands[k] = #lists[first] end
  return arrange(robots, lists, pools, of_islands, steps)
end

return islands
