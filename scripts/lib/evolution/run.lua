--- run.lua: one repetition of an experiment: what it needs before its first generation (device,
--- folder, world, limits), and the warnings that a user should read before hours of computing.

local archived = require "limax.evolution.archived"
local budget = require "limax.experiment.budget"
local encodings = require "limax.encoding"
local engine = require "limax.engine"
local exchange = require "limax.base.exchange"
local fault = require "limax.engine.fault"
local failure = require "limax.base.failure"
local full_body = require "limax.robot.full_body"
local ledger = require "limax.supervise.ledger"
local materials = require "limax.evolution.materials"
local output = require "limax.base.output"
local record = require "limax.evolution.record"
local resume = require "limax.run.resume"
local run_folder = require "limax.run.run_folder"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"
local strict = require "limax.engine.strict"
local state = require "limax.run.state"
local together = require "limax.evolution.together"

---@class limax.run one repetition of an experiment
---@field experiment limax.experiment that it is a repetition of
---@field config table the experiment's resolved configuration
---@field repetition integer 1, 2, ...
---@field history limax.generation[] one entry per scored generation
---@field population limax.population.scored|nil the newest generation
-- `upcoming` is the generation after it: nil before the newest is bred, false where there is none.
local Run = strict.methods "run"
Run.__index = Run

local run = { methods = Run }

---@class limax.run.options
---@field repetition? integer 1 if left out
---@field device? string|table "auto", "cpu", "cuda", or a device of the engine
---@field threads? integer
---@field out? string a new folder that keeps the generations
---@field resume? boolean continue what `out` holds, if it is there: the loop's first population
--- is then the last complete one, with its scores
---@field changed? boolean with `resume`: continue although script or configuration differ
---@field from? integer with `resume`: go on from this generation; later ones are removed
---@field folder? table the same, made already (run_folder.lua)
---@field say? fun(text: string, key: string) receives warnings; standard error if left out
---@field on_progress? fun(progress: table) while robots are simulated
---@field wait? fun(simulations: limax.simulation[]) advances them to their ends (together.lua)
---@field on_generation? fun(entry: limax.generation, seconds: table) after each generation
---@field live_prompts? boolean read a model's prompts again before each generation

local start_fields = schema.fields { repetition = schema.any, device = schema.any,
  threads = schema.any, out = schema.any, resume = schema.boolean(false),
  changed = schema.boolean(false), from = schema.whole(0, 2 ^ 53), folder = schema.any,
  say = schema.any, on_progress = schema.any, wait = schema.any, on_generation = schema.any,
  live_prompts = schema.any }

--- Checks the options of limax.start.
---@param options? limax.run.options
---@return limax.run.options|nil
---@return string|nil message
function run.check(options)
  local checked, message = start_fields(options, "start")
  if checked and checked.resume and not checked.out then
    return nil, "start.resume: which run is to be continued? name its folder: out = DIR"
  end
  return checked, message
end

-- The folder that the options name, and what resume found in it.
local function open_folder(experiment, options, repetition, device)
  local folder, comparison
  if options.folder or not options.out then return options.folder end
  if options.resume and run_folder.is_run(options.out) then
    folder, comparison = resume.open(options.out, experiment, repetition, options.changed,
      options.from)
  else
    folder = run_folder.create(options.out, experiment, { repetition = repetition,
      own_loop = true })
  end
  folder:write_environment(device)
  return folder, comparison
end

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
local function least_bound(world, common)
  local least, name = math.huge, ""
  for k, trial in ipairs(world.first_trials) do
    local ok, bound, material = failure.attempt(full_body.bound, world.config.lattice,
      trial.engine_materials or common, trial.engine_scene, trial.options, world.device)
    if not ok and world.config.trials and fault.is(bound) and bound.text:find "record%." then
      failure.raise(2, ("trials[%d]: %s; a trial's own record = { contact = 0 } leaves out a trace")
        :format(k, bound.text))
    elseif not ok then
      failure.raise_again(bound, material)
    end
    if bound < least then least, name = bound, material end
  end
  return least, name
end

