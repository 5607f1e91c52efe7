--- evolve.lua: the evolution of one repetition, as a script over batch calls: initialise, express,
--- simulate, score, supervise, select, breed. Every random number is a function of (seed,
--- repetition, generation, robot), so a run can stop after any generation and go on with the same
--- bits.

local budget = require "limax.experiment.budget"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local full_body = require "limax.robot.full_body"
local history = require "limax.run.history"
local host = require "limax.host"
local ledger = require "limax.supervise.ledger"
local mating = require "limax.evolution.mating"
local metrics = require "limax.run.metrics"
local population = require "limax.evolution.population"
local resume = require "limax.run.resume"
local run_folder = require "limax.run.run_folder"
local schema = require "limax.base.schema"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"
local supervision = require "limax.supervise.supervision"

---@class limax.run one repetition of an experiment
---@field experiment limax.experiment
---@field config table the experiment's resolved configuration
---@field repetition integer 1, 2, ...
---@field history limax.generation[] one entry per scored generation
---@field population limax.population.scored|nil the newest generation
local Run = {}
Run.__index = Run

---@class limax.run.options
---@field repetition? integer 1 if left out
---@field device? string|table "auto", "cpu", "cuda", or a device of the engine
---@field threads? integer
---@field out? string a new folder that keeps the generations
---@field resume? boolean go on with what `out` holds, if it is there: the loop's first population
--- is then the last one that is whole, with its scores
---@field changed? boolean with `resume`: go on although script or configuration differ
---@field folder? table the same, made already (run_folder.lua)
---@field say? fun(text: string) hears warnings; standard error if left out
---@field on_progress? fun(progress: table) while robots are simulated
---@field wait? fun(simulation: limax.simulation) advances a simulation to its end (together.lua)
---@field on_generation? fun(entry: limax.generation, seconds: table) after each generation
---@field live_prompts? boolean read a model's prompts again before each generation

local evolve = {}

-- ---- beginning ----------------------------------------------------------------------------------

local function anything(given) return given end

-- Values are checked where they are used.
local start_fields = schema.fields { repetition = anything, device = anything, threads = anything,
  out = anything, resume = schema.boolean(false), changed = schema.boolean(false),
  folder = anything, say = anything, on_progress = anything, wait = anything,
  on_generation = anything, live_prompts = anything }

--- Makes one repetition of an experiment, ready for `:generations()`.
---@param experiment limax.experiment
---@param options? limax.run.options
---@return limax.run
function evolve.start(experiment, options)
  local message
  options, message = start_fields(options, "start")
  if not options then failure.raise(2, message, 2) end
  if options.resume and not options.out then
    failure.raise(2, "start.resume: which run is to go on? name its folder: out = DIR", 2)
  end
  local config = experiment.config
  local repetition = options.repetition or 1
  local device = options.device or "auto"
  if type(device) == "string" then device = engine.device(device, { threads = options.threads }) end
  local folder, verdict = options.folder, nil
  if options.out and not folder then
    if options.resume and run_folder.is_run(options.out) then
      folder, verdict = resume.open(options.out, experiment, repetition, options.changed)
    else
      folder = run_folder.create(options.out, experiment, { repetition = repetition })
    end
    folder:write_environment(device)
  end

  local self = setmetatable({ experiment = experiment, config = config, repetition = repetition,
    device = device, folder = folder, out = options.out, on_progress = options.on_progress,
    wait = options.wait, on_generation = options.on_generation, history = {}, said = {},
    live_prompts = options.live_prompts }, Run)
  self.say_aloud = options.say or function(text) io.stderr:write(text, "\n") end
  self.options = settings.engine_options(config.simulation, config.record)
  self.scene = engine.scene(config.scene)
  self.first_materials = engine.materials(config.materials)
  self.first_fields = evolve.material_fields(self.first_materials)
  self.limits = ledger.limits(config.population, config.supervision.ranges, config.supervision)
  -- refuses a lattice that this machine cannot hold before anything large is made
  engine.population({ lattice = config.lattice, count = config.population }):free()
  self.encoding = engine.encoding { lattice = config.lattice, features = config.genome.features,
    sigma = config.genome.sigma, hidden = config.genome.hidden,
    materials = self.first_materials.count,
    initial_scale = config.genome.initial_scale, seed = config.seed, repetition = repetition }
  self.first_step, self.first_step_material =
    full_body.bound(config.lattice, self.first_materials, self.scene, self.options, device)
  local supervisor = experiment.supervisor
  if supervisor.start then self.session = supervisor.start(self) end
  self:warn()
  if verdict then
    local old = folder:generations(repetition, history.genomes_kept)
    if #old > 0 then
      self:restore(old, verdict.scores_stand)
      -- it was not bred yet: how, the body of the loop knows
      self.population.restored, self.again = true, true
    end
  end
  return self
end

