--- world.lua: what never changes in a repetition: its experiment, device, encoding, trials and
--- first materials, and what follows from them.

local encodings = require "limax.encoding"
local division = require "limax.evolution.division"
local engine = require "limax.engine"
local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local full_body = require "limax.robot.full_body"
local materials = require "limax.evolution.materials"
local output = require "limax.base.output"
local proposals = require "limax.supervise.proposals"
local rows = require "limax.robot.rows"
local selection = require "limax.selection"
local settings = require "limax.settings.settings"
local state = require "limax.run.state"

---@class limax.world
---@field experiment limax.experiment
---@field config table the experiment's resolved configuration
---@field repetition integer 1, 2, ...
---@field device limax.device
---@field encoding limax.encoding of the engine
---@field scene limax.scene
---@field options table of the engine's simulations
---@field trials fun(generation: integer): limax.trial[] at least one (experiment/trials.lua)
---@field fitness limax.fitness the experiment's
---@field measured limax.measured|nil besides the fitness
---@field archive limax.archive.definition|nil
---@field is_divided boolean do ranks divide the robots among themselves (division.lua)?
---@field shows_all boolean may a function of this rank look at robots of other ranks, beside those
--- that are lent to it? Otherwise a generation has no objects of these.
---@field runs_ahead boolean may islands of this rank go on without those of others until robots are
--- exchanged? The bytes are the same
---@field place fun(robots: limax.population.scored, i: integer): limax.population, integer where
--- body and genome of a robot are
---@field diversity fun(robots: limax.population.scored, set: integer[]): limax.diversity|nil
---@field first_materials limax.materials those of generation 0
---@field first_fields limax.material_fields their changeable fields
---@field first_step number s, limit of the time step for a full body of these
---@field first_step_material string that sets it
---@field limits limax.limit[] of a supervisor's proposals
---@field on_progress? fun(progress: table) while robots are simulated
---@field make_room? fun() gives memory of other repetitions back
---@field say fun(text: string, key?: string) shows a warning once per key
local World = {}
World.__index = World

local world = {}

-- A function that shows each text once, or each key.
local function once(show)
  local shown = {}
  return function(text, key)
    key = key or text
    if not shown[key] then show(text, key) end
    shown[key] = true
  end
end

local function print_warning(text) output.warn(text, "\n") end

-- The least limit of the time step over the trials of the first generation, s, and the material
-- that sets it.
local function least_bound(self, common)
  local least, name = math.huge, ""
  for k, trial in ipairs(self.trials(0)) do
    local ok, bound, material = failure.attempt(full_body.bound, self.config.lattice,
      trial.engine_materials or common, trial.engine_scene, trial.options, self.device)
    if not ok and self.config.trials and not failure.of_machine(bound) then
      failure.raise(2, ("trials[%d]: %s"):format(k, bound.text or bound))
    elseif not ok then
      failure.raise_again(bound, material)
    end
    if bound < least then least, name = bound, material end
  end
  return least, name
end

-- May a function of this rank look at robots of others? Most schemes of the library need only their
-- ranking; a mutation or a crossover of a script has `robots.rows`.
local function shows_all(experiment)
  local named = experiment.config.selection
  local selects = selection.entries[type(named) == "table" and named.name or named] or {}
  local variation = experiment.variation
  local by_rank = experiment.survival.by_rank and selects.by_rank
    and not (variation.mutation.own or variation.crossover.own)
  return not by_rank or experiment.archive ~= nil
    or exchange.is_first and experiment.supervisor.reads_robots or false
end

-- May islands run ahead? Each rank has as many, and no part of the experiment reads robots of
-- others, or what became of them.
local function runs_ahead(experiment)
  local options = experiment.config.islands
  return exchange.count > 1 and options ~= nil and options.count % exchange.count == 0
    and not shows_all(experiment) and not experiment.state
    and experiment.supervisor.by_generation or false
end

