--- population.lua: one generation as data: an array of robots, their records, and the world that
--- they are simulated in. Scripts advance it by `:simulate()`, `:score(fitness)` and `:breed{...}`;
--- each step first does the steps before it that were left out.

local columns = require "limax.robot.columns"
local contexts = require "limax.robot.contexts"
local division = require "limax.evolution.division"
local drive = require "limax.settings.drive"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local fitness = require "limax.fitness"
local host = require "limax.host"
local measures = require "limax.experiment.measures"
local metrics = require "limax.run.metrics"
local schema = require "limax.engine.schema"
local state = require "limax.run.state"
local strict = require "limax.engine.strict"
local scored_robot = require "limax.robot.scored_robot"
local scoring = require "limax.robot.scoring"
local together = require "limax.evolution.together"

--- What all generations of a repetition share.
---@class limax.world
---@field config table the experiment's resolved configuration
---@field scene limax.scene
---@field options table of the engine's simulations
---@field trials fun(generation: integer): limax.trial[] at least one (experiment/trials.lua)
---@field device limax.device
---@field fitness limax.fitness the experiment's
---@field is_divided boolean do ranks divide the robots among themselves (division.lua)?
---@field first_materials limax.materials those of generation 0
---@field first_step number s, limit of the time step for a full body of these
---@field advance fun(simulations: limax.simulation[], on_progress?: fun(progress: table)) to their
--- ends
---@field on_progress? fun(progress: table)
---@field state table|nil of the experiment's scripts (run/state.lua)
---@field measured limax.measured|nil
---@field archive limax.archived|nil
---@field say fun(text: string, key?: string) shows a warning once per key
---@field breed fun(robots: limax.population.scored, choice: table) ends a generation

---@class limax.population.scored an array of robots (limax.scored_robot)
---@field ranked integer[]|nil indices of the scored robots, best first; nil before the first score
---@field generation integer 0, 1, ...
---@field repetition integer 1, 2, ...
---@field parameters table<string, number> that it was bred with
---@field engine limax.population genomes and bodies
---@field materials limax.materials that it is made of
---@field records table[] one per robot, with the fields of its line in the population file
---@field trials limax.trial[] in which its robots are simulated
---@field archive limax.archive.row[]|nil rows of the run's archive; of the newest generation only
---@field evaluations integer robots simulated for their score
---@field timing table<string, number> s of each step
---@field island integer|nil number of the island of which survival and selection see the robots
---@field state table|nil that of the experiment's functions; a loop may write to it after `score`
local Population = strict.methods "population"
local class = { methods = Population }

-- The fields that scripts read, and those that only the loop reads. A population may lack some.
local FIELDS, OF_LOOP = {}, {}
for name in ([[ranked generation repetition parameters engine materials records trials archive
    evaluations timing island state]]):gmatch "%S+" do
  FIELDS[name] = true
end
for name in ([[begun columns ledger on_disk places scored_by scored_with simulated slices
    state_text parents_scored_with supervision supervisor_failed parents]]):gmatch "%S+" do
  OF_LOOP[name] = true
end

-- The state is that of the run: a generation that is written gives the next one a copy.
function class.__index(robots, key)
  if key == "state" then return rawget(robots, "world").state end
  local method = Population[key]
  if method or FIELDS[key] or OF_LOOP[key] or type(key) == "number" then return method end
  return strict.unknown("a population", key, FIELDS, Population)
end

function class.__newindex(robots, key, value)
  if key == "state" then
    failure.raise(1, "population.state is a table of the run: write to its fields, such as"
      .. " population.state.count = 1", 2)
  end
  rawset(robots, key, value)
end

local population = {}

