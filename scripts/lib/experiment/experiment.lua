--- experiment.lua: `limax.experiment { ... }` checks a table against the fields of an experiment,
--- fills in the defaults and resolves names (materials, tier, fitness, selection, supervisor). The
--- result holds a plain `config` that can be written as JSON.

local choice = require "limax.base.choice"
local control_genes = require "limax.settings.control_genes"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local island_rules = require "limax.settings.island_rules"
local named_control = require "limax.settings.named_control"
local named_parts = require "limax.experiment.named_parts"
local overrides = require "limax.experiment.overrides"
local plausible = require "limax.settings.plausible"
local scenes = require "limax.scenes"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"
local prompt = require "limax.supervise.llm.prompt"
local proposals = require "limax.supervise.proposals"
local robot_file = require "limax.robot.robot_file"
local source = require "limax.base.source"
local strict = require "limax.engine.strict"
local trials = require "limax.experiment.trials"

---@class limax.experiment
---@field config table the resolved configuration, plain values only (schema limax.config/1)
---@field fitness { name: string, call: function, record: table } as resolved
---@field selection fun(population: table, random: table): integer, integer as resolved
---@field survival limax.survival.scheme as resolved
---@field encoding limax.encoding.definition as resolved
---@field variation { mutation: limax.variation.step, crossover: limax.variation.step } as resolved
---@field archive limax.archive.definition|nil as resolved
---@field measured limax.measured|nil what the archive and the survival need of each robot
---@field state nil|fun(): table a script's own state at the start of a repetition
---@field trials limax.trials in which each robot is simulated
---@field supervisor { name: string, call: function } as resolved
---@field notes string[] for the user: what was changed, and what is probably unintended
---@field scripts string[] absolute paths of its script files
---@field origin string|nil absolute path of the file that made it
---@field warned boolean|nil were its notes shown?
---@field breaker { failures: integer }|nil failed generations of a language model, in a row
local Experiment = strict.methods "experiment"

-- The fields of an experiment are in a table of their own, so that every assignment is seen.
local FIELDS = {}

-- Fields that an experiment may lack; the last two are set while it runs.
local MAY_LACK = { origin = true, state = true, archive = true, measured = true, warned = true,
  breaker = true }

function Experiment.__index(self, key)
  local fields = rawget(self, FIELDS)
  local value = fields[key]
  if value ~= nil or MAY_LACK[key] then return value end
  return rawget(Experiment, key)
    or strict.unknown("an experiment", key, fields, MAY_LACK, Experiment)
end

local read_only =
  strict.read_only("an experiment", "set its fields inside limax.experiment { ... }")

function Experiment.__newindex(self, key, value)
  if not MAY_LACK[key] then read_only(self, key) end
  rawget(self, FIELDS)[key] = value
end

Experiment.methods, Experiment.kind_name = Experiment, "experiment"

local experiment = {}

--- Was an experiment made, and none started? Then a script probably forgot to return it.
experiment.idle = false

-- ---- rules --------------------------------------------------------------------------------------

local fields = defaults.fields

-- The rules of a group of numbers and switches.
local function rules_of(group)
  local rules = {}
  for name, field in pairs(group) do
    local switch = type(field.value) == "boolean"
    rules[name] = switch and schema.boolean(field.value) or schema.number(field)
  end
  return rules
end

local function with(rules, more)
  for name, rule in pairs(more) do rules[name] = rule end
  return schema.fields(rules)
end

-- of fields that are checked later, by the part of the library that they name
local anything = schema.any

