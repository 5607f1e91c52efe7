--- generation.lua: one generation as plain data, which each step takes and returns: an array of
--- robots with their rows, genomes and bodies, the world that they are simulated in, and values of
--- the generation before. Scripts advance it by `:simulate()`, `:score(fitness)` and `:breed{...}`;
--- each step first does the steps before it that were left out.

local new_table = require "table.new"

local archived = require "limax.evolution.archived"
local bound_check = require "limax.robot.bound_check"
local control_notes = require "limax.settings.control_notes"
local division = require "limax.evolution.division"
local drive = require "limax.settings.drive"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local fault = require "limax.engine.fault"
local fitness = require "limax.fitness"
local host = require "limax.host"
local measures = require "limax.experiment.measures"
local plausible = require "limax.settings.plausible"
local rows = require "limax.robot.rows"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local scoring = require "limax.robot.scoring"
local state = require "limax.run.state"
local steps = require "limax.robot.steps"
local strict = require "limax.engine.strict"

---@class limax.population.scored an array of robots (limax.scored_robot)
---@field ranked integer[]|nil indices of the scored robots, best first; nil before the first score
---@field generation integer 0, 1, ...
---@field repetition integer 1, 2, ...
---@field parameters table<string, number> that it was bred with
---@field engine limax.population genomes and bodies; on several ranks of mpirun only a supervisor
--- has them
---@field materials limax.materials that it is made of
---@field rows limax.row[] one per robot, with its fields
---@field trials limax.trial[] in which its robots are simulated
---@field archive limax.archive.row[]|nil rows of the run's archive, after `score` with its robots
---@field evaluations integer robots simulated for their score
---@field timing table<string, number> s of each step
---@field island integer|nil number of the island of which survival and selection see the robots
---@field state table|nil that of the experiment's functions, after `score`; a loop may write to it
local Population = strict.methods "population"

local class = { methods = Population }

-- The fields that scripts read, and those that only the loop reads; a population may lack some.
-- `before` has the state, the archive and the fitness of the generation before. `decided` has the
-- supervisor's decision: ledger, numbers for timing.jsonl, did the supervisor fail? `going` are its
-- simulations while they are advanced, `traces` those of each robot after that, `waits` is true
-- while there is no memory for them, and `choice` is the argument of `breed`. `share` says which
-- robots this rank has, `own` is the engine's population of these, `unscored` is true until other
-- ranks have their rows, and `best` and `fetched` are some robots of others (division.lua). `whole`
-- is the generation of an island. `waiting` is the number of robots of all ranks that had no
-- status when they were bred, `failed` are numbers of robots that failed, and `coarse` is that of
-- those one of whose masses moved farther than a tenth of an edge in one step. `count` is the size
-- of a list that has only the robots of this rank and a few of others. `bear` makes the rows where
-- there are none yet, of which the first `kept` ones of this share will have a status. `scores` are
-- what this rank's own scores are for the others, and `successor` is the generation that a rank
-- bred without them; false if it could not.
local FIELDS, OF_LOOP = {}, {}
for name in ([[ranked generation repetition parameters engine materials rows trials archive
    evaluations timing island state]]):gmatch "%S+" do
  FIELDS[name] = true
end
for name in ([[world before decided going simulations traces unscored scored_with scored_by outdated
    state_text remembered choice entry line places parents stored waits own share best fetched
    diversity coarse failed whole waiting count bear kept scores successor]]):gmatch "%S+" do
  OF_LOOP[name] = true
end

function class.__index(robots, key)
  local method = Population[key]
  if key == "engine" and rawget(robots, "stored") then
    -- genomes and bodies of old generations, and of other ranks, are read when they are needed
    rawset(robots, "engine", robots.stored:engine_of(robots))
    return rawget(robots, "engine")
  elseif key == "engine" and rawget(robots, "own") then
    failure.raise(1, "population.engine: no rank of mpirun has all robots; population[i].genome and"
      .. " limax.diversity read those of others in a survival or a selection", 2)
  end
  if key == "state" and robots.world.experiment.state then
    failure.raise(1, "population.state is there after score, as the scores left it", 2)
  end
  if method or FIELDS[key] or OF_LOOP[key] or type(key) == "number" then return method end
  return strict.unknown("a population", key, FIELDS, Population)