--- Makes a generation from its fields: those of limax.population.scored, and `ledger`, how it got
--- its parameters. Scoring adds its fitness: `scored_with` as it was passed to `score`, `scored_by`
--- as resolved, and `state_text`, the state as it left it. `parents_scored_with` is that of the
--- generation before. `simulated`: were some of its robots, and their traces are there?
---@param world limax.world
---@param fields table
---@return limax.population.scored
function population.new(world, fields)
  local robots = setmetatable(fields, class)
  robots.world, robots.simulations = world, {}
  robots.trials = world.trials(robots.generation)
  robots.evaluations = robots.evaluations or 0
  robots.timing = robots.timing or {}
  robots.timing.simulate, robots.timing.fitness = 0, 0
  robots.columns = columns.of(robots.records[1]) or columns.from(robots.records)
  robots.records = robots.columns.rows
  robots.contexts = contexts.of(robots)
  for i, row in ipairs(robots.records) do
    robots[i] = scored_robot.of_row(row, robots.contexts)
  end
  return robots
end

--- A population with the fields of another one and without its robots.
---@param robots limax.population.scored
---@return limax.population.scored
function population.without_robots(robots)
  local copy = setmetatable({}, class)
  for key, value in pairs(robots) do
    if type(key) == "string" then copy[key] = value end
  end
  copy.columns = nil
  return copy
end

-- One simulation per trial of some robots.
local function simulations_of(robots, mask, materials, options)
  local list = {}
  for k, trial in ipairs(robots.trials) do
    list[k] = engine.simulation(robots.engine, trial.engine_materials or materials,
      trial.engine_scene, options and options[k] or trial.options, robots.world.device, mask)
  end
  return list
end

-- Warns once where a trial's drive is too fast for the time steps of the robots.
local function check_drive(robots, mask)
  for k, trial in ipairs(robots.trials) do
    local longest, outcomes = 0, robots.columns.outcomes[k]
    for i = 1, #robots do
      -- that of an invalid body is not a number
      local step = outcomes[i - 1].time_step
      if mask[i] and step > longest then longest = step end
    end
    local problem = longest > 0 and drive.problem(trial.scene, longest)
    local prefix = robots.world.config.trials and ("trials[%d]: "):format(k) or ""
    if problem then robots.world.say(prefix .. problem, prefix .. "scene.actuation") end
  end
end

--- Warns where a function of the script made only the first body.
---@param robots limax.population.scored
function population.check_bodies(robots)
  for i, record in ipairs(robots.records) do
    if (record.body.voxels > 0) ~= (i == 1) then return end
  end
  if robots[2] then
    robots.world.say("genome.encoding: robot 2 and all that follow are empty: does express visit"
      .. " every robot, for _, i in ipairs(robots) do?")
  end
end

-- Which robots have no status yet and are simulated here: all but the elites that keep their score
-- and those of other ranks. And how many have none.
local function unsimulated(robots)
  local mask, count = {}, 0
  for i, record in ipairs(robots.records) do
    mask[i] = record.status == nil
    if mask[i] then count = count + 1 end
  end
  return robots.world.is_divided and division.own(robots, mask) or mask, count
end

--- Begins to simulate a generation; a GPU goes on with it while the host does other work.
---@param robots limax.population.scored which is then simulated as it is
function population.begin(robots)
  local began, mask, count = host.clock(), unsimulated(robots)
  if count == 0 then return end
  robots.begun = simulations_of(robots, mask, robots.materials)
  together.begin(robots.begun)
  robots.timing.simulate = robots.timing.simulate + host.clock() - began
end

--- Simulates the robots that have no status yet, in each trial.
---@param on_progress? fun(progress: table)
---@return limax.population.scored self
function Population:simulate(on_progress)
  local world, mask, count = self.world, unsimulated(self)
  if count == 0 or world.is_divided and self.simulated then return self end
  local began = host.clock()
  local simulations = self.begun or simulations_of(self, mask, self.materials)
  self.begun = nil
  world.advance(simulations, on_progress or world.on_progress)
  self.simulated = true
  self.columns:settle(simulations, mask, world.config.trials ~= nil)
  for i = 1, #self do
    if mask[i] then self.contexts:simulate(i, simulations) end
  end
  for _, simulation in ipairs(simulations) do table.insert(self.simulations, simulation) end
  self.evaluations = self.evaluations + count
  self.timing.simulate = self.timing.simulate + host.clock() - began
  check_drive(self, mask)
  return self