-- An experiment may narrow the ranges of proposals: `ranges = { mutation_rate = { 0.01, 0.2 } }`.
local function ranges(value, path)
  if value == nil then return nil end
  local rules, limits = {}, {}
  for _, limit in ipairs(proposals.limits(fields.experiment.population.maximum)) do
    limits[#limits + 1] = limit
    rules[limit.field] = schema.list(schema.number { unit = "" },
      { count = 2, expected = "a list { least, most }" })
  end
  local result, message = schema.fields(rules)(value, path)
  if not result then return nil, message end
  for _, limit in ipairs(limits) do
    local range = result[limit.field]
    if range and (range[1] < limit.minimum or range[2] > limit.maximum or range[1] > range[2]) then
      return nil, ("%s.%s: { %.6g, %.6g } does not lie within %.6g to %.6g; a range may be"
        .. " narrowed, never widened"):format(path, limit.field, range[1], range[2], limit.minimum,
        limit.maximum)
    end
  end
  return result
end

-- Robots that a repetition may simulate. No default: generations are the limit.
local evaluations = schema.number { unit = "robots", minimum = 2, maximum = 1e9, integer = true }

local genome_fields = { encoding = anything, mutation = anything, crossover = anything,
  body = schema.path }
for name, rule in pairs(require("limax.engine.encoding").genome_rules) do
  genome_fields[name] = rule
end

-- Ends the message about a name that is not a field of an experiment: the place where it belongs.
local function place_of(name)
  for _, group in ipairs { "breeding", "genome", "simulation", "supervision", "islands" } do
    if fields[group] and fields[group][name] then
      return ("; it belongs in %s = { %s = ... }"):format(group, name)
    end
  end
  for _, effect in ipairs(engine.effects()) do
    if effect.name == name then return ("; it belongs in scene = { %s = ... }"):format(name) end
  end
  if genome_fields[name] then return ("; it belongs in genome = { %s = ... }"):format(name) end
  if name == "device" or name == "threads" then
    return ("; it is an option of limax run: --%s"):format(name)
  end
end

local texts = schema.list(schema.required(schema.string), { expected = "a list of texts" })

local five = fields.experiment.lattice.value
local rules = schema.fields({
  name = schema.text("[%w][%w_%-%.]*", "a name of letters, digits and _ - ."),
  lattice = settings.lattice { five, five, five },
  materials = anything,
  seed = function(value, path)
    return schema.seed(value == nil and fields.experiment.seed.value or value, path)
  end,
  genome = with(rules_of(fields.genome), genome_fields),
  scene = anything,
  simulation = settings.simulation,
  record = settings.record_of_experiment,
  population = schema.number(fields.experiment.population),
  generations = schema.number(fields.experiment.generations),
  evaluations = evaluations,
  repetitions = schema.number(fields.experiment.repetitions),
  islands = island_rules.check,
  breeding = with(rules_of(fields.breeding), {}),
  fitness = anything,
  selection = anything,
  survival = anything,
  archive = anything,
  state = anything,
  trials = anything,
  supervisor = anything,
  supervision = with(rules_of(fields.supervision), { ranges = ranges }),
  not_in_paper = texts,
}, place_of)

-- ---- resolution ---------------------------------------------------------------------------------

-- Materials and scene as the engine completes them, as plain tables.
local function plain(object)
  local plain_table = object:table()
  object:free()
  return plain_table
end
local function plain_materials(named) return plain(engine.materials(named)) end

local function plain_scene(effects)
  if type(effects) == "function" or type(effects) == "string" then
    local name = type(effects) == "string" and rawget(scenes, effects) and effects or "land"
    failure.raise(2, ("scene: expected a table, got %s; a ready scene is called: scene ="
      .. " limax.scenes.%s()"):format(schema.show(effects), name))
  end
  return plain(engine.scene(named_control.resolve(effects)))
end

-- The table of the materials that an experiment names; a file may lie beside it.
local function read_materials(named, origin)
  if type(named) == "string" and named:match "%.json$" then
    local path, missing = source.beside(named, origin and source.folder_of(origin))
    if missing then return nil, "materials: " .. missing end
    named = path
  end
  return named_parts.resolved("materials", plain_materials, named or defaults.materials)
end

-- Functions that read the materials and scenes of a script.
local function readers(origin)
  return {
    materials = function(named) return read_materials(named, origin) end,
    scene = function(effects) return named_parts.resolved("scene", plain_scene, effects) end,
  }
end

local function default_name(spec, origin)
  if not origin then return type(spec.fitness) == "string" and spec.fitness or "experiment" end
  local name = source.name_of(origin):gsub("%.lua$", ""):gsub("[^%w_%-%.]", "_")
  return (name:gsub("^[^%w]", "x"))
end

-- Files that an experiment names and that take effect as its script does: the prompts of a language
-- model, the parser of its answers, and the body of its robots.
local function named_scripts(spec, base)
  local options, list = type(spec.supervisor) == "table" and spec.supervisor or {}, {}
  for name, place in pairs { parse = source.beside, prompt = prompt.path, again = prompt.path } do
    local path = type(options[name]) == "string" and place(options[name], base)
    if path then list[#list + 1] = host.file.absolute(path) end
  end
  local body = spec.genome and spec.genome.body
  if body then list[#list + 1] = host.file.absolute((source.beside(body, base))) end
  return list
end

local function add_notes(self, notes)
  for _, note in ipairs(notes) do
    if not choice.contains(self.notes, note) then table.insert(self.notes, note) end
  end
end

-- The steps of `resolve`. Each returns a message if something is wrong.

local function check_fields(self)
  local spec = self.spec
  if type(spec) ~= "table" then
    return "limax.experiment: expected a table, got " .. schema.show(spec)
  end
  -- { "distance" } is "distance", also in config.json
  for _, name in ipairs { "fitness", "selection", "survival", "archive", "supervisor" } do
    local named = spec[name]
    if type(named) == "table" and type(named[1]) == "string" and next(named, 1) == nil
      and next(named) == 1 then
      spec[name] = named[1]
    end
  end
  local config, message = rules(spec, "")
  if not config then return message end
  if spec.fitness == nil then
    return 'fitness: expected a name (such as "walk"), a table or a function; it is the one field'
      .. " without a default"
  end
  if config.evaluations and config.evaluations < config.population then
    return ("evaluations: expected at least one population, %d robots, got %d"):format(
      config.population, config.evaluations)
  end
  self.config = config
end

local function read_world(self)
  local spec, message = self.spec
  self.config.materials, message = self.read.materials(spec.materials)
  if message then return message end
  self.config.scene, message =
    self.read.scene(spec.scene == nil and defaults.scene or spec.scene)
  return message
end

-- Reads the body of `genome.body`, whose lattice and edge hold where the script names none.
local function read_body(self)
  local config, spec = self.config, self.spec
  local named = config.genome.body
  if named == nil then return nil end
  if spec.genome.encoding ~= nil then
    return "genome.body: all robots have this body: remove genome.encoding"
  end
  local path, message = source.beside(named, self.base)
  if message and host.file.exists(path) == "folder" then
    local champions = path .. "/r01/champions"
    local names = host.file.list(champions) or {}
    table.sort(names)
    return ("genome.body: %s is a folder; name a robot file, such as %s/%s"):format(path, champions,
      names[#names] or "g0000.json")
  end
  if message then return "genome.body: " .. message end
  self.body, message = named_parts.resolved("genome.body", function(file)
    return (robot_file.read(file))
  end, path)
  if message then return message end
  local own = spec.lattice == nil and self.body.lattice or config.lattice
  for axis = 1, 3 do
    if own[axis] ~= self.body.lattice[axis] then
      return ("lattice: expected that of genome.body, { %d, %d, %d }, or none"):format(
        unpack(self.body.lattice))
    end
  end
  config.lattice = own
  if not (spec.simulation and spec.simulation.edge) then
    config.simulation.edge = self.body.edge
  end
end

local function find_parts(self)
  local parts, message = named_parts.of(self.spec)
  self.parts = parts
  return message or island_rules.problem(self.config, parts)
end

local SUMMARISED = { "center_of_mass", "contact", "energy", "strain" }

-- Warns of a rate that the script sets too low for the measures of a trace.
local function check_rate(self, kind, rate, enough)
  add_notes(self, { plausible.sparse(kind, rate, self.config.scene, enough) })
end

-- Records what fitness, archive and survival of the library read, unless the script sets a rate.
local function record_for_measures(self)
  local record, parts = self.config.record, self.parts
  local measured, readers_of = parts.measured or {}, { parts.fitness }
  for _, list in ipairs { measured.descriptors or {}, measured.objectives or {} } do
    for _, measure in ipairs(list) do readers_of[#readers_of + 1] = measure end
  end
  for _, reader in ipairs(readers_of) do
    for kind, rate in pairs(reader.record) do
      check_rate(self, kind, record[kind], rate)
      if record[kind] == 0 then record[kind] = rate end
    end
  end
  if parts.fitness.name ~= "function" or not self.spec.record then return end
  for _, kind in ipairs(SUMMARISED) do check_rate(self, kind, record[kind]) end
end

local function complete_record(self)
  local config, spec = self.config, self.spec
  local record, kept = config.record, config.record.population
  record.population, config.record_population = nil, kept ~= "all" and kept or nil
  if kept == "best" and spec.archive ~= nil then
    return 'record.population: "best" keeps no genomes of the robots in an archive; expected "all"'
  end
  local sets_no_rate = spec.record == nil or kept and next(spec.record, next(spec.record)) == nil
  for kind, rate in pairs(sets_no_rate and defaults.record or {}) do record[kind] = rate end
  record_for_measures(self)
  add_notes(self, settings.finish(config.simulation, record))
end

local function complete_trials(self)
  local message
  self.trials, message = trials.get(self.spec.trials, self.config, self.read, self.base)
  if message then return message end
  add_notes(self, self.trials.notes)
end

local function complete_genome(self)
  local message
  local count = control_genes.of_trials(self.trials.list)
  self.encoding, message, self.variation =
    named_parts.genome(self.config, self.spec, self.base, self.body, count)
  if message then return message end
  add_notes(self, named_parts.unused(self.spec, self.parts, self.variation, count))
end

-- Describes what the script named, for config.json.
local function describe_parts(self)
  local config, spec, parts, base = self.config, self.spec, self.parts, self.base
  config.schema = "limax.config/1"
  config.name = config.name or default_name(spec, self.origin)
  config.fitness = source.describe(spec.fitness, base)
  config.selection = source.describe(parts.selection_named, base)
  config.supervisor = source.describe(spec.supervisor or defaults.supervisor, base)
  config.survival = spec.survival ~= defaults.survival and source.describe(spec.survival, base)
    or nil
  config.archive = source.describe(spec.archive, base)
  config.state = spec.state and source.describe(spec.state, base)
  config.trials = self.trials.config
end

-- What a fitness by name reads of a scene.
local needed_effect = { carry = "block", target = "target" }

local function check_together(self)
  local config, parts = self.config, self.parts
  add_notes(self, plausible.notes_of_whole(config, parts))
  add_notes(self, { island_rules.note(config) })
  local note = parts.supervisor.note and parts.supervisor.note(config)
  add_notes(self, { note })
  for field, range in pairs(config.supervision.ranges or {}) do
    local value = config.breeding[field]
    if value and (value < range[1] or value > range[2]) then
      add_notes(self, { ("breeding.%s is %.6g, and supervision.ranges.%s is { %.6g, %.6g }: no"
        .. " supervisor can propose the value with which the run begins"):format(field, value,
        field, range[1], range[2]) })
    end
  end
  if config.islands and parts.survival.name == "map_elites" then
    parts.archive.islands = config.islands.count
  end
  local needed = needed_effect[parts.fitness.name]
  for k, trial in ipairs(needed and self.trials.list or {}) do
    if not trial.scene[needed] then
      return ("%sscene.%s: the fitness %q needs one; limax.scenes.land { %s = true } has one")
        :format(config.trials and ("trials[%d]."):format(k) or "", needed, parts.fitness.name,
          needed)
    end
  end
  local unfit = parts.supervisor.unfit and parts.supervisor.unfit(config)
  return unfit and ("supervisor %q: %s"):format(parts.supervisor.name, unfit)
end

-- Makes an experiment of a script's table; `nil, message` for the first error.
local function resolve(spec, origin)
  local self = { spec = spec, origin = origin, notes = {}, read = readers(origin),
    base = origin and source.folder_of(origin) }
  for _, step in ipairs { check_fields, read_world, read_body, find_parts, complete_record,
    complete_trials, complete_genome, describe_parts, check_together } do
    local message = step(self)
    if message then return nil, message end
  end
  local parts = self.parts
  return setmetatable({ [FIELDS] = { config = self.config,
    config_text = host.json.encode(self.config), spec = spec, origin = origin,
    notes = self.notes, fitness = parts.fitness, selection = parts.selection,
    supervisor = parts.supervisor, survival = parts.survival, archive = parts.archive,
    measured = parts.measured, state = parts.state, encoding = self.encoding,
    variation = self.variation, trials = self.trials,
    scripts = source.scripts(origin, spec, named_scripts(spec, self.base)) } }, Experiment)
end

-- ---- the module ---------------------------------------------------------------------------------

-- Raises an error at the caller's line.
local function refuse(message, file, line)
  local place = file and (line and ("%s:%d: "):format(file, line) or file .. ": ") or ""
  failure.raise(2, message, place)
end

--- Checks and resolves an experiment. Errors raise at the caller's line, with exit status 2.
--- Fields: name, lattice, materials, seed, genome, scene, simulation, record, population,
--- generations, evaluations, repetitions, islands, breeding, fitness (the one without a
--- default), selection, survival, archive, state, trials, supervisor, supervision, not_in_paper.
---@param spec table
---@return limax.experiment
function experiment.new(spec)
  local file, line = source.caller()
  if rawequal(spec, package.loaded.limax) then
    refuse("limax:experiment: write limax.experiment { ... }, with a dot", file, line)
  end
  local cycle = source.cycle(spec, "limax.experiment")
  if cycle then
    refuse(cycle .. ": expected values that can be copied, got a table that contains itself", file,
      line)
  end
  local result, message = resolve(source.copy(spec), file)
  experiment.idle = true
  if not result then refuse(message, file, line) end
  return result
end

--- Refuses an experiment whose resolved configuration a script changed: what was resolved from it
--- did not change.
---@param self limax.experiment
function experiment.check_unchanged(self)
  if host.json.encode(self.config) == self.config_text then return end
  failure.raise(2, "experiment.config was changed after limax.experiment resolved it: set the"
    .. " fields in limax.experiment { ... }, or use experiment:override { \"path=value\" }")
end

--- Is this value an experiment?
---@param value any
---@return boolean
function experiment.is(value) return getmetatable(value) == Experiment end

--- The same experiment with fields changed by `path=value` texts, checked again as a whole.
---@param changes string[]
---@return limax.experiment
function Experiment:override(changes)
  changes = schema.demand(texts, changes, "override")
  if #changes == 0 then return self end
  local spec = source.copy(self.spec)
  local applied, message = overrides.apply(spec, changes,
    { config = self.config, materials = readers(self.origin).materials })
  local result
  if applied then result, message = resolve(spec, self.origin) end
  if not result then
    local file, line = source.caller()
    refuse(message .. overrides.hint(changes), line and file, line)
  end
  return result
end

return setmetatable(experiment, { __call = function(_, spec) return experiment.new(spec) end })
