--- survival.lua: the library of survival schemes. A scheme is a function (robots, random, state) ->
--- survivors, parents: two lists of indices, best first. Survivors are copied into the next
--- generation and keep their scores; offspring fill the rest. The selection chooses from `parents`;
--- without them from the survivors, or from all scored robots if there are none. Parents may also
--- be rows of the archive: `return {}, robots.archive`.

local new_table = require "table.new"

local choice = require "limax.base.choice"
local engine = require "limax.engine"
local front = require "limax.experiment.front"
local measures = require "limax.experiment.measures"
local schema = require "limax.engine.schema"
local sorting = require "limax.base.sorting"
local strict = require "limax.engine.strict"

local survival = strict.module "limax.survival"

---@alias limax.survival.scheme fun(robots: limax.population.scored, random: limax.random,
--- state: any, parameters: table<string, number>): integer[], (integer|limax.archive.row)[]?

-- The best share of the population: the first of an order of robots, at least one, and at most as
-- many as leave `places` for others.
local function best(robots, order, share, places)
  local all = robots.count or #robots
  local count = math.min(math.max(math.floor(share * all + 0.5), 1), all - places, #order)
  local list = new_table(math.max(count, 0), 0)
  for k = 1, count do list[k] = order[k] end
  return list
end

-- The best share by the places of robots in `ranked`.
local function best_of_ranked(robots, order, share, places)
  local list = {}
  for k, at in ipairs(order) do list[k] = robots.ranked[at] end
  return best(robots, list, share, places)
end

---@class limax.survival
---@field name string a library name, or "function"
---@field call limax.survival.scheme
---@field selection? string|table the selection where the experiment names none
---@field needs? string[] the archives with which it works; nil if it needs none
---@field objectives? limax.measure[]
---@field reference? number[] of the objectives
---@field share? number of the population that goes on
---@field newcomers? integer random robots in each generation
---@field ages? boolean are ages recorded?
---@field by_rank? boolean does it read no more of a population than `ranked`?

---@class limax.survival.entry: limax.choice.entry
---@field make fun(options: table): limax.survival.scheme|string
---@field selection? string|table
---@field needs? string[]
---@field ages? boolean
---@field by_rank? boolean

--- Options of each scheme, by its name.
---@type table<string, limax.survival.entry>
survival.entries = {}

--- elitist: the best `elite_fraction` of the robots, at least one and at most all but one, go on;
--- all scored robots may be parents. A supervisor may change `elite_fraction`.
survival.entries.elitist = {
  by_rank = true,
  options = {},
  make = function()
    return function(robots, _, _, parameters)
      return best(robots, robots.ranked, parameters.elite_fraction, 1), robots.ranked
    end
  end,
}

--- generational: no robot goes on; all scored robots may be parents.
survival.entries.generational = {
  by_rank = true,
  options = {},
  make = function()
    return function(robots) return {}, robots.ranked end
  end,
}

local share = schema.number { value = 0.5, unit = "of the population", above = 0, maximum = 1,
  note = "as many parents as offspring" }

--- plus: (mu + lambda). The best `share` of the population are the survivors, mu, and the only
--- parents of the others, lambda.
survival.entries.plus = {
  by_rank = true,
  options = { share = share },
  make = function(options)
    return function(robots) return best(robots, robots.ranked, options.share, 1) end
  end,
}

--- map_elites: no robot goes on; the parents are the archive's robots, all with the same chance
--- unless the experiment names a selection. Needs an archive; of islands each has its own grid or
--- CVT. Mouret and Clune, "Illuminating search spaces by mapping elites", 2015.
survival.entries.map_elites = {
  options = {},
  selection = { "truncation", share = 1 },
  needs = { "grid", "cvt", "pareto", "novelty" },
  make = function()
    return function(robots)
      local rows, scores, ranked = {}, {}, {}
      for _, row in ipairs(robots.archive) do
        if row.island == robots.island then
          rows[#rows + 1], scores[#scores + 1] = row, row.fitness
        end
      end
      for k, at in ipairs(sorting.descending(scores)) do ranked[k] = rows[at] end
      return {}, ranked
    end
  end,
}

-- The rows of the scored robots, best fitness first.
local function scored_rows(robots)
  local list = {}
  for k, index in ipairs(robots.ranked) do list[k] = robots.rows[index] end
  return list
end

--- novelty: as plus, by novelty instead of fitness. Needs a novelty archive.
survival.entries.novelty = {
  options = { share = share },
  needs = { "novelty" },
  make = function(options)
    return function(robots)
      local values = {}
      for k, row in ipairs(scored_rows(robots)) do values[k] = row.novelty end
      return best_of_ranked(robots, sorting.descending(values), options.share, 1)
    end
  end,
}

--- nsga2: as plus, by Pareto rank over the objectives, then by the distance from the neighbours in
--- the rank. An objective with a minus is minimised. With a `reference` point, in the objectives'
--- own units, metrics.jsonl has the hypervolume of two or three. Deb et al., "A fast and elitist
--- multiobjective genetic algorithm", 2002.
survival.entries.nsga2 = {
  options = {
    objectives = measures.rule { least = 2, most = 8, objective = true },
    reference = schema.list(schema.number {}, { expected = "a list of numbers" }),
    share = share,
  },
  selection = { "tournament", size = 2 },
  make = function(options)
    local wrong = front.wrong_reference(options)
    if wrong then return wrong end
    return function(robots)
      local points = front.points(scored_rows(robots), options.objectives)
      return best_of_ranked(robots, (front.crowded_order(points)), options.share, 1)
    end
  end,
}

--- age_fitness: AFPO. As plus, by Pareto rank over fitness and age, then by fitness; the age of a
--- robot is the number of generations since its oldest ancestor, which was random. In each
--- generation `newcomers` are new random robots. Parents are drawn from the survivors with equal
--- chances unless the experiment names a selection. Schmidt and Lipson, "Age-fitness Pareto
--- optimization", 2011.
survival.entries.age_fitness = {
  options = {
    share = share,
    newcomers = schema.number { value = 1, unit = "robots in a generation", minimum = 1,
      maximum = 1e6, integer = true, note = "as in the paper" },
  },
  selection = { "truncation", share = 1 },
  ages = true,
  make = function(options)
    return function(robots)
      local points = {}
      for k, row in ipairs(scored_rows(robots)) do
        points[k] = { row.fitness, -(row.age or 0) }
      end
      -- the rows are in the order of fitness, and the sort keeps it
      local order = sorting.ascending((engine.pareto(points)))
      return best_of_ranked(robots, order, options.share, options.newcomers)
    end
  end,
}

--- The scheme that an experiment names: a name, { name, option = value }, or a function.
---@param spec string|table|limax.survival.scheme
---@return limax.survival
function survival.get(spec)
  if type(spec) == "function" then return { name = "function", call = spec } end
  local name, options = choice.read("survival", spec, survival.entries)
  local entry = survival.entries[name]
  local call = entry.make(options)
  if type(call) == "string" then engine.fail(("survival %q: %s"):format(name, call)) end
  return { name = name, call = call, selection = entry.selection, needs = entry.needs,
    objectives = options.objectives, reference = options.reference,
    newcomers = options.newcomers, ages = entry.ages, share = options.share,
    by_rank = entry.by_rank }
end

return strict.close("limax.survival", survival)