--- Makes the world of a repetition.
function world.new(experiment, options)
  local config, device = experiment.config, options.device or "auto"
  local repetition = options.repetition or 1
  if type(device) == "string" then device = engine.device(device, { threads = options.threads }) end
  local first = engine.materials(config.materials)
  local self = setmetatable({ experiment = experiment, config = config, repetition = repetition,
    device = device, scene = engine.scene(config.scene),
    options = settings.engine_options(config.simulation, config.record),
    trials = experiment.trials:of(repetition), fitness = experiment.fitness,
    measured = experiment.measured, archive = experiment.archive,
    is_divided = exchange.count > 1, shows_all = exchange.count == 1 or shows_all(experiment),
    runs_ahead = runs_ahead(experiment),
    place = division.place, diversity = division.diversity_of,
    first_materials = first,
    first_fields = materials.fields(first),
    limits = proposals.limits(config.population, config.supervision.ranges, config.supervision,
      config.breeding),
    on_progress = options.on_progress, say = once(options.say or print_warning) }, World)
  division.check(config.population)
  local share = division.share(config.population, 0)
  -- refuses a lattice that this machine cannot hold before anything large is made
  engine.population({ lattice = config.lattice, count = share.count }):free()
  self.encoding = encodings.of_engine(experiment.encoding, config.genome,
    { lattice = config.lattice, materials = first.count, seed = config.seed,
      repetition = repetition })
  -- and genomes for which there is no memory, before a run folder is made
  self:empty_share(share):free()
  self.first_step, self.first_step_material = least_bound(self, first)
  return self
end

--- The state that the experiment's functions begin with; nil without one.
function World:first_state()
  local make = self.experiment.state
  return make and state.decode(state.encode(make()))
end

--- An empty population of the engine.
---@param count? integer that of one generation if left out
function World:empty(count)
  return engine.population { lattice = self.config.lattice,
    count = count or self.config.population, encoding = self.encoding }
end

--- An empty population for this rank's share of a generation.
---@param share limax.share
function World:empty_share(share)
  return engine.population { lattice = self.config.lattice, count = share.count,
    before = share.before, encoding = self.encoding }
end

--- Robots without values, for a generation.
---@param share limax.share
---@param before? limax.rows of the generation before: what its fitness returned is expected again
function World:rows(generation, share, before)
  local config, measured = self.config, self.measured or {}
  local facts = before and before.facts or {}
  local experiment = self.experiment
  return rows.new({ letters = rows.letters(config.lattice),
    trials = config.trials and #self.trials(generation) or nil,
    descriptors = measured.descriptors and #measured.descriptors or nil,
    objectives = measured.objectives and #measured.objectives or nil,
    islands = config.islands ~= nil, ages = experiment.survival.ages,
    self_adaptive = experiment.variation.mutation.adapts, archive = self.archive ~= nil,
    novelty = self.archive and self.archive.appraise ~= nil, cases = facts.cases,
    measures = facts.measures }, config.population, self.is_divided and share or nil,
    generation > 0 and not self.shows_all)
end

--- The rules by which the genes of a generation are made and read.
---@param fields { materials: limax.materials, parameters: table<string, number>,
--- state: table|nil, share: limax.share }
function World:rules(fields)
  return { encoding = self.experiment.encoding, variation = self.experiment.variation,
    lattice = self.config.lattice, materials = fields.materials, parameters = fields.parameters,
    state = rawget(fields, "state"), seed = self.config.seed, repetition = self.repetition,
    require_muscle = self.config.genome.require_muscle, device = self.device,
    number = self.is_divided and function(k) return fields.share:number(k) end or nil,
    empty = function() return self:empty_share(fields.share) end, say = self.say }
end

--- The first materials with other values of the fields that a supervisor may change.
function World:materials_with(fields) return materials.with(self.first_materials, fields) end

--- The names of the materials, in the order of a body's counts.
function World:material_names()
  local names = {}
  for i = 1, self.first_materials.count do names[i] = self.first_materials:get(i).name end
  return names
end

--- B, without which genomes of the encoding "fourier" cannot be read by other programs; nil of
--- another one.
---@return number[][]|nil [feature][axis]
function World:matrix()
  return self.encoding.network == "fourier" and self.encoding:matrix():table() or nil
end

--- The limit of the time step for a full body of these materials, s.
function World:bound(common) return (least_bound(self, common)) end

return world
