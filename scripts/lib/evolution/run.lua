--- run.lua: one repetition of an experiment: its world, its folder, its history, and the warnings
--- that a user should read before hours of computing.

local budget = require "limax.experiment.budget"
local exchange = require "limax.base.exchange"
local own_variables = require "limax.experiment.own_variables"
local record = require "limax.evolution.record"
local resume = require "limax.run.resume"
local run_folder = require "limax.run.folder"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"
local strict = require "limax.engine.strict"
local supervision = require "limax.supervise.supervision"
local worlds = require "limax.evolution.world"

---@class limax.run one repetition of an experiment
---@field experiment limax.experiment that it is a repetition of
---@field config table the experiment's resolved configuration
---@field repetition integer 1, 2, ...
---@field world limax.world what never changes in it
---@field folder limax.run_folder|nil that keeps its generations
---@field evaluations integer of the recorded generations
---@field ahead fun(robots: limax.population.scored)|nil begins to step a generation on a GPU
--- before the loop asks for it
---@field ended boolean|nil has it no further generation?
---@field history limax.generation[] one entry per scored generation
---@field population limax.population.scored|nil the newest generation
local Run = strict.methods "run"
Run.__index = Run

-- Only the loop reads `behind`, the generations from which this rank bred without the others and
-- which are still to be recorded, `most_ahead`, how many these may be, and `uneven`, the last
-- generation whose islands had different numbers of elites.

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
---@field folder? limax.run_folder the same, made already
---@field say? fun(text: string, key: string) receives warnings; standard error if left out
---@field on_progress? fun(progress: table) while robots are simulated
---@field divided? boolean may ranks of mpirun divide the robots?
---@field on_generation? fun(entry: limax.generation, seconds: table) after each generation
---@field live_prompts? boolean read a model's prompts again before each generation

local start_fields = schema.fields { repetition = schema.any, device = schema.any,
  threads = schema.any, out = schema.any, resume = schema.boolean(false),
  changed = schema.boolean(false), from = schema.whole(0, 2 ^ 53), folder = schema.any,
  say = schema.any, on_progress = schema.any, on_generation = schema.any,
  divided = schema.boolean(false), live_prompts = schema.any }

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
  folder:start(device)
  return folder, comparison
end

-- Shows the notes of an experiment, once however many repetitions it has.
local function warn(world)
  local experiment = world.experiment
  if experiment.warned then return end
  experiment.warned = true
  for _, note in ipairs(experiment.notes) do world.say(note) end
  local simulation = world.config.simulation
  local step = simulation.time_step
  if type(step) == "number" and step > world.first_step then
    world.say(("simulation.time_step = %.6g s is above the limit of %.6g s for a full body of %s:"
      .. " stiff bodies may diverge"):format(step, world.first_step, world.first_step_material))
  end
end

-- Reports that the folder of an own loop has all generations already.
local function say_complete(world, folder)
  local config, generations = world.config, folder:last(world.repetition) + 1
  if generations == 0 or budget.allows_another(config, generations,
    folder:evaluations(world.repetition)) then
    return
  end
  local limit = budget.limit(config, generations)
  world.say(("%s is complete: the loop visits only its last generation again; to extend the"
    .. " run, set %s = %d in the experiment and changed = true in limax.start"):format(
    folder.path, limit, 2 * config[limit]))
end

--- Makes a run.
---@return limax.run
function run.new(experiment, options)
  local world = worlds.new(experiment, options)
  local folder, comparison = open_folder(experiment, options, world.repetition, world.device)
  local self = setmetatable({ experiment = experiment, config = world.config,
    repetition = world.repetition, world = world, history = {}, packed = {}, behind = {},
    most_ahead = 0, uneven = -math.huge, evaluations = 0, folder = folder,
    owns_folder = options.out ~= nil, on_generation = options.on_generation,
    live_prompts = options.live_prompts,
    variables = experiment.warned and {} or own_variables.list(experiment.spec) }, Run)
  self.entries = record.entries(self)
  warn(world)
  if comparison then say_complete(world, folder) end
  return self
end

--- Shows a warning, once in a run.
---@param text string
---@param key? string what makes two texts the same; the whole text if left out
function Run:say(text, key) self.world.say(text, key) end

--- Warns after the first generation if functions of the experiment keep results in variables.
function Run:check_variables()
  local experiment = self.experiment
  local note = own_variables.note(self.variables,
    experiment.origin and source.folder_of(experiment.origin))
  self.variables = {}
  if note then self:say(note, "variables") end
end

--- Ends a run that has no further generation. One that made its own folder is done there.
function Run:close()
  if self.ended then return end
  self.ended = true
  local text = exchange.is_first
    and supervision.end_text(self.experiment.supervisor, self.history)
  if text then self:say(("repetition %d: %s"):format(self.repetition, text)) end
  if not self.owns_folder then return end
  self.folder:finish "done"
  self.folder:close()
end

return run
