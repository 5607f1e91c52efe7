--- mating.lua: checks the indices that a script's survival, selection or own loop gives, gathers
--- the genomes of the parents, and makes the records of the next generation. A parent may also be a
--- row of the archive.

local archived = require "limax.evolution.archived"
local division = require "limax.evolution.division"
local failure = require "limax.base.failure"
local generations = require "limax.evolution.generation"
local genes = require "limax.experiment.genes"
local rows = require "limax.robot.rows"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"

local mating = {}

-- `what` is a pattern for messages, and `...` its arguments.
local function check_index(index, robots, what, ...)
  local count = robots.count or #robots
  if type(index) ~= "number" or index ~= math.floor(index) or index < 1 or index > count then
    what = what:format(...)
    local hint = index == nil and " (a selection returns two)"
      or type(index) == "table" and " (population.ranked lists indices, best first)"
      or type(index) == "number" and " (the id of a robot is not an index)" or ""
    failure.raise(1, ("%s is %s; expected an index from 1 to %d%s"):format(what, schema.show(index),
      count, hint))
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
    for i = 1, robots.count and 0 or #robots do pool[i] = robots[i] end
    return pool
  end
  pool.ranked, pool.rows, pool.parents = {}, {}, parents
  pool.engine, pool.own, pool.stored = nil, nil, nil
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

--- Pairs of parents of robots of the next generation: an elite twice, then two parents for each
--- offspring, by `choose` or as the script names them.
---@param pool limax.population.scored from which the selection picks
---@param share limax.share those that get a pair
---@param choose fun(pool: limax.population.scored, child: integer): (integer|limax.archive.row)[]
---@return table<integer, (integer|limax.archive.row)[]>
function mating.pairs(pool, share, elites, named, choose)
  local count, wanted = share.total, share.total - #elites
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
  local list, what = {}, "breed: a parent in parents[%d]"
  for k = 1, share.count do
    local child = share:number(k)
    local elite, at = elites[child], child - #elites
    list[child] = elite and { elite, elite } or named and { parent_of(pool, named[at][1], what, at),
      parent_of(pool, named[at][2], what, at) } or choose(pool, child)
  end
  return list
end

---@class limax.mating.parents of the robots of a share
---@field engine limax.population genomes
---@field rows limax.row[]|nil of those genomes, by their places, if they are wanted
---@field pairs integer[][] two indices of these for each robot of the share

-- The row of a parent.
local function row_of(robots, source)
  if type(source) == "table" then return archived.robot(robots.remembered, source) end
  return robots.rows[source]
end

-- The id of a parent.
local function id_of(robots, source)
  if type(source) == "table" then return archived.robot(robots.remembered, source).id end
  return rows.id(robots.rows, source)
end

