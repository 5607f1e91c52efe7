--- evolve.lua: the loop of one repetition: express, simulate, score, record, supervise, select,
--- breed. A generation is a plain table that each step takes and returns (generation.lua). Every
--- random number is a function of (seed, repetition, generation, robot): a run can stop after any
--- generation and continue with the same bits.

local ffi = require "ffi"

local archived = require "limax.evolution.archived"
local budget = require "limax.experiment.budget"
local division = require "limax.evolution.division"
local exchange = require "limax.base.exchange"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local generations = require "limax.evolution.generation"
local genes = require "limax.experiment.genes"
local host = require "limax.host"
local islands = require "limax.evolution.islands"
local materials = require "limax.evolution.materials"
local mating = require "limax.evolution.mating"
local metrics = require "limax.run.metrics"
local named_parts = require "limax.experiment.named_parts"
local proposals = require "limax.supervise.proposals"
local record = require "limax.evolution.record"
local rows = require "limax.robot.rows"
local runs = require "limax.evolution.run"
local select = require "limax.evolution.select"
local supervision = require "limax.supervise.supervision"

local Run = runs.methods
local evolve = {}

-- Makes the bodies of new genomes. A GPU begins to step them while the host makes their rows,
-- describes them, and writes the last generation.
local function express(run, robots)
  local began = host.clock()
  genes.express(run.world:rules(robots), robots.own)
  -- an own loop may still change bodies
  if run.ahead then run.ahead(robots) end
  if not robots.rows then generations.add_objects(robots) end
  rows.describe(robots.rows, robots.own, robots.materials,
    function(k) return robots.share:number(k) end)
  robots.timing.express = host.clock() - began - robots.timing.simulate
  return robots
end

--- The first generation of a run: the last one of its folder, with its scores, or a new one.
---@return limax.population.scored
function evolve.first(run)
  -- rank 0 reads it for all
  local reads
  local kept = exchange.first(function()
    local robots
    robots, reads = record.kept(run)
    return robots
  end)
  if kept then return record.restore(run, kept, reads) end
  local world, began = run.world, host.clock()
  local share = division.share(world.config.population, 0)
  local robots = generations.new(world, { generation = 0, rows = mating.initial(world, share),
    share = share, own = world:empty_share(share), waiting = share.total,
    materials = world.first_materials,
    parameters = world.config.breeding, before = { state = world:first_state() },
    decided = { ledger = { supervisor = (run.session or world.experiment.supervisor).name,
      entries = host.json.array {} } } })
  genes.initialize(world:rules { materials = robots.materials, parameters = robots.parameters,
    state = robots.before.state, share = share }, robots.own, nil, 0)
  robots.timing.supervise, robots.timing.breed = 0, host.clock() - began
  return generations.check_bodies(express(run, robots))
end

-- Warns of rates that the script's supervisor or loop changes and that nothing uses.
local function check_used(run, ledger)
  local idle = named_parts.idle_rates(run.experiment.variation)
  for _, entry in ipairs(ledger.entries) do
    local named = entry.outcome == "set" or run.experiment.spec.supervisor ~= nil
    if idle[entry.field] and named and entry.outcome ~= "kept" and entry.outcome ~= "rejected" then
      run:say(("%s = %.6g takes no effect: %s does not use it"):format(entry.field, entry.applied,
        idle[entry.field]), entry.field)
    end
  end
end

-- The supervisor's decision. Parameters that an own loop chose replace those of the supervisor.
local function decide(run, robots)
  local reads, choice = run.experiment.supervisor.reads_robots, robots.choice or {}
  local ranking = reads and mating.ranking(robots)
  local decided = supervision.decide(run, robots)
  if reads then mating.check_unchanged(robots, ranking, "the supervisor") end
  for name in pairs(decided.parameters) do
    local chosen = choice[name]
    if name == "elite_fraction" then chosen = choice.elites and #choice.elites / #robots end
    if chosen ~= nil then
      decided.parameters[name] = chosen
      proposals.set(decided.ledger, name, chosen)
    end
  end
  check_used(run, decided.ledger)
  decided.same_materials = materials.equal(decided.fields, materials.fields(robots.materials))
  return decided