end

function class.__newindex(robots, key, value)
  if key == "state" then
    failure.raise(1, "population.state is there after score: write to its fields then, such as"
      .. " population.state.count = 1", 2)
  end
  rawset(robots, key, value)
end

local generation = { methods = Population }

--- Frees simulations.
---@param why string completes "this view ended when ..."
function generation.free(simulations, why)
  for _, simulation in ipairs(simulations) do simulation:free(why) end
end

--- Makes a generation from its fields: those of limax.population.scored, `before` and `decided`.
---@param fields table with `own`, or without genomes, and with `rows` or `bear`
---@return limax.population.scored
function generation.new(world, fields)
  local total = fields.share and fields.share.total or fields.rows.count
  local has_all = world.shows_all or fields.rows and not fields.rows.only_own
  local robots = setmetatable(new_table(has_all and total or 0, 32), class)
  for key, value in pairs(fields) do rawset(robots, key, value) end
  robots.share = robots.share or division.share(total, 0)
  if robots.own and not world.is_divided then robots.engine = robots.own end
  robots.world, robots.simulations, robots.repetition = world, {}, world.repetition
  robots.before = robots.before or {}
  robots.trials = world.trials(robots.generation)
  robots.evaluations = robots.evaluations or 0
  robots.timing = robots.timing or {}
  robots.timing.simulate, robots.timing.fitness = 0, 0
  if robots.rows then generation.add_objects(robots) end
  return robots
end

--- Makes the objects of the robots, after their rows if these are still to be made.
function generation.add_objects(robots)
  if robots.bear then robots.rows, robots.bear = robots.bear(), nil end
  local all, share = robots.rows, robots.share
  robots.count = all.only_own and all.count or nil
  for k = 1, all.only_own and share.count or all.count do
    local i = all.only_own and share:number(k) or k
    robots[i] = scored_robot.of(robots, i)
  end
end

--- Makes the objects of robots of other ranks, whose rows were lent, where there are none.
---@param list integer[]
function generation.show(robots, list)
  for _, i in ipairs(list) do robots[i] = robots[i] or scored_robot.of(robots, i) end
end

--- The fields of a population without its robots: an island, or a pool of parents.
---@return limax.population.scored
function generation.part(robots)
  local copy = setmetatable({}, class)
  for key, value in pairs(robots) do
    if type(key) == "string" then rawset(copy, key, value) end
  end
  return copy
end

--- Warns if a function of the script made only the first body.
---@param robots limax.population.scored
---@return limax.population.scored robots
function generation.check_bodies(robots)
  for k = 1, robots.share.count do
    local i = robots.share:number(k)
    if (robots.rows[i].body.voxels > 0) ~= (i == 1) then return robots end
  end
  if robots.share:at(1) and robots.share.total > 1 then
    robots.world.say("genome.encoding: robot 2 and all that follow are empty: does express visit"
      .. " every robot, for _, i in ipairs(robots) do?")
  end
  return robots
end

-- ---- simulating ---------------------------------------------------------------------------------

-- The beginning of a warning about a trial.
local function prefix_of(robots, trial)
  return robots.world.config.trials and ("trials[%d]: "):format(trial) or ""
end

-- Makes a simulation of some robots of an engine's population for each trial.
local function simulations_of(robots, population, mask, materials, options)
  local list = {}
  for k, trial in ipairs(robots.trials) do
    list[k] = engine.simulation(population, trial.engine_materials or materials,
      trial.engine_scene, options and options[k] or trial.options, robots.world.device, mask)
    local found = list[k]:overlap()
    if found then
      robots.world.say(("%sgeneration %d: %s"):format(prefix_of(robots, k), robots.generation,
        plausible.overlap(found)), prefix_of(robots, k) .. found.obstacle)
    end
    for _, note in ipairs(bound_check.notes(population, mask,
      trial.engine_materials or materials, trial.engine_scene, trial.options)) do
      robots.world.say(prefix_of(robots, k) .. note)
    end
  end
  return list
end

