--- evolve.lua: the evolution of one repetition: express, simulate, score, record, supervise,
--- select, breed. A generation is plain data (population.lua) that knows the world it is simulated
--- in, and not the run. Every random number is a function of (seed, repetition, generation, robot):
--- a run can stop after any generation and continue with the same bits.

local budget = require "limax.experiment.budget"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local ledger = require "limax.supervise.ledger"
local materials = require "limax.evolution.materials"
local mating = require "limax.evolution.mating"
local population = require "limax.evolution.population"
local record = require "limax.evolution.record"
local runs = require "limax.evolution.run"
local source = require "limax.base.source"
local supervision = require "limax.supervise.supervision"

local Run = runs.methods
local evolve = {}

-- ---- the steps ----------------------------------------------------------------------------------

-- Genomes become bodies: a generation from an engine's population and the other fields.
local function express(run, fields)
  local began = host.clock()
  fields.engine:express(fields.materials, { require_muscle = run.config.genome.require_muscle,
    device = run.device })
  population.add_bodies(fields.engine, fields.materials, fields.records)
  fields.timing.express = host.clock() - began
  fields.repetition = run.repetition
  return population.new(run.world, fields)
end

local function first_generation(run)
  local began = host.clock()
  local robots, records = run:new_robots(), {}
  robots:initialize()
  for i = 1, robots.count do
    records[i] = { id = i, generation = 0, parents = host.json.array {}, origin = "initial" }
  end
  return express(run, { engine = robots, generation = 0, records = records,
    materials = run.first_materials, parameters = run.config.breeding,
    ledger = { supervisor = (run.session or run.experiment.supervisor).name,
      entries = host.json.array {} },
    timing = { breed = host.clock() - began, supervise = 0 } })
end

-- Parameters and materials of the next generation, and their ledger record. The rates that an own
-- loop chooses replace the supervisor's.
local function supervise(run, robots, choice)
  local parameters, fields, entry, shares = supervision.decide(run, robots)
  for _, name in ipairs { "mutation_rate", "mutation_scale", "crossover_rate" } do
    if choice[name] ~= nil then
      parameters[name] = choice[name]
      ledger.set(entry, name, choice[name])
    end
  end
  local same = materials.equal(fields, materials.fields(robots.materials))
  return { parameters = parameters, ledger = entry, supervision = shares,
    materials = same and robots.materials or run:materials_with(fields) }
end

-- Elites, and a pair of parents per robot of the next generation.
local function select(run, robots, offspring, choice)
  local elites = mating.elites(robots, offspring.parameters.elite_fraction, choice.elites)
  if choice.elites then
    offspring.parameters.elite_fraction = #elites / #robots
    ledger.set(offspring.ledger, "elite_fraction", #elites / #robots)
  end
  return elites, mating.pairs(robots, elites, choice.parents, function(child)
    return run.experiment.selection(robots, engine.random(run.config.seed, run.repetition,
      "selection", offspring.generation, child))
  end, source.place(run.config.selection))
end

-- Genomes and records of the next generation. An elite keeps its score under the same materials.
local function breed(run, robots, offspring, elites, parents)
  local parameters, generation = offspring.parameters, offspring.generation
  offspring.engine = run:new_robots()
  offspring.engine:breed(robots.engine, parents, { mutation_rate = parameters.mutation_rate,
    mutation_scale = parameters.mutation_scale, crossover_rate = parameters.crossover_rate,
    seed = run.config.seed, repetition = run.repetition, generation = generation,
    elites = #elites }, run.device)
  local keep = offspring.materials == robots.materials and record.scores_valid(robots)
  offspring.records = {}
  for i, pair in ipairs(parents) do
    offspring.records[i] = i <= #elites and mating.elite_record(robots.records[pair[1]], keep)
      -- ids count on: unique in a repetition, and the same in a run that is continued
      or { id = generation * #robots + i, generation = generation, origin = "bred",
        parents = { robots.records[pair[1]].id, robots.records[pair[2]].id } }
  end
end

local function next_generation(run, robots, choice)
  local began = host.clock()
  local offspring = supervise(run, robots, choice)
  offspring.generation, offspring.parents_scored_with = robots.generation + 1, robots.scored_with
  local supervised = host.clock()
  local elites, parents = select(run, robots, offspring, choice)
  breed(run, robots, offspring, elites, parents)
  offspring.timing = { supervise = supervised - began, breed = host.clock() - supervised }
  return express(run, offspring)
end

-- Ends the newest generation: scores it if need be, records it once, and breeds the next one.
local function finish_generation(run, robots, choice)
  if robots ~= run.population or run.upcoming ~= nil then return end
  if not robots.scored_with then robots:score() end
  local last = run.history[#run.history]
  if not last or last.generation < robots.generation then record.write(run, robots) end
  run.upcoming = budget.allows_another(run.config, robots.generation + 1, run.evaluations)
    and next_generation(run, robots, choice)
end

-- ---- the loop -----------------------------------------------------------------------------------

--- Makes one repetition of an experiment, ready for `:generations()`.
---@param experiment limax.experiment
---@param options? limax.run.options
---@return limax.run
function evolve.start(experiment, options)
  local checked, message = runs.check(options)
  if not checked then failure.raise(2, message, 2) end
  local run, verdict = runs.new(experiment, checked)
  run.world.breed = function(robots, choice) finish_generation(run, robots, choice) end
  if experiment.supervisor.start then run.session = experiment.supervisor.start(run) end
  runs.warn(experiment, run.world)
  if verdict then run:restore(run.folder, verdict.scores_valid) end
  return run
end

--- Iterates over the generations: `for population in run:generations() do ... end`. What the body
--- of the loop leaves out (simulate, score, breed) is done by the experiment's own rules.
---@return fun(): limax.population.scored|nil
function Run:generations()
  return function()
    if self.population then
      finish_generation(self, self.population, {})
    elseif #self.history == 0 then
      self.upcoming = first_generation(self)
    end
    self.population, self.upcoming = self.upcoming or nil, nil
    if not self.population and self.owns_folder then
      self.folder:status "done"
      self.folder:close()
      self.owns_folder = false
    end
    return self.population
  end
end

--- Runs all generations that are left. Returns the history.
---@return limax.generation[]
function Run:finish()
  local fine, value, trace = failure.attempt(function()
    for robots in self:generations() do robots:simulate():score():breed() end
  end)
  if not fine then
    -- every whole generation is on disk before anybody handles the error
    if self.folder then self.folder.writer:wait() end
    failure.raise_again(value, trace)
  end
  return self.history
end

return evolve
