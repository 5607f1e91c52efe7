--- evolve.lua: the evolution of one repetition: express, simulate, score, supervise, select, breed,
--- record. A generation is plain data (population.lua) that knows the world it is simulated in, and
--- not the run. Every random number is a function of (seed, repetition, generation, robot): a run
--- can stop after any generation and continue with the same bits.

local budget = require "limax.experiment.budget"
local columns = require "limax.robot.columns"
local exchange = require "limax.base.exchange"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local genes = require "limax.experiment.genes"
local host = require "limax.host"
local islands = require "limax.evolution.islands"
local ledger = require "limax.supervise.ledger"
local materials = require "limax.evolution.materials"
local mating = require "limax.evolution.mating"
local metrics = require "limax.run.metrics"
local population = require "limax.evolution.population"
local record = require "limax.evolution.record"
local runs = require "limax.evolution.run"
local select = require "limax.evolution.select"
local state = require "limax.run.state"
local step_check = require "limax.evolution.step_check"
local supervision = require "limax.supervise.supervision"

local Run = runs.methods
local evolve = {}

-- ---- the steps ----------------------------------------------------------------------------------

-- A generation from its fields: the genomes of `engine` become bodies. A GPU steps them while the
-- host describes them in the records, and writes the files of the generation before.
local function express(run, fields)
  local began = host.clock()
  genes.express(run:rules_of_genes(fields), fields.engine)
  fields.repetition = run.repetition
  fields.archive = run.world.archive and run.world.archive:list()
  local robots = population.new(run.world, fields)
  if run.simulates_all then population.begin(robots) end
  robots.columns.bodies:describe(robots.engine, robots.materials)
  robots.timing.express = host.clock() - began - robots.timing.simulate
  return robots
end

local function first_generation(run)
  local began = host.clock()
  local robots = run:new_robots()
  local all = columns.new(robots.count)
  for i = 1, robots.count do
    all.id[i], all.generation[i], all.origin[i] = i, 0, "initial"
    all.island[i], all.age[i] = islands.first(run.config, i),
      run.experiment.survival.ages and 0 or nil
  end
  genes.initialize(run:rules_of_genes { materials = run.first_materials,
    parameters = run.config.breeding }, robots, nil, 0)
  local first = express(run, { engine = robots, generation = 0, records = all.rows,
    materials = run.first_materials, parameters = run.config.breeding,
    ledger = { supervisor = (run.session or run.experiment.supervisor).name,
      entries = host.json.array {} },
    timing = { breed = host.clock() - began, supervise = 0 } })
  population.check_bodies(first)
  return first
end

-- Parameters, materials and ledger record of the next generation. What an own loop chooses replaces
-- what the supervisor decides.
local function supervise(run, robots, choice)
  local ranking = mating.ranking(robots)
  -- a supervisor reads the history, which only the first rank has, and may ask a model
  local decided = exchange.first(function()
    local parameters, fields, entry, shares, failed = supervision.decide(run, robots)
    return { parameters = parameters, fields = fields, entry = entry, shares = shares,
      failed = failed, state = run.world.state }
  end)
  local parameters, fields, entry = decided.parameters, decided.fields, decided.entry
  run.world.state = decided.state
  mating.check_unchanged(robots, ranking, "the supervisor")
  choice.elite_fraction = choice.elites and #choice.elites / #robots
  for name in pairs(parameters) do
    if choice[name] ~= nil then
      parameters[name] = choice[name]
      ledger.set(entry, name, choice[name])
    end
  end
  local same = materials.equal(fields, materials.fields(robots.materials))
  return { parameters = parameters, ledger = entry, supervision = decided.shares,
    failed = decided.failed,
    materials = same and robots.materials or run:materials_with(fields) }
end

