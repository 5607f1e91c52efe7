--- genes.lua: genes of new robots and of offspring, and their bodies, by an encoding and a
--- variation: by the engine, or by functions of a script on batches of robots.

local batch = require "limax.experiment.batch"
local failure = require "limax.base.failure"

local genes = {}

---@class limax.genes.rules what genes are made and read by
---@field encoding limax.encoding.definition
---@field variation { mutation: limax.variation.step, crossover: limax.variation.step }
---@field lattice integer[] voxels along x, y, z
---@field materials limax.materials
---@field parameters table<string, number> as of limax.batch
---@field state table|nil of the experiment's functions
---@field seed number|string
---@field repetition integer
---@field require_muscle boolean
---@field device limax.device|nil
---@field number nil|fun(place: integer): integer of a robot in its generation, where a population
--- has a part of it
---@field empty fun(): limax.population another population of the same size
---@field say fun(text: string) warns once

-- Purposes of a script's random numbers; robots count below 2^24.
local PHASE = { initialize = 0, mutation = 1, crossover = 2 }

-- Calls a function of a script on rows of a population.
local function call(what, own, rules, population, rows, fields)
  local phase = PHASE[fields.phase] -- none in an express
  local robots = batch.new(rows, { generation = fields.generation, lattice = rules.lattice,
    materials = rules.materials, parameters = phase and rules.parameters,
    rows = fields.rows, parent_rows = fields.parent_rows,
    parts = { state = rules.state, population = population, pairs = fields.pairs,
      parents = fields.parents,
      number = rules.number, seed = rules.seed, repetition = rules.repetition,
      device = rules.device,
      express = not phase, counter = phase and phase * 2 ^ 24, empty = rules.empty } })
  local ok, problem, trace = failure.attempt_watched(what, own, robots)
  if not ok then failure.raise_again(problem, trace) end
end

local function rows_of(first, last)
  local rows = {}
  for i = first, last do rows[#rows + 1] = i end
  return rows
end

--- The genes of new robots.
---@param population limax.population of the engine
---@param rows integer[]|nil all if left out
function genes.initialize(rules, population, rows, generation)
  local own = rules.encoding.initialize or function(robots) robots:initialize() end
  call("the encoding's initialize", own, rules, population, rows or rows_of(1, population.count),
    { phase = "initialize", generation = generation })
end

-- Gives a robot whose weights an encoding did not write those of a plain body: stiffness and
-- amplitude 1, phase 0.
local function complete_weights(population, i)
  local weights = population:weights_view(i):pointer()
  local each = population.voxels_each
  for k = 0, 3 * each - 1 do
    if weights[k] ~= 0 then return end
  end
  for k = 0, 2 * each - 1 do weights[k] = 1 end
end

--- Genes to bodies: the largest part of each.
---@param population limax.population of the engine
---@param first? integer 1 if left out
---@param count? integer all the rest if left out
function genes.express(rules, population, first, count)
  if rules.encoding.by_engine then
    population:express(rules.materials,
      { require_muscle = rules.require_muscle, device = rules.device }, first, count)
    return
  end
  first = first or 1
  count = count or population.count - first + 1
  call("the encoding's express", rules.encoding.express, rules, population,
    rows_of(first, first + count - 1), {})
  for i = first, first + count - 1 do complete_weights(population, i) end
  population:check(rules.materials,
    { require_muscle = rules.require_muscle, largest_part = true }, first, count)
end

--- Does breeding call functions for the robots, which read rows? The engine does it otherwise.
function genes.breeds_in_script(variation)
  return (variation.mutation.call or variation.crossover.call) ~= nil
end

---@class limax.genes.plan
---@field generation integer of the offspring
---@field elites integer number of robots that are copied, which come first
---@field pairs integer[][] two indices into the parents for each robot
---@field parents limax.population of the engine
---@field rows limax.row[]|nil by the number in the generation; nil unless `breeds_in_script`
---@field parent_rows limax.row[]|nil likewise

--- Breeds a population: elites are copies, the others cross and mutate.
function genes.breed(rules, plan)
  local population, parameters = rules.empty(), rules.parameters
  local mutation, crossover = rules.variation.mutation, rules.variation.crossover
  -- the engine crosses before it mutates, so it mutates now only where no script comes in between
  local in_script = genes.breeds_in_script(rules.variation)
  local mutates = not (in_script or mutation.none)
  population:breed(plan.parents, plan.pairs, {
    mutation_rate = mutates and parameters.mutation_rate or 0,
    mutation_scale = parameters.mutation_scale,
    control_mutation_rate = mutates and parameters.control_mutation_rate or 0,
    control_mutation_scale = parameters.control_mutation_scale,
    crossover_rate = not (crossover.call or crossover.none) and parameters.crossover_rate or 0,
    seed = rules.seed, repetition = rules.repetition, generation = plan.generation,
    elites = plan.elites }, rules.device)
  if not in_script then return population end
  local rows = rows_of(plan.elites + 1, population.count)
  if not rows[1] then return population end
  local function apply(phase, own, is_own)
    local before = is_own and plan.generation == 1 and not rules.number
      and population:genomes_bytes()
    call("the " .. phase, own, rules, population, rows, { phase = phase,
      generation = plan.generation, rows = plan.rows, parent_rows = plan.parent_rows,
      pairs = plan.pairs, parents = plan.parents })
    if before and population:genomes_bytes() == before then
      rules.say(("genome.%s: the %s changed no gene in generation 1: does it write to"
        .. " robots:genes(i), for each i?"):format(phase, phase))
    end
  end
  if crossover.call then apply("crossover", crossover.call, crossover.own) end
  if not mutation.none then
    apply("mutation", mutation.call or function(robots) robots:mutate() end, mutation.own)
  end
  return population
end

return genes
