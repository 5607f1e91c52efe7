--- mating.lua: which robots of a scored generation go on, which become parents, and the records of
--- the next generation. Indices from a script's survival, selection or own loop are checked here.

local failure = require "limax.base.failure"
local population = require "limax.evolution.population"
local schema = require "limax.engine.schema"

local mating = {}

local function check_index(index, robots, what)
  if type(index) ~= "number" or index ~= math.floor(index) or index < 1 or index > #robots then
    local hint = index == nil and " (a selection returns two)"
      or type(index) == "table" and " (population.ranked lists indices, best first)" or ""
    failure.raise(1, ("%s is %s; expected an index from 1 to %d%s"):format(what, schema.show(index),
      #robots, hint))
  end
  return index
end

--- Checks a list of robots that go on or may be parents: each with a score, and none twice.
---@param robots limax.population.scored
---@param list integer[]
---@param what string names the list in messages: "breed: elites"
---@return integer[] list
function mating.check_scored(robots, list, what)
  if type(list) ~= "table" then
    failure.raise(1, ("%s: expected a list of indices, got %s"):format(what, schema.show(list)))
  end
  local seen = {}
  for k, index in ipairs(list) do
    check_index(index, robots, ("%s[%d]"):format(what, k))
    if not robots.records[index].fitness then
      failure.raise(1, ("%s[%d] = %d has no score: a robot that failed is never an elite nor a"
        .. " parent"):format(what, k, index))
    elseif seen[index] then
      failure.raise(1, ("%s[%d] = %d is in the list already, at place %d"):format(what, k, index,
        seen[index]))
    end
    seen[index] = k
  end
  return list
end

--- What scripts may read and must not change: the places of the robots and their ranking.
---@param robots limax.population.scored
---@return integer[] a copy of the ranking, for `mating.check_unchanged`
function mating.ranking(robots)
  local copy = {}
  for k, index in ipairs(robots.ranked) do copy[k] = index end
  return copy
end

--- Raises if a script sorted or cut the list of robots or their ranking, which all calls share.
---@param robots limax.population.scored
---@param ranking integer[] from before the script ran
---@param who string "the selection"
function mating.check_unchanged(robots, ranking, who)
  local what
  for k = 1, math.max(#ranking, #robots.ranked) do
    if robots.ranked[k] ~= ranking[k] then what = "population.ranked" end
  end
  for i, record in ipairs(robots.records) do
    if not robots[i] or robots[i].record ~= record then what = "the population's list of robots" end
  end
  if what then
    failure.raise(1, ("%s of generation %d changed %s, which all its calls share: change a copy,"
      .. " such as local mine = { unpack(population.ranked) }"):format(who, robots.generation,
      what))
  end
end

--- The robots from which a selection picks two: a scored population whose `ranked` lists only the
--- parents, best first.
---@param robots limax.population.scored
---@param parents integer[]
---@return limax.population.scored
function mating.pool(robots, parents)
  if parents == robots.ranked then return robots end
  local pool = setmetatable({}, getmetatable(robots))
  for key, value in pairs(robots) do pool[key] = value end
  pool.ranked = parents
  return pool
end

--- The two parents of a robot that the selection chooses.
---@param pool limax.population.scored
---@param child integer index in the next generation
---@param choose fun(pool: limax.population.scored, child: integer): integer, integer
---@param place? string of the script's own selection: FILE:LINE
---@return integer[]
function mating.chosen(pool, child, choose, place)
  local first, second, third = choose(pool, child)
  local what = ("the selection's choice%s for robot %d of generation %d")
    :format(place and (" (%s)"):format(place) or "", child, pool.generation + 1)
  if third ~= nil then failure.raise(1, what .. ": expected two indices, got more") end
  return { check_index(first, pool, what), check_index(second, pool, what) }
end

--- One pair of indices per robot of the next generation: an elite twice, then two parents for each
--- offspring, by `choose` or as the script names them.
---@param robots limax.population.scored the pool that pairs refer to
---@param elites integer[]
---@param named? integer[][]
---@param choose fun(pool: limax.population.scored, child: integer): integer, integer
---@param place? string of the script's own selection: FILE:LINE
---@return integer[][]
function mating.pairs(robots, elites, named, choose, place)
  local wanted = #robots - #elites
  if named and #named ~= wanted then
    failure.raise(1, ("breed: %d elites and %d pairs of parents make %d robots; the population"
      .. " is %d"):format(#elites, #named, #elites + #named, #robots))
  end
  local list = {}
  for k, index in ipairs(elites) do list[k] = { index, index } end
  for k = 1, wanted do
    local child, what = #elites + k, ("breed: a parent in parents[%d]"):format(k)
    list[child] = named and { check_index(named[k][1], robots, what),
      check_index(named[k][2], robots, what) } or mating.chosen(robots, child, choose, place)
  end
  return list
end

-- The record of an elite in the next generation: the same robot, with its score or without.
local function elite_record(record, keep)
  local copy = {}
  for key, value in pairs(record) do copy[key] = value end
  copy.origin = "elite"
  return keep and copy or population.forget_score(copy)
end

--- The records of the next generation, still without the bodies of the offspring. Ids count on:
--- they are unique in a repetition, and the same in a run that is continued.
---@param elites integer number of the pairs that are elites, which come first
---@param parents integer[][] a pair of indices per robot
---@param keep boolean do elites keep their scores?
---@param homes? integer[] the island of each robot
---@return table[]
function mating.records(robots, elites, parents, keep, homes)
  local generation, list = robots.generation + 1, {}
  for i, pair in ipairs(parents) do
    local first, second = robots.records[pair[1]], robots.records[pair[2]]
    list[i] = i <= elites and elite_record(first, keep) or { id = generation * #robots + i,
      generation = generation, origin = "bred", parents = { first.id, second.id } }
    list[i].island = homes and homes[i]
  end
  return list
end

return mating
