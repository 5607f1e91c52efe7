--- survival.lua: the library of survival schemes: which robots of a scored generation go on to the
--- next one, and from which robots the selection chooses parents. A scheme is a function
--- (robots, random, state) -> survivors, parents: two lists of indices, best first. Survivors are
--- copied into the next generation and keep their scores; offspring fill the rest. Without
--- `parents` the survivors are the parents, or where there are none all scored robots. Parents may
--- also be rows of the archive: `return {}, robots.archive`.

local choice = require "limax.base.choice"
local schema = require "limax.engine.schema"
local sorting = require "limax.base.sorting"
local strict = require "limax.engine.strict"

local survival = strict.module "limax.survival"

---@alias limax.survival.scheme fun(robots: limax.population.scored, random: limax.random,
--- state: any, parameters: table<string, number>): integer[], (integer|limax.archive.row)[]?

-- The first `count` of a list.
local function first(list, count)
  local part = {}
  for k = 1, math.min(count, #list) do part[k] = list[k] end
  return part
end

---@class limax.survival
---@field name string a library name, or "function"
---@field call limax.survival.scheme
---@field selection? string|table the selection where the experiment names none
---@field needs_descriptors? string an archive that gives them, where the scheme needs one
---@field objectives? limax.measure[]

---@class limax.survival.entry: limax.choice.entry
---@field make fun(options: table): limax.survival.scheme
---@field selection? string|table
---@field needs_descriptors? string

--- Options of each scheme, by its name.
---@type table<string, limax.survival.entry>
survival.entries = {}

--- elitist: the best `elite_fraction` of the robots, at least one and at most all but one, go on;
--- all scored robots may be parents. A supervisor may change `elite_fraction`.
survival.entries.elitist = {
  options = {},
  make = function()
    return function(robots, _, _, parameters)
      local count = math.max(math.floor(parameters.elite_fraction * #robots + 0.5), 1)
      return first(robots.ranked, math.min(count, #robots - 1)), robots.ranked
    end
  end,
}

--- generational: no robot goes on; all scored robots may be parents.
survival.entries.generational = {
  options = {},
  make = function()
    return function(robots) return {}, robots.ranked end
  end,
}

--- plus: (mu + lambda). The best `share` of the population are the survivors, mu, and the only
--- parents of the others, lambda.
survival.entries.plus = {
  options = { share = schema.number { value = 0.5, unit = "of the population", above = 0,
    maximum = 1, note = "as many parents as offspring" } },
  make = function(options)
    return function(robots)
      local count = math.max(math.floor(options.share * #robots + 0.5), 1)
      return first(robots.ranked, math.min(count, #robots - 1))
    end
  end,
}

--- map_elites: no robot goes on; the parents are the archive's robots, all with the same chance
--- unless the experiment names a selection. Needs an archive of cells. Mouret and Clune,
--- "Illuminating search spaces by mapping elites", 2015.
survival.entries.map_elites = {
  options = {},
  selection = { "truncation", share = 1 },
  needs_descriptors = "grid",
  make = function()
    return function(robots)
      local scores, ranked = {}, {}
      for k, row in ipairs(robots.archive) do scores[k] = row.fitness end
      for k, at in ipairs(sorting.descending(scores)) do ranked[k] = robots.archive[at] end
      return {}, ranked
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
  return { name = name, call = entry.make(options), selection = entry.selection,
    needs_descriptors = entry.needs_descriptors, objectives = options.objectives }
end

return strict.close("limax.survival", survival)