--- Makes a run, and returns what resume found in its folder.
---@param experiment limax.experiment
---@param options limax.run.options
---@return limax.run
---@return limax.resume.comparison|nil
function run.new(experiment, options)
  local config, device = experiment.config, options.device or "auto"
  local repetition = options.repetition or 1
  if type(device) == "string" then device = engine.device(device, { threads = options.threads }) end
  local folder, comparison = open_folder(experiment, options, repetition, device)
  local first = engine.materials(config.materials)
  ---@type limax.world
  local world = { config = config, scene = engine.scene(config.scene),
    options = settings.engine_options(config.simulation, config.record), device = device,
    is_divided = exchange.count > 1,
    trials = experiment.trials:of(repetition), advance = options.wait or together.finish,
    fitness = experiment.fitness, first_materials = first,
    measured = experiment.measured, archive = experiment.archive
      and archived.new(experiment.archive, config.seed, repetition),
    state = experiment.state and state.decode(state.encode(experiment.state())),
    on_progress = options.on_progress, say = once(options.say or print_warning) }
  -- refuses a lattice that this machine cannot hold before anything large is made
  engine.population({ lattice = config.lattice, count = config.population }):free()
  local encoding = encodings.of_engine(experiment.encoding, config.genome,
    { lattice = config.lattice, materials = first.count, seed = config.seed,
      repetition = repetition })
  world.first_trials = world.trials(0)
  world.first_step, world.first_step_material = least_bound(world, first)
  local self = setmetatable({ experiment = experiment, config = config, repetition = repetition,
    world = world, device = device, encoding = encoding, first_materials = first,
    first_fields = materials.fields(first), first_step = world.first_step,
    limits = ledger.limits(config.population, config.supervision.ranges, config.supervision),
    history = {}, packed = {}, evaluations = 0, folder = folder, owns_folder = options.out ~= nil,
    on_generation = options.on_generation, live_prompts = options.live_prompts }, Run)
  self.entries = record.entries(self)
  return self, comparison
end

--- Shows the notes of an experiment, once however many repetitions it has.
---@param experiment limax.experiment
---@param world limax.world
function run.warn(experiment, world)
  if experiment.warned then return end
  experiment.warned = true
  for _, note in ipairs(experiment.notes) do world.say(note) end
  local simulation = world.config.simulation
  local step = simulation.time_step
  if type(step) == "number" and step > world.first_step then
    local harm = simulation.integrator == "xpbd" and "its springs get soft"
      or "stiff bodies may diverge"
    world.say(("simulation.time_step = %.6g s is above the limit of %.6g s for a full body of %s:"
      .. " %s"):format(step, world.first_step, world.first_step_material, harm))
  end
end

--- Reports that the folder of an own loop has all generations already.
---@param restored limax.run
function run.say_complete(restored)
  local config, last = restored.config, restored.history[#restored.history]
  if not last or budget.allows_another(config, last.generation + 1, restored.evaluations) then
    return
  end
  local limit = budget.limit(config, last.generation + 1)
  restored:say(("%s is complete: the loop visits only its last generation again; to extend the"
    .. " run, set %s = %d in the experiment and changed = true in limax.start"):format(
    restored.folder.path, limit, 2 * config[limit]))
end

--- An empty population of the engine.
---@param count? integer that of one generation if left out
---@return limax.population
function Run:new_robots(count)
  return engine.population { lattice = self.config.lattice,
    count = count or self.config.population, encoding = self.encoding }
end

--- What the genes of a generation are made and read by.
---@param fields { materials: limax.materials, parameters: table<string, number> }
---@return limax.genes.rules
function Run:rules_of_genes(fields)
  return { encoding = self.experiment.encoding, variation = self.experiment.variation,
    lattice = self.config.lattice, materials = fields.materials, parameters = fields.parameters,
    state = self.world.state, seed = self.config.seed, repetition = self.repetition,
    require_muscle = self.config.genome.require_muscle, device = self.device,
    empty = function() return self:new_robots() end }
end

--- The first materials with other values of the fields that a supervisor may change.
---@param fields limax.material_fields
---@return limax.materials
function Run:materials_with(fields) return materials.with(self.first_materials, fields) end

--- The limit of the time step for a full body of these materials, s.
---@param common limax.materials
---@return number
function Run:bound(common) return (least_bound(self.world, common)) end

Run.restore = record.read

--- Shows a warning, once in a run.
---@param text string
---@param key? string what makes two texts the same; the whole text if left out
function Run:say(text, key) self.world.say(text, key) end

--- Marks a run that made its own folder as done, and unlocks the folder.
function Run:close()
  if not self.owns_folder then return end
  self.folder:status "done"
  self.folder:close()
  self.owns_folder = false
end

return run
