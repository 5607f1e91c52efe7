--- mating.lua: checks the indices that a script's survival, selection or own loop gives, gathers
--- the genomes of the parents, and makes the records of the next generation. A parent may also be a
--- row of the archive.

local ffi = require "ffi"
local columns = require "limax.robot.columns"
local failure = require "limax.base.failure"
local population = require "limax.evolution.population"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local view = require "limax.engine.view"

local mating = {}

-- `what` is a pattern for messages, and `...` its arguments.
local function check_index(index, robots, what, ...)
  if type(index) ~= "number" or index ~= math.floor(index) or index < 1 or index > #robots then
    what = what:format(...)
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
    check_index(index, robots, "%s[%d]", what, k)
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

-- The record of a parent that a script names by a row of the archive.
local function row_record(robots, row, what)
  local archive = robots.world.archive
  local record = archive and archive:record(row)
  if record then return record end
  failure.raise(1, ("%s is %s; expected an index%s"):format(what, schema.show(row), archive
    and " or a row of the archive that it has now: population.archive[i]" or ""))
end

--- Checks a list of parents: robots with a score, none twice, or rows of the archive.
---@param robots limax.population.scored
---@param list (integer|limax.archive.row)[]
---@param what string names the list in messages
---@return boolean has_rows
function mating.check_parents(robots, list, what)
  local indices, has_rows = {}, false
  for k, each in ipairs(type(list) == "table" and list or {}) do
    if type(each) == "table" then
      row_record(robots, each, ("%s[%d]"):format(what, k))
      has_rows = true
    else
      indices[#indices + 1] = each
    end
  end
  mating.check_scored(robots, has_rows and indices or list, what)
  return has_rows
end

--- The robots from which a selection picks two: a scored population whose `ranked` lists only the
--- parents, best first. With rows of the archive among them it consists of the parents only.
---@param robots limax.population.scored
---@param parents (integer|limax.archive.row)[]
---@param has_rows? boolean
---@return limax.population.scored
function mating.pool(robots, parents, has_rows)
  if parents == robots.ranked then return robots end
  local pool = population.without_robots(robots)
  if not has_rows then
    pool.ranked = parents
    for i = 1, #robots do pool[i] = robots[i] end
    return pool
  end
  pool.ranked, pool.records, pool.parents, pool.engine = {}, {}, parents, nil
  for k, each in ipairs(parents) do
    local is_row = type(each) == "table"
    pool.ranked[k] = k
    pool.records[k] = is_row and robots.world.archive:record(each) or robots.records[each]
    pool[k] = is_row and scored_robot.new(pool.records[k], { materials = robots.materials,
      scene = robots.world.config.scene, options = robots.world.options }) or robots[each]
  end
  return pool
end

-- One parent of a pair: an index into the robots, or a row of the archive.
local function parent_of(pool, value, what, ...)
  if type(value) == "table" then
    row_record(pool, value, what:format(...))
    return value
  end
  check_index(value, pool, what, ...)
  return pool.parents and pool.parents[value] or value
end

--- Checks the two parents of a robot that the selection returned.
---@param pool limax.population.scored
---@param child integer index in the next generation
---@param place string of the script's own selection: " (FILE:LINE)"; else ""
---@param first any
---@param second any
---@param third any nil if right
---@return (integer|limax.archive.row)[]
function mating.chosen(pool, child, place, first, second, third)
  local what, generation = "the selection's choice%s for robot %d of generation %d",
    pool.generation + 1
  if third ~= nil then
    failure.raise(1, (what .. ": expected two indices, got more"):format(place, child, generation))
  end
  return { parent_of(pool, first, what, place, child, generation),
    parent_of(pool, second, what, place, child, generation) }
end

--- One pair of parents per robot of the next generation: an elite twice, then two parents for each
--- offspring, by `choose` or as the script names them.
---@param pool limax.population.scored from which the selection picks
---@param count integer robots of the next generation
---@param elites integer[]
---@param named? integer[][]
---@param choose fun(pool: limax.population.scored, child: integer): (integer|limax.archive.row)[]
---@return (integer|limax.archive.row)[][]
function mating.pairs(pool, count, elites, named, choose)
  local wanted = count - #elites
  if named and #named ~= wanted then
    failure.raise(1, ("breed: %d elites and %d pairs of parents make %d robots; the population"
      .. " is %d"):format(#elites, #named, #elites + #named, count))
  end
  for k, pair in ipairs(named or {}) do
    if type(pair) ~= "table" or #pair ~= 2 then
      failure.raise(1, ("breed: parents[%d] is %s; expected a pair { i, j } of indices or rows of"
        .. " the archive"):format(k, schema.show(pair)))
    end
  end
  local list = {}
  for k, index in ipairs(elites) do list[k] = { index, index } end
  for k = 1, wanted do
    local child, what = #elites + k, "breed: a parent in parents[%d]"
    list[child] = named and { parent_of(pool, named[k][1], what, k),
      parent_of(pool, named[k][2], what, k) } or choose(pool, child)
  end
  return list
end

---@class limax.mating.parents
---@field engine limax.population genomes
---@field records table[] one for each genome
---@field pairs integer[][] two indices of these for each robot of the next generation

--- The parents of pairs. With rows of the archive among them, the genomes that the pairs need are
--- copied into a population of their own.
---@param robots limax.population.scored
---@param list (integer|limax.archive.row)[][]
---@param new_robots fun(count: integer): limax.population
---@return limax.mating.parents
function mating.parents(robots, list, new_robots)
  local at, sources, indices, has_rows = {}, {}, {}, false
  for _, pair in ipairs(robots.archive and list or {}) do
    has_rows = has_rows or type(pair[1]) == "table" or type(pair[2]) == "table"
  end
  if not has_rows then return { engine = robots.engine, records = robots.records, pairs = list } end
  for child, pair in ipairs(list) do
    indices[child] = {}
    for k = 1, 2 do
      local source = pair[k]
      if not at[source] then
        sources[#sources + 1] = source
        at[source] = #sources
      end
      indices[child][k] = at[source]
    end
  end
  local gathered, records, archive = new_robots(#sources), {}, robots.world.archive
  local genes = gathered.genes
  local memory = ffi.new("float[?]", #sources * genes)
  for k, source in ipairs(sources) do
    local genome
    if type(source) == "table" then
      genome, records[k] = archive:genome(source), archive:record(source)
    else
      genome, records[k] = view.memory(robots.engine:genome_copy(source)), robots.records[source]
    end
    ffi.copy(memory + (k - 1) * genes, genome, genes * ffi.sizeof "float")
  end
  gathered:set_genomes(memory)
  return { engine = gathered, records = records, pairs = indices }
end

--- The records of the next generation, still without the bodies of the offspring. Ids count on:
--- they are unique in a repetition, and the same in a run that is continued.
---@param generation integer the next one
---@param elites integer number of the pairs that are elites, which come first
---@param parents limax.mating.parents elites are rows of one generation
---@param keep boolean do elites keep their scores?
---@param homes? integer[] the island of each robot
---@return limax.row[]
function mating.records(generation, elites, parents, keep, homes)
  local count, places, sources, from = #parents.pairs, {}, {}, nil
  local all = columns.new(count)
  for i = 1, elites do
    local row = parents.records[parents.pairs[i][1]]
    from, places[i], sources[i] = row[1], i, row[2]
  end
  if from then all:copy(from, places, sources) end
  for i = 1, elites do
    all.origin[i] = "elite"
    if not keep then all:forget_score(i) end
  end
  for i = elites + 1, count do
    local pair = parents.pairs[i]
    all.id[i], all.generation[i], all.origin[i] = generation * count + i, generation, "bred"
    all:set_parents(i, parents.records[pair[1]].id, parents.records[pair[2]].id)
  end
  for i = 1, homes and count or 0 do all.island[i] = homes[i] end
  return all.rows
end

--- Replaces the last offspring of each island, or of the population, by new random robots, and sets
--- the ages of all: the generations since the oldest ancestor.
---@param records limax.row[] of the next generation
---@param parents limax.mating.parents
---@param newcomers integer in all islands
---@return integer[] rows of the new robots
function mating.renew(records, parents, newcomers)
  local rows, count = {}, {}
  for i = #records, 1, -1 do
    local record, pair = records[i], parents.pairs[i]
    local home = record.island or 0
    if record.origin == "bred" and (count[home] or 0) < newcomers then
      count[home] = (count[home] or 0) + 1
      table.insert(rows, 1, i)
      record.origin, record.age = "initial", 0
      columns.of(record):set_parents(i)
    else
      record.age = 1 + math.max(parents.records[pair[1]].age or 0,
        parents.records[pair[2]].age or 0)
    end
  end
  return rows
end

return mating