end

-- Generations by which a rank runs ahead at most, bytes of their genomes and rows, and s that they
-- take: an interrupt loses them, and they are computed again.
local MOST_AHEAD, MOST_KEPT, LONGEST_AHEAD = 10, 2 ^ 26, 100

-- By how many generations may ranks run ahead after this one?
local function most_ahead(run, robots)
  local seconds = robots.timing.simulate + robots.timing.fitness
  -- one that was read from a folder took none
  if not run.world.runs_ahead or seconds == 0 then return 0 end
  local bytes = robots.share.count
    * (run.world.encoding.genes * ffi.sizeof "float" + robots.rows.layout.size)
  return math.floor(math.min(MOST_AHEAD, MOST_KEPT / bytes, LONGEST_AHEAD / seconds))
end

-- Breeds and expresses what a decision of the supervisor leads to.
---@param began number host.clock before the supervisor was asked
---@param is_ahead? boolean by this rank, without the others
---@return limax.population.scored|nil nil only if it is ahead, and select.choose has nothing
local function follow(run, robots, decided, began, is_ahead)
  local asked = host.clock()
  rawset(robots, "state", decided.state)
  local chosen = select.choose(run.world, robots, decided, is_ahead) -- survivors, parents, islands
  if not chosen then return nil end
  for _, elites in ipairs(chosen.of_islands or {}) do
    if elites ~= chosen.of_islands[1] then run.uneven = robots.generation end
  end
  local children = mating.breed(run.world, robots, decided, chosen) -- genomes and rows
  children.timing.supervise, children.timing.breed = asked - began, host.clock() - asked
  return express(run, children)
end

-- Makes the generation after a recorded one; nil after the last.
local function breed(run, robots)
  local began = host.clock()
  if not budget.allows_another(run.world.config, robots.generation + 1, run.evaluations) then
    return nil
  end
  -- rank 0 has the history, and may ask a model
  local decided
  decided, run.most_ahead = unpack(exchange.first(function()
    return { decide(run, robots), most_ahead(run, robots) }
  end))
  return follow(run, robots, decided, began)
end

--- Records a generation once. Scores it first if the loop did not.
---@return limax.generation|nil entry of the history; nil on other ranks than the first
function evolve.record(run, robots)
  if not robots.ranked then robots:score() end
  if not run.ahead then -- it may have changed scores
    mating.check_unchanged(robots, metrics.rank(robots.rows), "the loop")
  end
  if not robots.entry then record.enter(run, robots) end
  return robots.entry
end

-- Records and writes a generation, and breeds the next one. Collective.
---@return limax.population.scored|nil the next one; nil after the last
local function conclude(run, robots)
  local is_restored = robots.entry ~= nil
  evolve.record(run, robots)
  -- on disk before a model is asked, and before a supervisor reads robots of other ranks
  local reads = run.world.is_divided and run.experiment.supervisor.reads_robots
  if run.session or reads then record.write(run, robots) end
  local upcoming
  -- written while a GPU steps the next one, and also after an error of breeding
  exchange.finally(function()
    division.set_common(false) -- also after an error of a survival
    record.write(run, robots)
  end, function() upcoming = breed(run, robots) end)
  division.forget(robots)
  if not is_restored then run:check_variables() end
  if not upcoming and robots.remembered then
    for _, note in ipairs(archived.notes(robots.remembered, run.world.archive)) do run:say(note) end
  end
  return upcoming
end

-- ---- islands that run ahead ---------------------------------------------------------------------

-- Between two exchanges of robots, islands breed from their own only. A rank that has whole islands
-- then scores its robots and breeds from them without waiting for the others. What all do of these
-- generations, such as metrics and files, follows before the exchange.

-- The numbers of robots follow from the elites of each island: those of other ranks are assumed to
-- have as many as its own. If they have not, what follows is dropped, and the next generations are
-- bred by all together.

