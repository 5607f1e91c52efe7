--- trials.lua: the trials of an experiment: the worlds in which each robot is simulated. A list, or
--- a function (generation, random) that returns one. What a trial leaves out is the experiment's.

local choice = require "limax.base.choice"
local control_notes = require "limax.settings.control_notes"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local plausible = require "limax.settings.plausible"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"

---@class limax.trial a trial that is complete
---@field scene table effects with all their fields
---@field simulation table settings
---@field options table what engine.simulation takes
---@field engine_scene limax.scene
---@field engine_materials limax.materials|nil the own ones of the trial

---@class limax.trials
---@field config table|nil for config.json: a list, or the description of the function
---@field notes string[] for the user
local Trials = {}
Trials.__index = Trials

local trials = {}

-- Scripts may draw numbers of this stream too, for the individuals below this one.
local STREAM, INDIVIDUAL = "user", 2 ^ 32 - 1

local rules = { scene = schema.any, effects = schema.any, materials = schema.any }
for name, rule in pairs(settings.of_trial) do rules[name] = rule end
local check_fields = schema.fields(rules, function(name)
  for _, effect in ipairs(engine.effects()) do
    if effect.name == name then return "; effects belong in scene = { ... }" end
  end
end)
local EXAMPLE = "{ { scene = limax.scenes.land() }, { scene = limax.scenes.stairs() } }"

-- Bodies refer to materials by their places in the table.
local function check_materials(own, common, path)
  local function signs(of)
    local list = {}
    for k, each in ipairs(of.materials) do list[k] = each.letter .. " (" .. each.kind .. ")" end
    return table.concat(list, ", ")
  end
  if signs(own) == signs(common) then return nil end
  return ("%s.materials: expected those of the experiment with other numbers: letters and kinds %s;"
    .. " got %s"):format(path, signs(common), signs(own))
end

-- The experiment's scene with other effects.
local function with_effects(value, scene, path)
  if value.scene ~= nil then
    return nil, ("%s: scene and effects: give a whole scene, or the effects that differ from the"
      .. " experiment's"):format(path)
  elseif type(value.effects) ~= "table" then
    return nil, ("%s.effects: expected a table such as { target = { position = { 1, 0, 0 } } }, got"
      .. " %s"):format(path, schema.show(value.effects))
  end
  local own = {}
  for name, effect in pairs(scene) do own[name] = effect end
  for name, effect in pairs(value.effects) do own[name] = effect end
  return own
end

-- The entry of a trial for config.json: its own fields, resolved.
local function entry_of(value, path, config, read)
  if type(value) ~= "table" then
    return nil, ("%s: expected a table such as { scene = limax.scenes.land() }, got %s"):format(
      path, schema.show(value))
  end
  local entry, message = check_fields(value, path)
  if not entry then return nil, message end
  local scene = value.scene
  if value.effects ~= nil then
    scene, message = with_effects(value, config.scene, path)
    if message then return nil, message end
    entry.effects = nil
  end
  for name, own in pairs { scene = scene, materials = value.materials } do
    entry[name], message = read[name](own)
    if message then return nil, path .. "." .. message end
  end
  message = entry.materials and check_materials(entry.materials, config.materials, path)
  if message then return nil, message end
  return entry
end

-- A checked list, or `nil, message`.
local function entries_of(list, config, read)
  local size = schema.list_size(list)
  if not size or size == 0 then
    return nil, ("trials: expected a list such as %s, got %s"):format(EXAMPLE,
      size and "an empty one" or schema.show(list))
  end
  local entries = {}
  for k = 1, size do
    local message
    entries[k], message = entry_of(list[k], ("trials[%d]"):format(k), config, read)
    if message then return nil, message end
  end
  return entries
end