-- Warns once if a trial's drive is too fast for the time steps of the robots, or its controller
-- shortens them.
local function check_drive(robots, which)
  for k, trial in ipairs(robots.trials) do
    local longest, slowest = 0, nil
    for _, i in ipairs(which) do
      -- that of an invalid body is not a number
      local row = robots.rows[i]
      local step = rows.outcomes(row)[k].time_step
      if step > longest then longest, slowest = step, rows.outcomes(row)[k] end
    end
    local short = slowest and control_notes.short_steps(trial.scene, trial.options, slowest)
    if short then robots.world.say(prefix_of(robots, k) .. short, "scene.control.rate") end
    local problem = longest > 0 and drive.problem(trial.scene, longest)
    local prefix = prefix_of(robots, k)
    if problem then robots.world.say(prefix .. problem, prefix .. "scene.actuation") end
  end
end

-- Warns once, if a robot diverged, about forces whose stated bounds the time step relies on.
local function check_forces(robots, which)
  for _, i in ipairs(which) do
    local row = robots.rows[i]
    if row.status == "diverged" then
      for k, trial in ipairs(robots.trials) do
        for name, effect in pairs(trial.scene) do
          if effect.force and effect.bound then
            local place = ("%sscene.%s.bound"):format(prefix_of(robots, k), name)
            robots.world.say(("%s: robot %s of generation %d diverged; the automatic time step"
              .. " relies on this bound of the force: is it large enough?"):format(place, row.id,
              robots.generation), place)
          end
        end
      end
      return
    end
  end
end

-- A mask of the engine's robots, and the places there of the robots of a list, by number.
local function masked(count, list, place_of)
  local mask, at = {}, {}
  for k = 1, count do mask[k] = false end
  for _, i in ipairs(list) do
    at[i] = place_of(i)
    mask[at[i]] = true
  end
  return mask, at
end

