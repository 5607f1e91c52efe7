--- select.lua: which robots of a scored generation go on, and which become parents: the
--- experiment's survival and selection, on the whole population or island by island. An own loop
--- may name both instead.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local islands = require "limax.evolution.islands"
local mating = require "limax.evolution.mating"
local source = require "limax.base.source"

local select = {}

-- Calls a function of the experiment; an error of it ends the run.
local function call(what, own, ...)
  local ok, first, second, third = failure.attempt_watched(what, own, ...)
  if not ok then failure.raise_again(first, second) end
  return first, second, third
end

local function random_of(world, generation, individual)
  return engine.random(world.config.seed, world.repetition, "selection", generation, individual)
end

-- The robots of a population or an island that go on, and the pool from which parents are chosen.
-- An own loop may name the former.
local function survive(world, robots, generation, parameters, named)
  if named then return mating.check_scored(robots, named, "breed: elites"), robots end
  local ranking = mating.ranking(robots)
  local survivors, parents = call("the survival", world.experiment.survival.call, robots,
    random_of(world, generation, robots.island and world.config.population + robots.island or 0),
    rawget(robots, "state"), source.copy(parameters))
  mating.check_unchanged(robots, ranking, "the survival")
  local place = source.place(world.config.survival)
  local what = place and ("survival (%s)"):format(place) or "survival"
  if survivors == nil then
    failure.raise(1, what .. " returned nil, expected a list of indices, which may be empty; does"
      .. " every path of it end in `return`?")
  end
  mating.check_scored(robots, survivors, what .. ": survivors")
  if #survivors >= #robots then
    failure.raise(1, ("%s: %d survivors leave no place for offspring in %s of %d: return fewer")
      :format(what, #survivors, robots.island and "an island" or "a population", #robots))
  end
  parents = parents or survivors[1] and survivors or robots.ranked
  local has_rows = parents ~= robots.ranked
    and mating.check_parents(robots, parents, what .. ": parents")
  if #parents == 0 then
    failure.raise(1, what .. ": parents: expected at least one, got an empty list")
  end
  return survivors, mating.pool(robots, parents, has_rows)
end

--- Chooses for the next generation; what an own loop chose comes first.
---@return { elites: integer[], parents: (integer|limax.archive.row)[][], homes: integer[]|nil } a
--- pair of parents, and an island, per robot of the next generation
function select.choose(world, robots, decided)
  local generation, parameters, choice =
    robots.generation + 1, decided.parameters, robots.choice or {}
  local config, own = world.config, source.place(world.config.selection)
  local selection, random = world.experiment.selection, nil
  local place = own and (" (%s)"):format(own) or ""
  local elites, parents, homes
  local rankings = {}
  local function choose(pool, child)
    rankings[pool] = rankings[pool] or mating.ranking(pool)
    if not own then
      -- one of the library takes no time, and keeps no stream: all children share the object
      random = random or random_of(world, generation, child)
      random.key.individual, random.draw = child, 0
      return mating.chosen(pool, child, place, selection(pool, random))
    end
    return mating.chosen(pool, child, place, call("the selection", selection, pool,
      random_of(world, generation, child), rawget(robots, "state")))
  end
  if config.islands then
    if choice.elites or choice.parents then
      failure.raise(2, "breed: in an experiment with islands, elites and parents come from its"
        .. " survival and selection; leave them out")
    end
    elites, parents, homes = islands.select(robots, config.islands, generation, { choose = choose,
      survive = function(view) return survive(world, view, generation, parameters) end,
      random = random_of(world, generation, config.population + config.islands.count + 1) })
  else
    local pool
    elites, pool = survive(world, robots, generation, parameters, choice.elites)
    parents = mating.pairs(pool, #robots, elites, choice.parents, choose)
  end
  for pool, ranking in pairs(rankings) do
    mating.check_unchanged(pool, ranking, "the selection")
  end
  return { elites = elites, parents = parents, homes = homes }
end

return select