-- May this rank breed from a generation without the others? All ranks give the same answer.
local function may_run_ahead(run, robots)
  local world = run.world
  if #run.behind >= run.most_ahead or robots.generation <= run.uneven + MOST_AHEAD
    or islands.exchange_before(world.config.islands, robots.generation + 1) then
    return false
  end
  local evaluations = run.evaluations + robots.waiting
  for _, before in ipairs(run.behind) do evaluations = evaluations + before.waiting end
  return budget.allows_another(world.config, robots.generation + 1, evaluations)
end

-- Scores the robots of this rank and breeds from them.
---@return limax.population.scored|nil nil if its islands have different numbers of elites
local function breed_ahead(run, robots)
  generations.score_ahead(robots)
  local began = host.clock()
  return follow(run, robots, decide(run, robots), began, true)
end

-- Have all islands of all ranks as many elites? Collective.
local function are_equal(robots)
  local list = exchange.all(robots.successor and robots.successor.share.all_elites or false)
  for _, elites in ipairs(list) do
    if not elites or elites ~= list[1] then return false end
  end
  return true
end

-- Frees a generation that was bred under a wrong assumption.
local function drop(robots)
  generations.wait(robots)
  generations.end_traces(robots, "its robots were bred again")
  robots.own:free()
end

-- Records and writes the generations from which this rank bred, so that the next one is bred by all
-- together. Collective.
---@return limax.population.scored|nil the generation after them, bred again if the islands of a
--- rank have other numbers of elites, or if it failed
local function catch_up(run)
  local behind = run.behind
  run.behind, run.most_ahead = {}, 0
  for k, robots in ipairs(behind) do
    evolve.record(run, robots)
    if not are_equal(robots) then
      run.uneven = robots.generation
      for later = k, #behind do
        if behind[later].successor then drop(behind[later].successor) end
      end
      return conclude(run, robots)
    end
    record.write(run, robots)
    division.forget(robots)
  end
  return behind[#behind].successor
end

--- Records and writes a generation, and breeds the next one.
---@return limax.population.scored|nil the next one; nil after the last
function evolve.next(run, robots)
  if may_run_ahead(run, robots) then
    -- after an error all breed it once more: a second one ends the run, with all before it written
    local ok, bred = failure.attempt(breed_ahead, run, robots)
    local upcoming = ok and bred or nil
    robots.successor = upcoming or false
    run.behind[#run.behind + 1] = robots
    -- a GPU steps the last one while all catch up
    local is_cpu = run.world.device.kind == "cpu"
    local goes_on = upcoming and (is_cpu or may_run_ahead(run, upcoming))
    return goes_on and upcoming or catch_up(run)
  end
  if run.behind[1] then
    local bred = catch_up(run)
    if bred ~= robots then return bred end
  end
  return conclude(run, robots)
end

--- Makes one repetition of an experiment, ready for `:generations()`.
---@param experiment limax.experiment
---@param options? limax.run.options
---@return limax.run
function evolve.start(experiment, options)
  if not experiments.is(experiment) then
    failure.raise(2,
      "limax.start: expected an experiment: limax.start(limax.experiment { ... })", 2)
  end
  experiments.check_unchanged(experiment)
  experiments.idle = false
  local checked, message = runs.check(options)
  if not checked then failure.raise(2, message, 2) end
  if exchange.count > 1 and not checked.divided then
    failure.raise(2, "limax.start: a loop of your own runs in one process, not in several ranks of"
      .. " mpirun: only an experiment that a script returns does, by limax run", 2)
  end
  local run = runs.new(experiment, checked)
  if experiment.supervisor.start and exchange.is_first then
    run.session = experiment.supervisor.start(run)
  end
  return run
end

--- Iterates over the generations: `for population in run:generations() do ... end`. What the body
--- of the loop leaves out (simulate, score, breed) is done by the experiment's own rules.
---@return fun(): limax.population.scored|nil
function Run:generations()
  return function()
    if self.ended then return nil end
    if self.population then
      self.population = evolve.next(self, self.population)
    else
      self.population = evolve.first(self)
    end
    if not self.population then self:close() end
    return self.population
  end
end

--- Runs all generations that are left. Returns the history.
---@return limax.generation[]
function Run:finish()
  self.ahead = generations.begin
  for _ in self:generations() do end
  return self.history
end

return evolve