end

-- Why no robot of a generation has a score, in one line.
local function failure_text(robots)
  local counts, reasons, diverged = {}, {}, false
  for _, record in ipairs(robots.records) do
    local reason = ("%s: %s"):format(record.status, record.reason or "no reason")
    if not counts[reason] then reasons[#reasons + 1] = reason end
    counts[reason] = (counts[reason] or 0) + 1
    diverged = diverged or record.status == "diverged"
  end
  table.sort(reasons)
  for k, reason in ipairs(reasons) do reasons[k] = ("%d %s"):format(counts[reason], reason) end
  local world, advice = robots.world, ""
  local step = world.config.simulation.time_step
  if diverged and type(step) == "number" and step > world.first_step then
    advice = ("; simulation.time_step is %.6g s, the limit for stiff bodies is %.6g s"):format(step,
      world.first_step)
  elseif counts["invalid: no muscle"] == #robots then
    advice = "; genome.require_muscle = false lets bodies without a muscle run"
  end
  return ("generation %d: none of the %d robots can be scored (%s)%s"):format(robots.generation,
    #robots, table.concat(reasons, ", "), advice)
end

-- Warns once where a function of the script scores robots by their first trial only.
local function check_trials_read(robots, law, wanted)
  if #robots.trials == 1 or law.name ~= "function" then return end
  for i, record in ipairs(robots.records) do
    if wanted[i] and record.status == "done" then
      if rawget(robots[i], "trials") then return end
      robots.world.say(("trials: the fitness does not read robot.trials, so only the first of %d"
        .. " trials counts; robot.trials[2]:distance() is that of the second"):format(
        #robots.trials), "robot.trials")
    end
  end
end

-- What to report of a first generation whose bodies differ and whose scores do not; nil of others.
local function constant_text(robots)
  local first, differ = robots.records[robots.ranked[1]], false
  for _, i in ipairs(robots.ranked) do
    local record = robots.records[i]
    if record.fitness ~= first.fitness then return nil end
    differ = differ or record.body.hash ~= first.body.hash
  end
  return differ and ("all %d scored robots of generation 0 have the fitness %.6g: selection cannot"
    .. " tell them apart; does the fitness read the robot?"):format(#robots.ranked, first.fitness)
end

-- A loop that resumes with this generation runs again, and the functions that score do not.
local function check_state(robots)
  local before = robots.state_text
  if before and state.encode(robots.world.state) ~= before then
    failure.raise(2, "score: the loop changed population.state before score; change it between"
      .. " score and breed: a loop that resumes repeats what is there, and not the scores")
  end
end

-- Scores robots that were simulated here, and takes the scores of other ranks.
local function call_fitness(robots, law, wanted)
  local world, began = robots.world, host.clock()
  local failures = scoring.score { call = law.call, ours = law.name ~= "function", robots = robots,
    records = robots.records, wanted = wanted,
    generation = robots.generation, state = world.state,
    measure = world.measured and function(robot, record)
      return measures.add(world.measured, robot, record, world.state)
    end }
  robots.timing.fitness = robots.timing.fitness + host.clock() - began
  if world.is_divided then failures = division.exchange(robots, failures) end
  scoring.judge(failures, robots.records, robots.generation, world.say)
end

--- Scores every robot that ended well: by the experiment's fitness, or by another one. Elites and
--- robots read from a run folder keep a valid score.
---@param with? string|table|fun(robot: table): number, number[]?
---@return limax.population.scored self
function Population:score(with)
  local world, parents_with = self.world, self.parents_scored_with
  local law = with == nil and world.fitness or fitness.get(with)
  with = with == nil and world.fitness or with
  check_state(self)
  -- an elite keeps its score only under the fitness that gave it
  if parents_with ~= nil and parents_with ~= with then
    for i = 1, #self do
      if not self.contexts.simulated[i] then self.columns:forget_score(i) end
    end
  end
  self:simulate()
  local wanted = {}
  for i = 1, #self do
    wanted[i] = self.contexts.simulated[i] ~= nil
    -- a robot that failed in another fitness may get a score from this one
    if wanted[i] then self.columns:set_status(i) end
  end
  call_fitness(self, law, wanted)
  local began = host.clock()
  check_trials_read(self, law, wanted)
  self.ranked = metrics.rank(self.records)
  self.scored_with, self.scored_by = self.scored_with or with, law
  if self.simulated then self.scored_with = with end
  if #self.ranked == 0 then failure.raise(1, failure_text(self)) end
  local constant = self.generation == 0 and constant_text(self)
  if constant then world.say(constant) end
  local descriptors = self.generation == 0 and (world.measured or {}).descriptors or {}
  for _, text in ipairs(measures.beyond(descriptors, self.records)) do world.say(text) end
  if world.archive and self.simulated then
    world.archive:update(self)
    self.archive = world.archive:list()
  end
  self.state_text = world.state and state.encode(world.state)
  self.timing.fitness = self.timing.fitness + host.clock() - began
  return self
end

--- Some robots simulated once more, in each trial, under other materials or options. The population
--- stays as it is.
---@param robots limax.population.scored
---@param mask boolean[] which ones
---@param materials limax.materials
---@param options? table[] of each trial; its own if left out
---@return table<integer, limax.scored_robot> by index; its record has no score
---@return limax.simulation[] simulations for the caller to free
---@return number seconds wall time of simulating
function population.simulate_again(robots, mask, materials, options)
  local again, simulations = {}, simulations_of(robots, mask, materials, options)
  -- compiles kernels and makes springs, which are not timed
  for _, simulation in ipairs(simulations) do simulation:describe() end
  local began = host.clock()
  robots.world.advance(simulations)
  local seconds = host.clock() - began
  local all, which = columns.new(#robots), {}
  for i = 1, #robots do
    if mask[i] then which[#which + 1] = i end
  end
  all:copy(robots.columns, which, which)
  all:settle(simulations, mask, robots.world.config.trials ~= nil)
  for i = 1, #robots do
    if mask[i] then
      again[i] = scored_robot.new(all.rows[i],
        contexts.of_robot(robots, i, simulations, materials, options))
    end
  end
  return again, simulations, seconds
end

local breed_fields = schema.fields { parents = schema.any, elites = schema.any,
  mutation_rate = schema.any, mutation_scale = schema.any, crossover_rate = schema.any }

--- Ends this generation (metrics, history, files) and breeds the next one, if the experiment has
--- one. `parents` holds a pair of indices per offspring and `elites` the robots that are copied;
--- what is left out comes from the experiment. The numbers of elites and pairs add up to the
--- population.
---@param choice? { parents?: integer[][], elites?: integer[], mutation_rate?: number,
--- mutation_scale?: number, crossover_rate?: number }
---@return limax.population.scored self
function Population:breed(choice)
  local checked, message = breed_fields(choice, "breed")
  if not checked then failure.raise(2, message, 2) end
  self.world.breed(self, checked)
  return self
end

--- Frees simulations.
---@param simulations limax.simulation[]
---@param why string completes "this view ended when ..."
function population.free(simulations, why)
  for _, simulation in ipairs(simulations) do simulation:free(why) end
end

--- Frees the simulations of a generation, and so its traces.
---@param robots limax.population.scored
---@param why string completes "this view ended when ..."
function population.end_traces(robots, why)
  population.free(robots.simulations, why)
  for i = 1, #robots do robots.contexts:simulate(i, nil) end
  robots.simulations, robots.simulated = {}, nil
end

return population
