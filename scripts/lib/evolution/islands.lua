--- islands.lua: populations that evolve side by side in one population of the engine, and exchange
--- robots. The row of a robot has the number of its `island`. Survival and selection see one
--- island at a time, as a scored population of its robots; their indices are mapped back here.

local generations = require "limax.evolution.generation"

local islands = {}

-- Makes a scored population of each island's robots. `places` are their indices in the whole
-- population, whose other fields it shares.
local function views(robots, count)
  local list, place = {}, {}
  for k = 1, count do
    local view = generations.part(robots)
    view.island, view.rows, view.places, view.ranked, view.whole = k, {}, {}, {}, robots
    list[k] = view
  end
  for i, row in ipairs(robots.rows) do
    local view = list[row.island]
    place[i] = #view + 1
    view[place[i]], view.rows[place[i]], view.places[place[i]] = robots[i], row, i
  end
  for _, i in ipairs(robots.ranked) do
    local ranked = list[robots.rows[i].island].ranked
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

-- The best robots that island `k` receives, without those that survive there already.
local function migrants(robots, k, survivors, options, random)
  local from, there, list = sources[options.topology](k, options.count, random), {}, {}
  for _, i in ipairs(survivors) do there[robots.rows[i].id] = true end
  for _, i in ipairs(robots.ranked) do
    local row = robots.rows[i]
    local comes = row.island ~= k and (not from or row.island == from)
    if #list < options.migrants and comes and not there[row.id] then
      list[#list + 1], there[row.id] = i, true
    end
  end
  return list
end

---@class limax.islands.steps functions of the loop that work on one island
---@field survive fun(view: table): integer[], table survivors, and the pool of parents
---@field choose fun(pool: table, child: integer): table two parents
---@field share fun(elites: integer[]): limax.share robots that get parents, by the elites of each
--- island
---@field random limax.random of the topology

-- The survivors of each island by their indices in the whole population.
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
---@param options table `islands` of the configuration
---@param generation integer the next one
---@return integer[] elites
---@return (integer|limax.archive.row)[][] parents
---@return integer[] homes the island of each robot of the next generation
---@return integer[] of_islands elites of each island
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
  local elites, parents, homes, of_islands = {}, {}, {}, {}
  for k, list in ipairs(lists) do
    of_islands[k] = #list
    for _, i in ipairs(list) do
      elites[#elites + 1], parents[#parents + 1], homes[#homes + 1] = i, { i, i }, k
    end
  end
  local share = steps.share(of_islands)
  for k, view in ipairs(groups) do
    for _ = #lists[k] + 1, #robots / options.count do
      local child = #homes + 1
      local pair = share:at(child) and steps.choose(pools[k], child)
      -- a row of the archive belongs to no island
      for side, parent in ipairs(pair or {}) do
        pair[side] = type(parent) == "table" and parent or view.places and view.places[parent]
          or parent
      end
      parents[child], homes[child] = pair or nil, k
    end
  end
  return elites, parents, homes, of_islands
end

return islands
