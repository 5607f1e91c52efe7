--- population.lua: one generation as a script sees it: an array of robots with `ranked`, and the
--- three steps of an own loop, `:simulate()`, `:score(fitness)` and `:breed{...}`. Each step does
--- what was left out before it, by the experiment's own rules.

local body = require "limax.robot.body"
local drive = require "limax.settings.drive"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local fitness = require "limax.fitness"
local host = require "limax.host"
local metrics = require "limax.run.metrics"
local schema = require "limax.base.schema"
local scored_robot = require "limax.robot.scored_robot"
local scoring = require "limax.robot.scoring"

---@class limax.population.scored an array of robots (limax.scored_robot), best first in `ranked`
---@field ranked integer[]|nil indices of the scored robots, best first; nil before the first score
---@field generation integer 0, 1, ...
---@field repetition integer 1, 2, ...
---@field parameters table<string, number> that it was bred with
---@field engine limax.population genomes and bodies
---@field materials limax.materials that it is made of
---@field records table[] one plain table per robot, the lines of its population file
---@field kept boolean[] elites whose score still stands: they are not simulated again
local Population = {}
Population.__index = Population

local population = {}

--- A population around engine objects. `records` lack what is not known yet.
---@param given table run, engine (nil once genomes are gone), materials, generation, repetition,
--- parameters, records, kept
---@return limax.population.scored
function population.new(given)
  local self = setmetatable(given, Population)
  self.kept, self.contexts = given.kept or {}, {}
  self.timing = { simulate = 0, fitness = 0 }
  local run = self.run
  for i, record in ipairs(self.records) do
    -- `simulation` is added when the robot has been simulated
    local context = { population = self.engine, index = i, materials = self.materials,
      scene = run.config.scene, options = run.options, lattice = run.config.lattice,
      device = run.device, fitness = run.config.fitness }
    self[i] = scored_robot.new(record, context)
    self.contexts[i] = context
  end
  return self
end

--- Records of a population that has just been expressed: initial robots or offspring, bodies
--- included.
---@param engine_population table
---@param materials table
---@param make fun(i: integer): table id, generation, parents and origin of robot i, or the whole
--- record of an elite
---@return table[]
function population.records(engine_population, materials, make)
  local records, known = {}, body.known(materials)
  for i = 1, engine_population.count do
    local record = make(i)
    record.schema = "limax.population/1"
    record.body = record.body or body.record(engine_population, i, materials, known)
    records[i] = record
  end
  return records
end

-- A robot that diverged may have passed a moment with numbers that are not finite; no file can hold
-- them, and they say nothing: they are absent.
local function finite(outcome)
  local function is_finite(value) return value - value == 0 end
  for name, value in pairs(outcome) do
    local fine = true
    for _, number in ipairs(type(value) == "table" and value or { value }) do
      fine = fine and (type(number) ~= "number" or is_finite(number))
    end
    if not fine then outcome[name] = nil end
  end
  return outcome
end

