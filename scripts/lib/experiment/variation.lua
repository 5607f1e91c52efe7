--- variation.lua: the library of mutations and crossovers, which make offspring of parents' genes.
--- `genome = { mutation = "block", crossover = "none" }` names one, a function (robots) is a
--- script's own. An encoding may have its own, which a name in `genome` replaces.

local choice = require "limax.base.choice"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local variation = strict.module "limax.variation"

---@class limax.variation.step one of these, or neither for the engine's own operator
---@field call? fun(robots: limax.batch) changes the genes of these robots
---@field own? boolean is `call` a function of the script?
---@field none? boolean nothing is changed
---@field adapts? boolean it writes a robot's `step_size`

---@class limax.variation.entry: limax.choice.entry
---@field make fun(options: table): limax.variation.step

--- Mutations by name.
---@type table<string, limax.variation.entry>
variation.mutations = {}

--- Crossovers by name.
---@type table<string, limax.variation.entry>
variation.crossovers = {}

--- gaussian: each gene changes with the chance mutation_rate by N(0, mutation_scale^2), as in the
--- paper; by the engine.
variation.mutations.gaussian = { make = function() return {} end }

--- none: genes stay as the crossover left them.
variation.mutations.none = { make = function() return { none = true } end }

-- A run of `share` of the genes, from a random place and on from the beginning after the last one.
local function each_of_run(random, count, share, work)
  local first = random:integer(count)
  for k = 0, math.ceil(share * count) - 1 do work((first - 1 + k) % count + 1) end
end

-- Changes a run of `share` of the first `count` genes by N(0, scale^2).
local function change_run(random, genes, count, share, scale)
  if count == 0 then return end
  each_of_run(random, count, share, function(g) genes[g] = genes[g] + scale * random:normal() end)
end

--- block: a run of successive genes, mutation_rate of all, changes by N(0, mutation_scale^2); so
--- does one of the genes of control, by their own rate and scale.
variation.mutations.block = {
  make = function()
    return { call = function(robots)
      local rates = robots.parameters
      for _, i in ipairs(robots) do
        local genes, control, random = robots:genes(i), robots:control(i), robots:random(i)
        change_run(random, genes, #genes - #control, rates.mutation_rate, rates.mutation_scale)
        change_run(random, control, #control, rates.control_mutation_rate,
          rates.control_mutation_scale)
      end
    end }
  end,
}

--- self_adaptive: every robot has a step size of its own, which it inherits as the geometric mean
--- of its parents' and which changes by exp(rate N(0, 1)) before it is used; mutation_scale is that
--- of the first generation. Genes of control change as by "gaussian". Schwefel, "Numerical
--- optimization of computer models", 1981.
variation.mutations.self_adaptive = {
  options = { rate = schema.number { value = 0.2, unit = "1", above = 0, maximum = 2,
    note = "some ten generations double or halve a step size" } },
  make = function(options)
    return { adapts = true, call = function(robots)
      local population = robots.parts.population
      local size, before = population.genes, population:genomes_array()
      local scaled = size - population.control_genes
      local first = robots.parameters.mutation_scale
      robots:mutate(nil, { mutation_scale = 1 })
      local genes = population:genomes_array()
      local old, new = before:pointer(), genes:pointer()
      for _, i in ipairs(robots) do
        local pair = robots.parts.pairs[robots.parts.at[i]]
        local one, other = robots.parent_rows[pair[1]], robots.parent_rows[pair[2]]
        local step = math.sqrt((one.step_size or first) * (other.step_size or first))
          * math.exp(options.rate * robots:random(i):normal())
        step = math.max(1e-6, math.min(100, step))
        robots.rows[i].step_size = step
        local at = (robots.parts.at[i] - 1) * size
        for g = at, at + scaled - 1 do new[g] = old[g] + step * (new[g] - old[g]) end
      end
      population:set_genomes(genes)
    end }
  end,
}

--- uniform: each gene comes from the second parent with the chance crossover_rate, as in the paper;
--- by the engine.
variation.crossovers.uniform = { make = function() return {} end }

--- none: offspring are copies of their first parent, before they mutate.
variation.crossovers.none = { make = function() return { none = true } end }

--- two_point: a run of successive genes, crossover_rate of all, comes from the second parent.
variation.crossovers.two_point = {
  make = function()
    return { call = function(robots)
      for _, i in ipairs(robots) do
        local genes, _, second = robots:genes(i), robots:parents(i)
        each_of_run(robots:random(i), #genes, robots.parameters.crossover_rate,
          function(g) genes[g] = second[g] end)
      end
    end }
  end,
}

-- The step that a field of `genome` names, or the encoding's own function.
local function step(field, spec, entries, own, default)
  if spec == nil and own then spec = own end
  if type(spec) == "function" then return { call = spec, own = true } end
  local name, options = choice.read(field, spec or default, entries)
  return entries[name].make(options)
end

--- The mutation and the crossover of an experiment.
---@param genome table of the experiment
---@param definition limax.encoding.definition
---@return { mutation: limax.variation.step, crossover: limax.variation.step }
function variation.get(genome, definition)
  schema.demand(schema.table, genome, "limax.variation.get: genome")
  schema.demand(schema.table, definition, "limax.variation.get: definition")
  return {
    mutation = step("genome.mutation", genome.mutation, variation.mutations, definition.mutate,
      "gaussian"),
    crossover = step("genome.crossover", genome.crossover, variation.crossovers, definition.cross,
      "uniform"),
  }
end

return strict.close("limax.variation", variation)
