--- select.lua: which robots of a scored generation go on, and which become parents: the
--- experiment's survival and selection, on the whole population or island by island. An own loop
--- may name both instead.

local ffi = require "ffi"

local division = require "limax.evolution.division"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
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
  local place = source.place(world.config.survival)
  local ranking = place and mating.ranking(robots)
  local survivors, parents = call("the survival", world.experiment.survival.call, robots,
    random_of(world, generation, robots.island and world.config.population + robots.island or 0),
    rawget(robots, "state"), source.copy(parameters))
  if place then mating.check_unchanged(robots, ranking, "the survival") end
  local what = place and ("survival (%s)"):format(place) or "survival"
  if survivors == nil then
    failure.raise(1, what .. " returned nil, expected a list of indices, which may be empty; does"
      .. " every path of it end in `return`?")
  end
  if place then mating.check_scored(robots, survivors, what .. ": survivors") end
  local count = robots.count or #robots
  if #survivors >= count then
    failure.raise(1, ("%s: %d survivors leave no place for offspring in %s of %d: return fewer")
      :format(what, #survivors, robots.island and "an island" or "a population", count))
  end
  parents = parents or survivors[1] and survivors or robots.ranked
  local has_rows = type(parents) == "table" and type(parents[1]) == "table"
  if place and parents ~= robots.ranked then
    has_rows = mating.check_parents(robots, parents, what .. ": parents")
  end
  if #parents == 0 then
    failure.raise(1, what .. ": parents: expected at least one, got an empty list")
  end
  return survivors, mating.pool(robots, parents, has_rows)
end

---@class limax.chosen for the next generation
---@field elites (integer|false)[] false of islands that are left out, where it is ahead
---@field parents table<integer, (integer|limax.archive.row)[]|nil> a pair per robot, at least for
--- those of this rank
---@field homes table<integer, integer>|nil an island per robot
---@field of_islands integer[]|nil elites of each island
---@field is_ahead boolean|nil was it chosen without the other ranks?
---@field digest string|nil of what all ranks chose by functions of a script

-- The bytes of a list of parents; a row of the archive counts as less than 0.
local function bytes_of(count, parent_of)
  local numbers = ffi.new("double[?]", count + 1)
  numbers[0] = count
  for k = 1, count do
    local parent = parent_of(k)
    numbers[k] = type(parent) == "table" and -parent.id or parent
  end
  return ffi.string(numbers, ffi.sizeof(numbers))
end

-- A digest of the elites, the pools of parents, and the pairs that all ranks chose.
local function digest_of(robots, chosen, pools, with_pairs)
  local lists = { bytes_of(#chosen.elites, function(k) return chosen.elites[k] end) }
  for _, pool in ipairs(pools) do
    local ranked, parents = pool.ranked, pool.parents
    lists[#lists + 1] = bytes_of(#ranked, function(k)
      return parents and parents[ranked[k]] or ranked[k]
    end)
  end
  for side = 1, with_pairs and 2 or 0 do
    lists[#lists + 1] = bytes_of(#robots, function(i) return chosen.parents[i][side] end)
  end
  return host.xxh3(table.concat(lists))
end

--- Chooses for the next generation; what an own loop chose comes first.
---@param is_ahead? boolean only of the islands of this rank, without the others
---@return limax.chosen|nil nil if islands.select_own has none
function select.choose(world, robots, decided, is_ahead)
  local generation, parameters, choice =
    robots.generation + 1, decided.parameters, robots.choice or {}
  local config, own = world.config, source.place(world.config.selection)
  local selection, random = world.experiment.selection, nil
  local place = own and (" (%s)"):format(own) or ""
  local chosen
  local rankings, pools = {}, {}
  local function choose(pool, child)
    if not own then
      -- one of the library takes no time, and keeps no stream: all children share the object
      random = random or random_of(world, generation, child)
      random.key.individual, random.draw = child, 0
      return mating.chosen(pool, child, place, selection(pool, random))
    end
    rankings[pool] = rankings[pool] or mating.ranking(pool)
    return mating.chosen(pool, child, place, call("the selection", selection, pool,
      random_of(world, generation, child), rawget(robots, "state")))
  end
  -- a script's function may count its calls in `state`, and so chooses for all robots everywhere
  local function share_of(all_elites)
    local total = robots.share.total
    return own and division.whole(total) or division.share(total, all_elites)
  end
  -- a script's own functions may read any field of any robot. Whole rows come at once: a rank that
  -- has read a field before would not take part when the others ask for it
  local is_script = own or source.place(config.survival)
  if is_script then division.complete(robots) end
  division.set_common(world.is_divided and not is_ahead)
  if config.islands then
    if choice.elites or choice.parents then
      failure.raise(2, "breed: in an experiment with islands, elites and parents come from its"
        .. " survival and selection; leave them out")
    end
    local steps = { choose = choose, share = share_of,
      survive = function(view)
        local survivors, pool = survive(world, view, generation, parameters)
        pools[#pools + 1] = pool
        return survivors, pool
      end,
      random = random_of(world, generation, config.population + config.islands.count + 1) }
    if is_ahead then
      chosen = islands.select_own(robots, config.islands, steps)
      if chosen then chosen.is_ahead = true end
      return chosen
    end
    chosen = islands.select(robots, config.islands, generation, steps)
  else
    local elites, pool = survive(world, robots, generation, parameters, choice.elites)
    pools[1] = pool
    chosen = { elites = elites,
      parents = mating.pairs(pool, share_of(#elites), elites, choice.parents, choose) }
  end
  division.set_common(false)
  for pool, ranking in pairs(rankings) do
    mating.check_unchanged(pool, ranking, "the selection")
  end
  chosen.digest = world.is_divided and is_script and digest_of(robots, chosen, pools, own) or nil
  return chosen
end

return select