-- A note with the names of the trial's own fields. One without any is the experiment's.
local function named(note, entry, path)
  note = note:gsub("simulation%.([%w_]+)", function(name)
    return entry[name] ~= nil and ("%s.%s"):format(path, name) or nil
  end)
  if entry.scene then note = note:gsub("^scene ", path .. ".%0"):gsub("scene%.", path .. ".%0") end
  local is_own = entry.materials and not note:find(path, 1, true)
  return is_own and path .. ": " .. note or note
end

-- Completes an entry, which gets its rounded duration. Adds to the notes.
local function complete(entry, config, path, notes)
  local simulation = settings.replaced(config.simulation, entry, settings.names)
  local record = {}
  for kind, rate in pairs(config.record) do
    record[kind] = entry.record and entry.record[kind] or rate
  end
  local own = settings.finish(simulation, record)
  entry.duration = entry.duration and simulation.duration
  local scene = entry.scene or config.scene
  local view = { scene = scene, simulation = simulation, lattice = config.lattice,
    fitness = config.fitness,
    materials = entry.materials or config.materials }
  own[#own + 1] = entry.scene and plausible.dropped(scene, config.scene)
  local engine_scene = engine.scene(scene)
  for _, note in ipairs(plausible.notes(view, engine_scene:inputs())) do own[#own + 1] = note end
  for _, note in ipairs(control_notes.of(scene, simulation.duration)) do own[#own + 1] = note end
  for _, note in ipairs(own) do
    local text = named(note, entry, path)
    if not choice.contains(notes, text) then notes[#notes + 1] = text end
  end
  return { scene = scene, simulation = simulation, engine_scene = engine_scene,
    options = settings.engine_options(simulation, record),
    engine_materials = entry.materials and engine.materials(entry.materials) }
end

local function complete_all(entries, config)
  local list, notes = {}, {}
  for k, entry in ipairs(entries) do
    list[k] = complete(entry, config, ("trials[%d]"):format(k), notes)
  end
  return list, notes
end

-- Calls the script's function for a generation. Returns a checked list, or `nil, message`; raises
-- an error of the function.
local function drawn(self, repetition, generation)
  local random = engine.random(self.settings.seed, repetition, STREAM, generation, INDIVIDUAL)
  local ok, list, trace = failure.attempt_watched("the trials", self.call, generation, random)
  if not ok then failure.raise_again(list, trace) end
  local entries, message = entries_of(list, self.settings, self.read)
  return entries, message and ("%s (the function's list for generation %d)"):format(message,
    generation)
end

--- The trials of an experiment. Without any, its own world is the only one.
---@param spec table|fun(generation: integer, random: limax.random): table|nil
---@param config table complete but for its trials
---@param read { scene: function, materials: function } resolve a value; `nil, message` if invalid
---@param base string|nil folder that file names are relative to
---@return limax.trials|nil
---@return string|nil message
function trials.get(spec, config, read, base)
  local self = setmetatable({ settings = config, read = read }, Trials)
  local entries, message
  if spec == nil then
    entries = { {} }
  elseif type(spec) == "function" then
    self.call, self.config = spec, source.describe(spec, base)
    -- called once, so that a mistake is found before the run
    entries, message = drawn(self, 1, 0)
  else
    entries, message = entries_of(spec, config, read)
    self.config = entries
  end
  if message then return nil, message end
  self.list, self.notes = complete_all(entries, config)
  return self
end

--- The trials of a repetition by generation. Equal trials of successive generations are the same
--- table: robots that were scored in them keep their scores.
---@return fun(generation: integer): limax.trial[]
function Trials:of(repetition)
  if not self.call then return function() return self.list end end
  local newest = { generation = -1 }
  return function(generation)
    if generation == newest.generation then return newest.list end
    local entries, message = drawn(self, repetition, generation)
    if message then failure.raise(1, message) end
    local text = host.json.encode(entries)
    local list = text == newest.text and newest.list or complete_all(entries, self.settings)
    if generation > newest.generation then
      newest = { generation = generation, list = list, text = text }
    end
    return list
  end
end

return trials