-- The parents of the robots of a share. If some are rows of the archive, or robots of other ranks,
-- the genomes that the pairs need are copied into a population of their own.
local function parents_of(robots, share, chosen, with_rows)
  local own, needed, of_archive, has, whole = {}, {}, {}, {}, 0
  for k = 1, share.count do
    own[k] = chosen.parents[share:number(k)]
    for _, source in ipairs(own[k]) do
      local list = type(source) == "table" and of_archive or needed
      if not has[source] then list[#list + 1] = source end
      has[source] = true
    end
    -- elites are copied, and a function of the script may look at all parents
    if k <= share.elites or robots.world.shows_all then whole = #needed end
  end
  if not (of_archive[1] or robots.world.is_divided) then
    return { engine = robots.own, rows = robots.rows, pairs = own }
  end
  local found, from, at = with_rows and {} or nil, robots.own, {}
  if chosen.is_ahead then
    for _, i in ipairs(needed) do at[i] = robots.share:at(i) end
  else
    from, at = division.parents(robots, needed, whole, chosen.digest, of_archive, {
      rank = archived.rank,
      place = function(row) return archived.place(robots.remembered, row) end,
      genome = function(place) return archived.genome(robots.remembered, place) end })
  end
  if found then
    rows.show(robots.rows, needed)
    for source, k in pairs(at) do found[k] = row_of(robots, source) end
  end
  for k, pair in ipairs(own) do own[k] = { at[pair[1]], at[pair[2]] } end
  return { engine = from, rows = found, pairs = own }
end

-- The rows of the next generation, still without the bodies of the offspring. Ids count on: they
-- are unique in a repetition, and the same in a run that is continued.
local function rows_of(robots, share, chosen, keep)
  local generation = robots.generation + 1
  local all = robots.world:rows(generation, share, robots.rows)
  local places, sources = {}, {}
  -- of other ranks only where a function may look at them
  for k = 1, all.only_own and share.elites or #chosen.elites do
    places[k] = all.only_own and share:number(k) or k
    sources[k] = chosen.elites[places[k]]
  end
  rows.copy(all, places, robots.rows, sources)
  for _, i in ipairs(places) do
    if share:at(i) then all[i].origin = "elite" end
    if not keep then rows.forget(all, i) end
  end
  for k = share.elites + 1, share.count do
    local i = share:number(k)
    local pair = chosen.parents[i]
    rows.bear(all, i, generation, generation * all.count + i, id_of(robots, pair[1]),
      id_of(robots, pair[2]))
  end
  if robots.world.is_divided and robots.world.shows_all then
    for i = #chosen.elites + 1, all.count do
      if not share:at(i) then
        all[i].id = generation * all.count + i
      end
    end
  end
  for k = 1, chosen.homes and (all.only_own and share or all).count or 0 do
    local i = all.only_own and share:number(k) or k
    all[i].island = chosen.homes[i]
  end
  return all
end

-- Replaces the last offspring of each island, or of the population, by new random robots, and sets
-- the ages: the generations since the oldest ancestor. Returns the new robots of this share.
local function renew(robots, all, share, chosen, newcomers)
  local places, count = {}, {}
  for i = all.count, 1, -1 do
    local row, k, home = all[i], share:at(i), chosen.homes and chosen.homes[i] or 0
    local is_elite = i <= #chosen.elites
    if not is_elite and (count[home] or 0) < newcomers then
      count[home] = (count[home] or 0) + 1
      if k then
        table.insert(places, 1, k)
        row.origin, row.age, row.parents = "initial", 0, nil
      end
    elseif is_elite or k then
      local pair = is_elite and { chosen.elites[i], chosen.elites[i] } or chosen.parents[i]
      row.age = 1 + math.max(row_of(robots, pair[1]).age or 0, row_of(robots, pair[2]).age or 0)
    end
  end
  return places
end

--- The rows of the first generation.
---@param share limax.share
function mating.initial(world, share)
  local all, islands = world:rows(0, share), world.config.islands
  for i, row in ipairs(all) do
    row.id, row.generation, row.origin = i, 0, "initial"
    -- equal parts, in order
    if islands then row.island = math.ceil(i * islands.count / world.config.population) end
    if world.experiment.survival.ages then row.age = 0 end
  end
  return all
end

--- The generation after a scored one, whose bodies are still to be expressed. It has rows at once
--- only if functions that breed read them: a GPU may begin its work before they are made.
---@param decided limax.supervision.decided with `same_materials`: are they those of `robots`?
---@param chosen limax.chosen
function mating.breed(world, robots, decided, chosen)
  local materials = robots.materials
  if not decided.same_materials then materials = world:materials_with(decided.fields) end
  local share = division.share(robots.share.total, chosen.of_islands or #chosen.elites)
  local with_rows = genes.breeds_in_script(world.experiment.variation)
  local parents = parents_of(robots, share, chosen, with_rows)
  -- an elite keeps its score under the same materials, in the same trials
  local keep = decided.same_materials and world.trials(robots.generation + 1) == robots.trials
    and not robots.outdated
  local function bear() return rows_of(robots, share, chosen, keep) end
  local all = (with_rows or world.experiment.survival.ages) and bear() or nil
  local rules = world:rules { materials = materials, parameters = decided.parameters,
    state = rawget(robots, "state"), share = share }
  local bred = genes.breed(rules, { generation = robots.generation + 1, elites = share.elites,
    pairs = parents.pairs, parents = parents.engine, rows = all, parent_rows = parents.rows })
  if world.experiment.survival.ages then
    local places = renew(robots, all, share, chosen, world.experiment.survival.newcomers)
    genes.initialize(rules, bred, places, robots.generation + 1)
  end
  if parents.engine ~= robots.own then parents.engine:free() end
  return generations.new(world, { generation = robots.generation + 1, rows = all,
    bear = not all and bear or nil, own = bred, share = share, kept = keep and share.elites or 0,
    waiting = share.total - (keep and #chosen.elites or 0), materials = materials,
    parameters = decided.parameters, archive = robots.archive,
    before = { state = rawget(robots, "state"), archive = robots.remembered,
      scored_with = robots.scored_with }, decided = decided })
end

return mating