-- What a user should know before hours of computing: said once per experiment.
function Run:warn()
  local experiment = self.experiment
  if experiment.warned then return end
  experiment.warned = true
  for _, note in ipairs(experiment.notes) do self:say(note) end
  local step = self.config.simulation.time_step
  if type(step) == "number" and step > self.first_step then
    local harm = self.config.simulation.integrator == "xpbd" and "its springs get soft"
      or "stiff bodies may diverge"
    self:say(("simulation.time_step = %.6g s is above the limit of %.6g s for a full body of %s:"
      .. " %s"):format(step, self.first_step, self.first_step_material, harm))
  end
end

--- The numbers of each material that a supervisor may change: name -> field -> value.
---@param materials table engine materials
---@return table<string, table<string, number>>
function evolve.material_fields(materials)
  local fields = {}
  for i = 1, materials.count do
    local material = materials:get(i)
    for _, name in ipairs(ledger.material_fields(material)) do
      fields[material.name] = fields[material.name] or {}
      fields[material.name][name] = material[name]
    end
  end
  return fields
end

--- The first materials with those numbers in them.
---@param fields table<string, table<string, number>>
---@return table engine materials
function Run:materials_with(fields)
  local materials = self.first_materials:copy()
  for i = 1, materials.count do
    local material = materials:get(i)
    for _, name in ipairs(ledger.material_fields(material)) do
      materials:set(i, name, fields[material.name][name])
    end
  end
  return materials
end

local function same_fields(a, b)
  for name, fields in pairs(a) do
    for field, value in pairs(fields) do
      if b[name][field] ~= value then return false end
    end
  end
  return true
end

--- Are these materials still those that the run began with?
---@param materials table engine materials
---@return boolean
function Run:has_first_materials(materials)
  return same_fields(evolve.material_fields(materials), self.first_fields)
end

--- Says something to the user, once in a run.
---@param text string
---@param message? string what makes two texts the same; the whole text if left out
function Run:say(text, message)
  message = message or text
  if self.said[message] then return end
  self.said[message] = true
  self.say_aloud(text)
end

-- A new generation: expressed, its records made.
function Run:express(engine_population, given)
  local began = host.clock()
  engine_population:express(given.materials, { require_muscle = self.config.genome.require_muscle,
    device = self.device })
  local records = population.records(engine_population, given.materials, given.record)
  given.timing.express = host.clock() - began
  return population.new { run = self, engine = engine_population, materials = given.materials,
    generation = given.generation, repetition = self.repetition, parameters = given.parameters,
    ledger = given.ledger, kept = given.kept, timing_before = given.timing, records = records }
end

function Run:new_engine_population()
  return engine.population { lattice = self.config.lattice, count = self.config.population,
    encoding = self.encoding }
end

-- Generation 0.
function Run:first_generation()
  local began = host.clock()
  local robots = self:new_engine_population()
  robots:initialize()
  return self:express(robots, { materials = self.first_materials, generation = 0,
    parameters = self.config.breeding, timing = { breed = host.clock() - began, supervise = 0 },
    ledger = { supervisor = (self.session or self.experiment.supervisor).name,
      entries = host.json.array {} },
    record = function(i)
      return { id = i, generation = 0, parents = host.json.array {}, origin = "initial" }
    end })
end

-- ---- the loop -----------------------------------------------------------------------------------

--- Iterates over the generations: `for population in run:generations() do ... end`. What the body
--- of the loop leaves out (simulate, score, breed) is done by the experiment's own rules.
---@return fun(): limax.population.scored|nil
function Run:generations()
  return function()
    if self.ended then return nil end
    if not self.population then
      self.population = self:first_generation()
    elseif self.again then
      self.again = nil
    else
      self.population:breed()
      self.population = self.offspring
    end
    self.offspring = nil
    self.ended = self.population == nil
    if self.ended and self.out then
      self.folder:status "done"
      self.folder:close()
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
    -- whoever hears of it finds every whole generation on disk
    if self.folder then self.folder.writer:wait() end
    failure.raise_again(value, trace)
  end
  return self.history
end

--- Advances a simulation to its end.
---@param simulation limax.simulation
---@param on_progress? fun(progress: table)
function Run:advance(simulation, on_progress)
  if self.wait then
    self.wait(simulation)
  else
    simulation:run(on_progress)
  end
end

-- What follows a scored generation; `population:breed` calls it.
function Run:next_generation(robots, choice)
  if not robots.closed then
    if not robots.ranked then robots:score() end
    self:close(robots)
  end
  local spent = 0
  for _, entry in ipairs(self.history) do spent = spent + entry.evaluations end
  if budget.allows_another(self.config, robots.generation + 1, spent) then
    self.offspring = self:breed(robots, choice)
  end
end