--- Simulates every robot but the elites whose score still stands.
---@param on_progress? fun(progress: table)
---@return limax.population.scored self
function Population:simulate(on_progress)
  if self.simulated then return self end
  local run, mask, wanted = self.run, {}, 0
  for i = 1, #self do
    -- asked again after another fitness came (see `score`): what was simulated already stays
    mask[i] = not self.kept[i] and self.contexts[i].simulation == nil
    if mask[i] then wanted = wanted + 1 end
  end
  if wanted > 0 then
    local began = host.clock()
    local simulation = engine.simulation(self.engine, self.materials, run.scene, run.options,
      run.device, mask)
    run:advance(simulation, on_progress or run.on_progress)
    local longest = 0
    for i, record in ipairs(self.records) do
      if mask[i] then
        local outcome = finite(simulation:outcome(i))
        record.outcome, record.status, record.reason = outcome, outcome.status, outcome.reason
        self.contexts[i].simulation = simulation
        longest = math.max(longest, outcome.time_step or 0)
      end
    end
    local problem = longest > 0 and drive.problem(run.config.scene, longest)
    if problem then run:say(problem, "scene.actuation") end
    self.timing.simulate = self.timing.simulate + host.clock() - began
    self.simulations = self.simulations or {}
    self.simulations[#self.simulations + 1] = simulation
  end
  -- not before: what Ctrl-C has cut short at the prompt is simulated again
  self.evaluations = (self.evaluations or 0) + wanted
  self.simulated = true
  return self
end

--- Scores every robot that ended well: by the experiment's fitness, or by another one.
---@param with? string|table|fun(robot: table): number, number[]?
---@return limax.population.scored self
function Population:score(with)
  local run = self.run
  self.fitness = with == nil and run.experiment.fitness or fitness.get(with)
  self.scored_by = with == nil and run.experiment or with
  -- read from a folder, with the scores that this script gave: its traces are gone
  if self.restored then
    run.scored_by = self.scored_by
    return self
  end
  -- an elite's score stands only under the fitness that gave it
  if next(self.kept) and self.scored_by ~= run.scored_by then
    self.kept, self.simulated = {}, false
  end
  self:simulate()
  local began = host.clock()
  local wanted = {}
  for i, record in ipairs(self.records) do
    wanted[i] = not self.kept[i]
    -- scored a second time: what failed in another fitness may be well in this one
    if wanted[i] then
      record.status, record.reason = record.outcome.status, record.outcome.reason
    end
  end
  scoring.score { call = self.fitness.call, robots = self, records = self.records, wanted = wanted,
    generation = self.generation, say = function(text, message) run:say(text, message) end }
  self.ranked = metrics.rank(self.records)
  self.timing.fitness = self.timing.fitness + host.clock() - began
  if #self.ranked == 0 then failure.raise(1, self:obituary()) end
  return self
end

--- Why no robot of this generation has a score, in one line.
---@return string
function Population:obituary()
  local counts, reasons = {}, {}
  for _, record in ipairs(self.records) do
    local reason = ("%s: %s"):format(record.status, record.reason or "no reason given")
    if not counts[reason] then
      counts[reason] = 0
      reasons[#reasons + 1] = reason
    end
    counts[reason] = counts[reason] + 1
  end
  table.sort(reasons)
  for k, reason in ipairs(reasons) do reasons[k] = ("%d %s"):format(counts[reason], reason) end
  local advice = ""
  if counts["invalid: no muscle"] == #self then
    advice = "; genome.require_muscle = false lets bodies without a muscle run"
  end
  local step = self.run.config.simulation.time_step
  if type(step) == "number" and step > self.run.first_step then
    advice = ("; simulation.time_step is %.6g s, stiff bodies bear %.6g s"):format(step,
      self.run.first_step)
  end
  return ("generation %d: none of the %d robots can be scored (%s)%s"):format(self.generation,
    #self, table.concat(reasons, ", "), advice)
end

--- The champion's score under the run's first materials: its own score where the materials are
--- those still; nil where it does not end well under them.
---@return number|nil
function Population:standard_score()
  local run, best = self.run, self.ranked[1]
  local record = self.records[best]
  if run:has_first_materials(self.materials) then return record.fitness end
  -- the same robot was the champion before: its score under the first materials cannot change
  local before = run.history[#run.history]
  if before and before.champion.id == record.id and self.scored_by == run.scored_by
    and run.scores_stand then
    return before.best_standard
  end
  local mask = {}
  for i = 1, #self do mask[i] = i == best end
  local simulation = engine.simulation(self.engine, run.first_materials, run.scene, run.options,
    run.device, mask)
  run:advance(simulation)
  local outcome = simulation:outcome(best)
  local score
  if outcome.status == "done" then
    local copy, context = {}, {}
    for key, value in pairs(record) do copy[key] = value end
    for key, value in pairs(self.contexts[best]) do context[key] = value end
    copy.outcome, context.simulation, context.materials = outcome, simulation, run.first_materials
    score = scoring.call(self.fitness.call, scored_robot.new(copy, context))
  end
  simulation:free "its robot had been scored under the first materials"
  return score
end

local function anything(given) return given end

-- Values are checked where they are used.
local breed_fields = schema.fields { parents = anything, elites = anything,
  mutation_rate = anything, mutation_scale = anything, crossover_rate = anything }

--- Ends this generation (metrics, history, files) and breeds the next one, if the experiment has
--- one. `parents` holds a pair of indices per offspring and `elites` the robots that are copied;
--- what is left out comes from the experiment. The numbers of elites and pairs add up to the
--- population.
---@param choice? { parents?: integer[][], elites?: integer[], mutation_rate?: number,
--- mutation_scale?: number, crossover_rate?: number }
---@return limax.population.scored self
function Population:breed(choice)
  if self.bred then return self end
  if choice ~= nil then
    local given, message = breed_fields(choice, "breed")
    if not given then failure.raise(2, message, 2) end
  end
  self.run:next_generation(self, choice or {})
  self.bred = true
  return self
end

--- Lets go of what only the current generation needs: its simulations and their traces.
---@param why string completes "this view ended when ..."
function Population:end_traces(why)
  for _, simulation in ipairs(self.simulations or {}) do simulation:free(why) end
  for _, context in ipairs(self.contexts) do context.simulation = nil end
  self.simulations = nil
end

return population
