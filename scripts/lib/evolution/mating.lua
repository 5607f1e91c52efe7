--- mating.lua: checks the indices that a script's survival, selection or own loop gives, gathers
--- the genomes of the parents, and makes the records of the next generation. A parent may also be a
--- row of the archive.

local ffi = require "ffi"

local archived = require "limax.evolution.archived"
local failure = require "limax.base.failure"
local generations = require "limax.evolution.generation"
local genes = require "limax.experiment.genes"
local rows = require "limax.robot.rows"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local view = require "limax.engine.view"

local mating = {}

-- `what` is a pattern for messages, and `...` its arguments.
local function check_index(index, robots, what, ...)
  if type(index) ~= "number" or index ~= math.floor(index) or index < 1 or index > #robots then
    what = what:format(...)
    local hint = index == nil and " (a selection returns two)"
      or type(index) == "table" and " (population.ranked lists indices, best first)"
      or type(index) == "number" and " (the id of a robot is not an index)" or ""
    failure.raise(1, ("%s is %s; expected an index from 1 to %d%s"):format(what, schema.show(index),
      #robots, hint))
  end
  return index
end

--- Checks a list of survivors or parents: each has a score, and none is listed twice.
---@param what string names the list in messages: "breed: elites"
function mating.check_scored(robots, list, what)
  if type(list) ~= "table" then
    failure.raise(1, ("%s: expected a list of indices, got %s"):format(what, schema.show(list)))
  end
  local seen = {}
  for k, index in ipairs(list) do
    check_index(index, robots, "%s[%d]", what, k)
    if not robots.rows[index].fitness then
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

--- Copies the ranking of the robots, which scripts may read and must not change.
---@return integer[] a copy of the ranking, for `mating.check_unchanged`
function mating.ranking(robots)
  local copy = {}
  for k, index in ipairs(robots.ranked) do copy[k] = index end
  return copy
end

--- Raises if a script sorted or cut the list of robots or their ranking, which all calls share.
---@param ranking integer[] from before the script ran
---@param who string "the selection"
function mating.check_unchanged(robots, ranking, who)
  local what
  for k = 1, math.max(#ranking, #robots.ranked) do
    if robots.ranked[k] ~= ranking[k] then what = "population.ranked" end
  end
  for i, row in ipairs(robots.rows) do
    if not robots[i] or robots[i].row ~= row then what = "the population's list of robots" end
  end
  if what then
    failure.raise(1, ("%s of generation %d changed %s, which all its calls share: change a copy,"
      .. " such as local mine = { unpack(population.ranked) }"):format(who, robots.generation,
      what))
  end
end

-- The robot of a row of the archive that a script names as a parent.
local function robot_of(robots, row, what)
  local robot = robots.remembered and archived.robot(robots.remembered, row)
  if robot then return robot end
  failure.raise(1, ("%s is %s; expected an index%s"):format(what, schema.show(row),
    robots.remembered and " or a row of the archive that it has now: population.archive[i]" or ""))
end

--- Checks a list of parents: robots with a score, none twice, or rows of the archive.
---@param list (integer|limax.archive.row)[]
---@param what string names the list in messages
---@return boolean has_rows
function mating.check_parents(robots, list, what)
  local indices, has_rows = {}, false
  for k, each in ipairs(type(list) == "table" and list or {}) do
    if type(each) == "table" then
      robot_of(robots, each, ("%s[%d]"):format(what, k))
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
---@param parents (integer|limax.archive.row)[]
function mating.pool(robots, parents, has_rows)
  if parents == robots.ranked then return robots end
  local pool = generations.part(robots)
  if not has_rows then
    pool.ranked = parents
    for i = 1, #robots do pool[i] = robots[i] end
    return pool
  end
  pool.ranked, pool.rows, pool.parents, pool.engine = {}, {}, parents, nil
  for k, each in ipairs(parents) do
    local is_row = type(each) == "table"
    pool.ranked[k] = k
    pool.rows[k] = is_row and archived.robot(robots.remembered, each) or robots.rows[each]
    pool[k] = is_row and scored_robot.new(pool.rows[k], { materials = robots.materials,
      scene = robots.world.config.scene, options = robots.world.options }) or robots[each]
  end
  return pool
end

-- One parent of a pair: an index into the robots, or a row of the archive.
local function parent_of(pool, value, what, ...)
  if type(value) == "table" then
    robot_of(pool, value, what:format(...))
    return value
  end
  check_index(value, pool, what, ...)
  return pool.parents and pool.parents[value] or value
end

--- Checks the two parents of a robot that the selection returned.
---@param child integer index in the next generation
---@param place string of the script's own selection: " (FILE:LINE)"; else ""
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
---@param choose fun(pool: limax.population.scored, child: integer): (integer|limax.archive.row)[]
---@return (integer|limax.archive.row)[][]
function mating.pairs(pool, count, elites, named, choose)
  local wanted = count - #elites
  if named and #named ~= wanted then
    failure.raise(1, ("breed: %d elites and %d pairs of parents make %d robots; the population"
      .. " is %d%s"):format(#elites, #named, #elites + #named, count, #named == count
      and "; elites = {} leaves out those of the survival" or ""))
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
---@field rows limax.row[] one for each genome
---@field pairs integer[][] two indices of these for each robot of the next generation

-- The parents of pairs. With rows of the archive among them, the genomes that the pairs need are
-- copied into a population of their own.
local function parents_of(robots, list)
  local at, sources, indices, has_rows = {}, {}, {}, false
  for _, pair in ipairs(robots.archive and list or {}) do
    has_rows = has_rows or type(pair[1]) == "table" or type(pair[2]) == "table"
  end
  if not has_rows then return { engine = robots.engine, rows = robots.rows, pairs = list } end
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
  local gathered, found = robots.world:empty(#sources), {}
  local count = gathered.genes
  local memory = ffi.new("float[?]", #sources * count)
  for k, source in ipairs(sources) do
    local genome
    if type(source) == "table" then
      genome, found[k] = archived.genome(source), archived.robot(robots.remembered, source)
    else
      genome, found[k] = view.memory(robots.engine:genome_copy(source)), robots.rows[source]
    end
    ffi.copy(memory + (k - 1) * count, genome, count * ffi.sizeof "float")
  end
  gathered:set_genomes(memory)
  return { engine = gathered, rows = found, pairs = indices }
end

-- The rows of the next generation, still without the bodies of the offspring. Ids count on: they
-- are unique in a repetition, and the same in a run that is continued.
local function rows_of(robots, elites, parents, keep, homes)
  local generation = robots.generation + 1
  local all = robots.world:rows(generation, robots.rows)
  local count = all.count
  for i = 1, elites do
    local row = parents.rows[parents.pairs[i][1]]
    rows.copy(all, { i }, row[1], { row[2] })
    all[i].origin = "elite"
    if not keep then rows.forget(all, i) end
  end
  for i = elites + 1, count do
    local pair = parents.pairs[i]
    rows.bear(all, i, generation, generation * count + i, parents.rows[pair[1]].id,
      parents.rows[pair[2]].id)
  end
  for i = 1, homes and count or 0 do all[i].island = homes[i] end
  return all
end

-- Replaces the last offspring of each island, or of the population, by new random robots, and sets
-- the ages of all: the generations since the oldest ancestor. Returns the places of the new robots.
local function renew(all, parents, newcomers)
  local places, count = {}, {}
  for i = #all, 1, -1 do
    local row, pair = all[i], parents.pairs[i]
    local home = row.island or 0
    if row.origin == "bred" and (count[home] or 0) < newcomers then
      count[home] = (count[home] or 0) + 1
      table.insert(places, 1, i)
      row.origin, row.age, row.parents = "initial", 0, nil
    else
      row.age = 1 + math.max(parents.rows[pair[1]].age or 0, parents.rows[pair[2]].age or 0)
    end
  end
  return places
end

--- The rows of the first generation.
function mating.initial(world)
  local all, islands = world:rows(0), world.config.islands
  for i, row in ipairs(all) do
    row.id, row.generation, row.origin = i, 0, "initial"
    -- equal parts, in order
    if islands then row.island = math.ceil(i * islands.count / world.config.population) end
    if world.experiment.survival.ages then row.age = 0 end
  end
  return all
end

--- The generation after a scored one: its genomes and rows, whose bodies are still to be expressed.
---@param decided limax.supervision.decided with `same_materials`: are they those of `robots`?
---@param chosen { elites: integer[], parents: (integer|limax.archive.row)[][],
--- homes: integer[]|nil } as of select.choose
function mating.breed(world, robots, decided, chosen)
  local materials = robots.materials
  if not decided.same_materials then materials = world:materials_with(decided.fields) end
  local parents, elites = parents_of(robots, chosen.parents), #chosen.elites
  -- an elite keeps its score under the same materials, in the same trials
  local keep = decided.same_materials and world.trials(robots.generation + 1) == robots.trials
    and not robots.outdated
  local all = rows_of(robots, elites, parents, keep, chosen.homes)
  local rules = world:rules { materials = materials, parameters = decided.parameters,
    state = rawget(robots, "state") }
  local bred = genes.breed(rules, { generation = robots.generation + 1, elites = elites,
    pairs = parents.pairs, parents = parents.engine, rows = all, parent_rows = parents.rows })
  if world.experiment.survival.ages then
    local places = renew(all, parents, world.experiment.survival.newcomers)
    genes.initialize(rules, bred, places, robots.generation + 1)
  end
  if parents.engine ~= robots.engine then parents.engine:free() end
  return generations.new(world, { generation = robots.generation + 1, rows = all, engine = bred,
    materials = materials, parameters = decided.parameters, archive = robots.archive,
    before = { state = rawget(robots, "state"), archive = robots.remembered,
      scored_with = robots.scored_with }, decided = decided })
end

return mating