-- Writes a generation into history and folder.
function Run:close(robots)
  local line = metrics.measure(robots)
  line.schema = "limax.metrics/1"
  line.repetition, line.generation = self.repetition, robots.generation
  line.evaluations = robots.evaluations
  line.parameters = robots.parameters
  line.materials = evolve.material_fields(robots.materials)
  line.best_standard = robots:standard_score()

  local before, timing = robots.timing_before, robots.timing
  local seconds = { breed = before.breed, supervise = before.supervise, express = before.express,
    simulate = timing.simulate, fitness = timing.fitness }
  local text = history.encode(robots.records)
  self.scored_by = robots.scored_by
  self.scores_stand = true
  robots.closed = true
  local entry = self:remember { metrics = line, ledger = robots.ledger, text = text,
    population = robots }
  if self.folder then
    seconds.write = self.folder:write_generation { metrics = line, ledger = robots.ledger,
      seconds = seconds, supervision = before.supervision, text = text, engine = robots.engine,
      champion = robots[robots.ranked[1]]:table() }
  end
  robots:end_traces "its population was bred"
  if self.on_generation then self.on_generation(entry, seconds) end
end

-- Adds an entry to the history.
function Run:remember(given)
  local line = given.metrics
  local entry = history.entry { metrics = line, ledger = given.ledger, text = given.text,
    population = given.population,
    materials = self:materials_with(line.materials):table(),
    build = function(records) return self:rebuild(line, given.ledger, records) end }
  self.history[#self.history + 1] = entry
  history.forget(self.history)
  return entry
end

--- A scored population from its records: of an old generation, or of a run that goes on.
---@param line table its metrics
---@param record table its ledger record
---@param records table[]
---@param engine_population? table with genomes, for the newest generations
---@return limax.population.scored
function Run:rebuild(line, record, records, engine_population)
  local robots = population.new { run = self, engine = engine_population,
    materials = self:materials_with(line.materials), generation = line.generation,
    repetition = line.repetition, parameters = line.parameters, ledger = record, records = records }
  robots.ranked = metrics.rank(records)
  robots.simulated, robots.closed = true, true
  robots.evaluations = line.evaluations
  return robots
end

--- Puts a run where it stood after the last of `generations`, so that `:generations()` goes on from
--- there.
---@param generations limax.run_folder.generation[] with the genomes of the last three
---@param scores_stand boolean false when the configuration changed: elites are scored again
function Run:restore(generations, scores_stand)
  for _, given in ipairs(generations) do
    local robots
    if given.genomes then
      local engine_population = self:new_engine_population()
      engine_population:set_genomes(given.genomes)
      local materials = self:materials_with(given.metrics.materials)
      engine_population:express(materials, { require_muscle = self.config.genome.require_muscle,
        device = self.device })
      local records = history.decode(given.text, "generation " .. given.metrics.generation)
      robots = self:rebuild(given.metrics, given.ledger, records, engine_population)
    end
    self:remember { metrics = given.metrics, ledger = given.ledger, text = given.text,
      population = robots }
    self.population = robots
  end
  self.scored_by = self.experiment
  self.scores_stand = scores_stand
end

-- ---- supervise and breed ------------------------------------------------------------------------

-- The offspring of a scored generation.
function Run:breed(robots, choice)
  local began, generation = host.clock(), robots.generation + 1
  local parameters, fields, record, shares = supervision.decide(self, robots)
  local supervised = host.clock()
  local function set(name, value)
    parameters[name] = value
    ledger.set(record, name, value)
  end
  for _, name in ipairs { "mutation_rate", "mutation_scale", "crossover_rate" } do
    if choice[name] ~= nil then set(name, choice[name]) end
  end
  local changed = not same_fields(fields, evolve.material_fields(robots.materials))
  local materials = changed and self:materials_with(fields) or robots.materials

  local elites = mating.elites(robots, parameters.elite_fraction, choice.elites)
  local pairs_of_robots = mating.pairs(robots, elites, choice.parents, function(child)
    local random = engine.random(self.config.seed, self.repetition, "selection", generation, child)
    return self.experiment.selection(robots, random)
  end, source.place(self.config.selection))
  if choice.elites then set("elite_fraction", #elites / #robots) end
  local offspring = self:new_engine_population()
  offspring:breed(robots.engine, pairs_of_robots, { mutation_rate = parameters.mutation_rate,
    mutation_scale = parameters.mutation_scale, crossover_rate = parameters.crossover_rate,
    seed = self.config.seed, repetition = self.repetition, generation = generation,
    elites = #elites }, self.device)

  local kept, keep = {}, self.scores_stand and not changed
  for k = 1, #elites do kept[k] = keep or nil end
  return self:express(offspring, { materials = materials, generation = generation,
    parameters = parameters, ledger = record, kept = kept,
    timing = { supervise = supervised - began, breed = host.clock() - supervised,
      supervision = shares },
    record = function(i)
      if elites[i] then return mating.elite_record(robots.records[elites[i]], keep) end
      local pair = pairs_of_robots[i]
      -- ids count on: unique in a repetition, and the same in a run that goes on
      return { id = generation * #robots + i, generation = generation, origin = "bred",
        parents = { robots.records[pair[1]].id, robots.records[pair[2]].id } }
    end })
end

return evolve