-- Finds the robots to simulate here: those of this rank without a status (elites may keep theirs).
-- Returns also the number of robots without a status on all ranks.
local function unsimulated(robots)
  local which, share, all = {}, robots.share, robots.rows
  for k = all and 1 or robots.kept + 1, share.count do
    local i = share:number(k)
    if not all or rows.is_waiting(all, i) then which[#which + 1] = i end
  end
  local count = robots.world.is_divided and (robots.waiting or 0) or #which
  robots.unscored = robots.world.is_divided and count > 0
  return which, count
end

--- Begins to simulate a generation as it is now, or goes on; a GPU steps it while the host does
--- other work.
function generation.begin(robots)
  local began = host.clock()
  if not robots.going then
    -- robots that other ranks simulated have their status from there
    if robots.world.is_divided and robots.traces then return end
    local which, count = unsimulated(robots)
    if count == 0 then return end
    local mask, at = masked(robots.own.count, which, function(i) return robots.share:at(i) end)
    robots.going = { which = which, at = at, count = count,
      steps = steps.new(simulations_of(robots, robots.own, mask, robots.materials)) }
  end
  robots.going.steps:begin()
  robots.timing.simulate = robots.timing.simulate + host.clock() - began
end

local function is_memory(value) return fault.is(value) and value.kind == "memory" end

--- Frees the memory of a generation's simulations, which begin again later, from the start.
function generation.wait(robots)
  if robots.going then generation.free(robots.going.steps.all, "there was no memory for it") end
  robots.going, robots.waits = nil, true
end

--- Begins to simulate a generation beside others if the memory is enough; else it waits.
function generation.begin_beside(robots)
  if robots.waits then return end
  local fine, value, trace = failure.attempt(generation.begin, robots)
  if fine then return end
  if not is_memory(value) then failure.raise_again(value, trace) end
  generation.wait(robots)
end

-- Ends the simulations of a generation and sets the outcomes of its robots.
local function settle(robots)
  local going = robots.going
  rows.settle(robots.rows, going.steps.all, going.at)
  robots.going, robots.traces = nil, robots.traces or {}
  for _, i in ipairs(going.which) do robots.traces[i] = going.steps.all end
  for _, simulation in ipairs(going.steps.all) do table.insert(robots.simulations, simulation) end
  robots.evaluations = robots.evaluations + going.count
  check_drive(robots, going.which)
  check_forces(robots, going.which)
end

--- Simulates a generation for a slice of wall time.
---@return boolean ended
function generation.advance(robots)
  if not robots.going then generation.begin(robots) end
  if not robots.going then return true end
  local began = host.clock()
  local ended = robots.going.steps:advance()
  if ended then settle(robots) end
  robots.timing.simulate = robots.timing.simulate + host.clock() - began
  return ended
end

--- Simulates the robots that have no status yet, in each trial.
---@param on_progress? fun(progress: table)
---@return limax.population.scored self
function Population:simulate(on_progress)
  if on_progress ~= nil and type(on_progress) ~= "function" then
    schema.refuse("population:simulate", "a function (progress)", on_progress)
  end
  local show = on_progress or self.world.on_progress
  while true do
    local going = self.going and self.going.steps
    local ended = generation.advance(self)
    if show and going then show(going:total()) end
    if ended then return self end
  end
end

-- Makes simulations of some robots that are ready to be stepped. If there is not enough memory
-- beside other repetitions, these begin again later.
local function prepared(robots, population, mask, materials, options)
  local list
  local function prepare()
    list = simulations_of(robots, population, mask, materials, options)
    for _, simulation in ipairs(list) do simulation:describe() end
  end
  local fine, value, trace = failure.attempt(prepare)
  if fine then return list end
  local make_room = is_memory(value) and robots.world.make_room
  if not make_room then failure.raise_again(value, trace) end
  generation.free(list or {}, "there was no memory for it")
  make_room()
  prepare()
  return list
end

--- Simulates some robots once more, in each trial, under other materials or options. Does not
--- change the population.
---@param which integer[] which ones
---@param options? table[] of each trial; its own if left out
---@return table<integer, limax.scored_robot> by index, without a score
---@return limax.simulation[] simulations for the caller to free
---@return number seconds wall time of simulating
function generation.again(robots, which, materials, options)
  local population, places = division.reach(robots, which)
  if not population then
    failure.raise(2, "the genomes of these robots are gone: a run without a folder keeps those of"
      .. " the last three generations; limax.start(experiment, { out = FOLDER }) keeps all", 3)
  end
  local mask, at = masked(population.count, which, function(i) return places[i] end)
  -- kernels are compiled and springs made before the clock starts
  local again, simulations = {}, prepared(robots, population, mask, materials, options)
  local began = host.clock()
  steps.finish(simulations)
  local seconds = host.clock() - began
  local all, traces, order, places_of = rows.new(robots.rows.facts, #which), {}, {}, {}
  for k, i in ipairs(which) do order[k], places_of[k] = k, at[i] end
  rows.copy(all, order, robots.rows, which)
  for k in ipairs(which) do rows.forget(all, k) end
  rows.settle(all, simulations, places_of)
  for k, i in ipairs(which) do
    traces[i] = simulations
    again[i] = scored_robot.again(all[k], robots, i,
      { materials = materials, options = options, traces = traces, population = population,
        index = at[i] })
  end
  return again, simulations, seconds
end

--- Frees the simulations of a generation, and so its traces.
---@param why string completes "this view ended when ..."
function generation.end_traces(robots, why)
  generation.free(robots.simulations, why)
  robots.simulations, robots.traces = {}, nil
end

-- ---- scoring ------------------------------------------------------------------------------------

-- Explains in one line why no robot of a generation has a score.
local function failure_text(robots)
  division.complete(robots)
  local counts, reasons, diverged = {}, {}, false
  local config = robots.world.config
  for _, row in ipairs(robots.rows) do
    diverged = diverged or row.status == "diverged"
    local reason = ("%s: %s"):format(row.status, rows.explained(row.reason or "no reason",
      not config.trials and config.simulation or nil))
    if not counts[reason] then reasons[#reasons + 1] = reason end
    counts[reason] = (counts[reason] or 0) + 1
  end
  table.sort(reasons)
  for k, reason in ipairs(reasons) do reasons[k] = ("%d %s"):format(counts[reason], reason) end
  local world, advice = robots.world, ""
  local step = config.simulation.time_step
  if diverged and type(step) == "number" and step > world.first_step then
    advice = ("; simulation.time_step is %.6g s, the limit for stiff bodies is %.6g s"):format(step,
      world.first_step)
  elseif counts["invalid: no muscle"] == robots.rows.count then
    advice = "; genome.require_muscle = false lets bodies without a muscle run"
  end
  return ("generation %d: none of the %d robots can be scored (%s)%s"):format(robots.generation,
    robots.rows.count, table.concat(reasons, ", "), advice)
end

-- Warns once if a function of the script scores robots only by their first trial.
local function check_trials_read(robots, law, wanted)
  if #robots.trials == 1 or law.name ~= "function" then return end
  for _, i in ipairs(wanted) do
    if robots.rows[i].status == "done" then
      if rawget(robots[i], "trials") then return end
      robots.world.say(("trials: the fitness does not read robot.trials, so only the first of %d"
        .. " trials counts; robot.trials[2]:distance() is that of the second"):format(
        #robots.trials), "robot.trials")
    end
  end
end

-- Warns if a function of the script writes to the state and then scores a robot differently: what
-- it wrote counts, and so does the order of the robots.
local function check_order(robots, law, wanted, own_state)
  if robots.generation > 0 or law.name ~= "function" or not own_state
    or state.encode(own_state) == state.encode(robots.before.state) then
    return
  end
  for _, i in ipairs(wanted) do
    local row = robots.rows[i]
    if row.fitness then
      local again = scoring.call(law.call, robots[i], state.copy(own_state))
      if again ~= row.fitness then
        robots.world.say(("state: the fitness writes to it, and gives robot %s %.6g, but %s after"
          .. " the others: scores depend on the order of the robots; write to it in the survival or"
          .. " the supervisor"):format(row.id, row.fitness, again and ("%.6g"):format(again)
          or "no score"))
      end
      return
    end
  end
end

-- A warning about a first generation of equal scores; nil for others.
local function constant_text(robots)
  local all = robots.rows
  local first, differ = robots.ranked[1], false
  for _, i in ipairs(robots.ranked) do
    if all[i].fitness ~= all[first].fitness then return nil end
    differ = differ or rows.hash(all, i) ~= rows.hash(all, first)
  end
  if robots.scored_by.name == "carry" and all[first].fitness == 0 then
    return ("no robot of generation 0 moves scene.block: its position { %.6g, %.6g, %.6g } may be"
      .. " out of reach"):format(unpack(robots.trials[1].scene.block[1].position))
  end
  if not differ and #robots.ranked > 2 then
    return ("all %d scored robots of generation 0 have the same body and fitness: does the encoding"
      .. " read the genes?"):format(#robots.ranked)
  end
  return differ and ("all %d scored robots of generation 0 have the fitness %.6g: selection cannot"
    .. " tell them apart; does %s?"):format(#robots.ranked, all[first].fitness,
    robots.scored_by.name == "function" and "the fitness read the robot"
    or "the scene let robots differ in it")
end

-- Scores robots that were simulated here.
local function call_fitness(robots, law, wanted, own_state)
  local world, began = robots.world, host.clock()
  local failures = scoring.score { call = law.call, ours = law.name ~= "function", robots = robots,
    rows = robots.rows, wanted = wanted, count = robots.share.total, generation = robots.generation,
    state = own_state,
    measure = world.measured and function(robot, row)
      return measures.add(world.measured, robot, row, own_state)
    end }
  robots.timing.fitness = robots.timing.fitness + host.clock() - began
  return failures
end

-- Receives the scores of other ranks.
local function exchange_scores(robots, own)
  local world, failures = robots.world, own.failures
  if world.is_divided then failures = division.exchange(robots, failures, own.state) end
  scoring.judge(failures, robots.share.total, robots.generation, world.say)
end

-- Stores the state after a scored generation. The run goes on with the state as a reader of the
-- journal would decode it, so that a continued run cannot differ from an uninterrupted one.
local function keep_state(robots, own_state)
  robots.state_text = own_state and state.encode(own_state)
  rawset(robots, "state", own_state and state.decode(robots.state_text))
end

-- Clears scores that another fitness gave: an elite keeps its score only under the same one.
local function forget_scores(robots, fitness_chosen)
  local before = robots.before.scored_with
  if before == nil or before == fitness_chosen then return end
  for k = 1, robots.share.count do
    local i = robots.share:number(k)
    if not (robots.traces and robots.traces[i]) then rows.forget(robots.rows, i) end
  end
end

-- The robots that were simulated here. One that failed in another fitness may get a score again.
local function robots_to_score(robots)
  local wanted, share = {}, robots.share
  for k = 1, robots.traces and share.count or 0 do
    local i = share:number(k)
    if robots.traces[i] then
      wanted[#wanted + 1] = i
      rows.set_status(robots.rows, i)
    end
  end
  return wanted
end

-- Warns of scores that are valid but probably unintended.
local function check_scores(robots)
  if robots.generation > 0 then return end
  local world = robots.world
  local constant = constant_text(robots)
  if constant then world.say(constant) end
  for _, text in ipairs(measures.beyond((world.measured or {}).descriptors or {}, robots.rows)) do
    world.say(text)
  end
end

-- Enters the robots into the archive of the run.
local function enter_archive(robots)
  if not robots.world.archive then return end
  robots.remembered = archived.enter(robots.before.archive, robots)
  robots.archive = archived.shown(robots.remembered)
end

-- Simulates and scores the robots of this rank.
local function score_own(robots, with)
  local law = with == nil and robots.world.fitness or fitness.get(with)
  if with == nil then with = law end
  forget_scores(robots, with)
  robots:simulate()
  local is_simulated = robots.traces ~= nil -- and not read from a folder
  local wanted = robots_to_score(robots)
  local own_state = is_simulated and state.copy(robots.before.state) or nil
  local failures = call_fitness(robots, law, wanted, own_state)
  robots.scores = { failures = failures, wanted = wanted, state = own_state,
    is_simulated = is_simulated }
  if is_simulated or not robots.scored_with then robots.scored_with = with end
  robots.scored_by = law
end

--- Simulates and scores the robots of this rank, and frees their simulations. `score` then brings
--- the scores of the others.
function generation.score_ahead(robots)
  score_own(robots)
  generation.end_traces(robots, "its robots were scored")
end

--- Scores every robot that ended well: by the experiment's fitness, or by another one. Elites and
--- robots read from a run folder keep a valid score.
---@param with? string|table|fun(robot: table): number, number[]?
---@return limax.population.scored self
function Population:score(with)
  if not self.scores then score_own(self, with) end
  local own = self.scores
  self.scores = nil
  exchange_scores(self, own)
  local began = host.clock()
  check_trials_read(self, self.scored_by, own.wanted)
  check_order(self, self.scored_by, own.wanted, own.state)
  self.ranked = division.rank(self)
  if #self.ranked == 0 then failure.raise(1, failure_text(self)) end
  check_scores(self)
  if own.is_simulated then
    enter_archive(self)
    keep_state(self, own.state)
  end
  self.timing.fitness = self.timing.fitness + host.clock() - began
  return self
end

-- ---- breeding -----------------------------------------------------------------------------------

local breed_fields = schema.fields { parents = schema.any, elites = schema.any,
  mutation_rate = schema.any, mutation_scale = schema.any, crossover_rate = schema.any,
  control_mutation_rate = schema.any, control_mutation_scale = schema.any }

--- Chooses from what the next generation is bred, when the body of the loop ends. `parents` holds a
--- pair of indices per offspring and `elites` the robots that are copied; what is left out comes
--- from the experiment. The numbers of elites and pairs add up to the population.
---@param choice? { parents?: integer[][], elites?: integer[], mutation_rate?: number,
--- mutation_scale?: number, crossover_rate?: number, control_mutation_rate?: number,
--- control_mutation_scale?: number }
---@return limax.population.scored self
function Population:breed(choice)
  local checked, message = breed_fields(choice, "breed")
  if not checked then failure.raise(2, message, 2) end
  if self.choice then
    failure.raise(1, ("breed: generation %d was bred already: call it once in the loop"):format(
      self.generation))
  end
  if not self.ranked then self:score() end
  self.choice = checked
  return self
end

return generation