local function next_generation(run, robots, choice)
  local began, generation = host.clock(), robots.generation + 1
  local decided = supervise(run, robots, choice)
  local rules, supervised = run:rules_of_genes(decided), host.clock()
  local elites, list, homes =
    select.elites_and_parents(run, robots, generation, decided.parameters, choice)
  local parents = mating.parents(robots, list, function(count) return run:new_robots(count) end)
  -- an elite keeps its score under the same materials, in the same trials
  local keep = decided.materials == robots.materials
    and run.world.trials(generation) == robots.trials and record.scores_valid(robots)
  local records = mating.records(generation, #elites, parents, keep, homes)
  local bred = genes.breed(rules, { generation = generation, elites = #elites,
    pairs = parents.pairs, parents = parents.engine, records = records,
    parent_records = parents.records })
  if run.experiment.survival.ages then
    local rows = mating.renew(records, parents, run.experiment.survival.newcomers)
    genes.initialize(rules, bred, rows, generation)
  end
  if parents.engine ~= robots.engine then parents.engine:free() end
  robots.archive = nil
  return express(run, { engine = bred, generation = generation, records = records,
    materials = decided.materials, parameters = decided.parameters, ledger = decided.ledger,
    supervision = decided.supervision, supervisor_failed = decided.failed or nil,
    parents_scored_with = robots.scored_with,
    timing = { supervise = supervised - began, breed = host.clock() - supervised } })
end

-- Ends the newest generation: scores it if it has no score, records it once, and breeds the next.
local function finish_generation(run, robots, choice)
  if robots ~= run.population or run.upcoming ~= nil then return end
  if not robots.scored_with then robots:score() end
  if not run.simulates_all then
    mating.check_unchanged(robots, metrics.rank(robots.records), "the loop")
  end
  local last, line = run.history[#run.history], nil
  if not last or last.generation < robots.generation then
    step_check.look(run, robots)
    line = record.enter(run, robots)
  end
  run.world.state = state.copy(run.world.state)
  -- what was scored is on disk before a language model is asked, and whatever breeding raises
  local function write()
    if line then record.write(run, robots, line) end
    line = nil
  end
  if run.session then write() end
  failure.finally(write, function()
    run.upcoming = budget.allows_another(run.config, robots.generation + 1, run.evaluations)
      and next_generation(run, robots, choice)
  end)
end

-- ---- the loop -----------------------------------------------------------------------------------

--- Makes one repetition of an experiment, ready for `:generations()`.
---@param experiment limax.experiment
---@param options? limax.run.options
---@return limax.run
function evolve.start(experiment, options)
  if not experiments.is(experiment) then
    failure.raise(2,
      "limax.start: expected an experiment: limax.start(limax.experiment { ... })", 2)
  end
  experiments.idle = false
  local checked, message = runs.check(options)
  if not checked then failure.raise(2, message, 2) end
  if exchange.count > 1 and not checked.wait then
    failure.raise(2, "limax.start: a loop of your own runs in one process, not in several ranks of"
      .. " mpirun: only an experiment that a script returns does, by limax run", 2)
  end
  local run, comparison = runs.new(experiment, checked)
  run.world.breed = function(robots, choice)
    if robots ~= run.population or run.upcoming ~= nil then
      failure.raise(1, ("breed: generation %d was bred already: call it once in the loop")
        :format(robots.generation))
    end
    finish_generation(run, robots, choice)
  end
  if experiment.supervisor.start and exchange.is_first then
    run.session = experiment.supervisor.start(run)
  end
  runs.warn(experiment, run.world)
  if comparison then
    run:restore(run.folder)
    runs.say_complete(run)
  end
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
    local kept = self.world.state
    if self.population then self.population.state_text = kept and state.encode(kept) end
    if not self.population then
      local text = exchange.is_first
        and supervision.end_text(self.experiment.supervisor, self.history)
      if text then self:say(("repetition %d: %s"):format(self.repetition, text)) end
      self:close()
    end
    return self.population
  end
end

--- Runs all generations that are left. Returns the history.
---@return limax.generation[]
function Run:finish()
  self.simulates_all = true
  for robots in self:generations() do robots:simulate():score():breed() end
  return self.history
end

return evolve
