--- prepared.lua: a simulation of one robot from its description and the options of a script.

local body = require "limax.robot.body"
local bound_check = require "limax.robot.bound_check"
local choice = require "limax.base.choice"
local control_genes = require "limax.settings.control_genes"
local control_notes = require "limax.settings.control_notes"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local function_control = require "limax.robot.function_control"
local named_control = require "limax.settings.named_control"
local output = require "limax.base.output"
local plausible = require "limax.settings.plausible"
local robot_file = require "limax.robot.robot_file"
local robot_trials = require "limax.robot.robot_trials"
local rows = require "limax.robot.rows"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"
local suggest = require "limax.engine.suggest"

local prepared = {}

local option_names = { "scene", "trial", "device", "record", "materials", "progress",
  unpack(settings.names) }
local is_option = {}
for _, name in ipairs(option_names) do is_option[name] = true end

-- Devices by name: opening one starts its threads, so each is opened once.
local devices = {}

local function device_of(device)
  if type(device) ~= "string" then return device end
  devices[device] = devices[device] or engine.device(device)
  return devices[device]
end

-- The robot's own settings, overridden by those of `options`.
local function merged_settings(description, options)
  local own = source.copy(description.simulation or {})
  own.edge = description.edge
  return settings.replaced(own, options, settings.names), options.record or own.record
end

local warned = {}

local function warn(text)
  if text and not warned[text] then output.warn("! simulate: ", text, "\n") end
  if text then warned[text] = true end
end

---@class limax.robot.simulate_options
---@field scene? table as in an experiment; the robot's own, else flat ground
---@field trial? integer only this trial of a robot that has several
---@field device? "auto"|"cpu"|"cuda"|limax.device "auto" if absent
---@field record? table<string, integer> traces, samples per second
---@field materials? string|table other materials under the same letters
---@field progress? fun(progress: table) called about 20 times a second
---@field duration? number s, rounded up to whole samples of `record`
---@field settle? number s, rounded up to whole steps
---@field accuracy? "preview"|"evolve"|"publish"|"reference"
---@field integrator? "leapfrog"|"rk4"|"symplectic_euler"
---@field precision? "compensated"|"double"|"single"
---@field time_step? number|"auto" s
---@field bound? "springs"|"voxels" of an "auto" step
---@field bound_fraction? number of the body's bound, for "auto"
---@field time_step_most? number s, for "auto"
---@field sharing? "mean"|"sum" of the stiffness of a spring's voxels
---@field position? number[] m
---@field velocity? number[] m/s
---@field edge? number m, of a voxel
---@field max_speed? number m/s, beyond which a robot has diverged
---@field max_stretch? number of a spring, in rest lengths, beyond which a robot has diverged

-- Ends the message about an unknown option: a field of an effect belongs in the scene.
local function ending_of(key)
  for _, effect in ipairs(engine.effects()) do
    for _, field in ipairs(effect.fields) do
      if field.name == key or effect.name == key then
        local place = effect.name == key and key .. " = ..."
          or ("%s = { %s = ... }"):format(effect.name, key)
        return ("; it belongs in scene = { %s }"):format(place)
      end
    end
  end
  return suggest.ending(key, option_names)
end

---@class limax.robot.prepared
---@field robot table the robot, or one of its trials
---@field population limax.population its body is robot 1
---@field materials limax.materials
---@field scene limax.scene
---@field control function|nil a Lua function that is the scene's controller
---@field options table of the engine's simulation

--- Makes the population, materials, scene and options for a simulation of a robot.
---@param robot { description: limax.robot.description, materials: limax.materials,
--- population: limax.population } its body is robot 1 of the population
function prepared.parts(robot, options)
  options = options or {}
  if type(options) ~= "table" then
    engine.fail("simulate: expected a table, got " .. schema.show(options))
  end
  for _, key in ipairs(choice.sorted_keys(options)) do
    if not is_option[key] then
      engine.fail(("simulate: unknown option %s%s"):format(key, ending_of(key)))
    end
  end
  -- a robot has the genes for the trial that reads most of them
  local trials = options.scene == nil and robot.description.trials or {}
  if options.trial ~= nil or robot.description.trials and options.scene == nil then
    robot = robot_trials.of(robot, options.trial or 1)
  end
  local materials, population, description = robot.materials, robot.population, robot.description
  if options.materials then
    materials = engine.materials(options.materials)
    local size, message = body.measure_layers(description.voxels, materials)
    if not size then engine.fail("simulate: materials: " .. message) end
    population = robot_file.build(description, materials)
  end
  local named, control = function_control.split(
    named_control.resolve(options.scene or description.scene or defaults.scene))
  local scene = engine.scene(named)
  local scenes = { scene:table() }
  for k, trial in ipairs(trials) do scenes[k + 1] = trial.scene end
  if not control then control_genes.check(scenes, description.control) end
  if options.scene then warn(plausible.replaced(options.scene, scenes[1])) end
  if not control then warn(plausible.idle_genes(description, scenes[1])) end
  local ok, resolved, notes =
    failure.attempt(settings.simulation_options, merged_settings(description, options))
  if not ok then engine.fail("simulate: " .. failure.bare(resolved)) end
  for _, note in ipairs(notes) do warn(note) end
  -- an experiment has checked the scene of its robots
  local is_own = options.scene or not description.scene
  for _, note in ipairs(is_own and plausible.by_hand(population:body(1).counts, materials:table(),
    scenes[1], resolved.edge) or {}) do
    warn(note)
  end
  for _, note in ipairs(control_notes.of(scenes[1], resolved.duration)) do warn(note) end
  return { robot = robot, population = population, materials = materials, scene = scene,
    control = control, options = resolved }
end

--- A simulation that is ready to run; when it has ended, `result()` gives the row and the
--- context of a scored robot.
---@param robot table as of `parts`
---@return limax.simulation
---@return fun(): limax.row, limax.robot.context result
---@return function|nil control makes what calls a Lua function as the controller
function prepared.simulation(robot, options)
  local parts = prepared.parts(robot, options)
  local population, materials = parts.population, parts.materials
  local description = parts.robot.description
  local device = (options or {}).device
  if parts.control and (device == nil or device == "auto") then device = "cpu" end
  local simulation = engine.simulation(population, materials, parts.scene, parts.options,
    device_of(device))
  warn(plausible.overlap(simulation:overlap()))
  for _, note in ipairs(bound_check.notes(population, nil, materials, parts.scene,
    parts.options)) do
    warn(note)
  end
  return simulation, function()
    warn(control_notes.short_steps(parts.scene:table(), parts.options, simulation:outcome(1)))
    return rows.by_hand(description, population, materials, simulation),
      { by_hand = true, population = population, index = 1, simulation = simulation,
        materials = materials, scene = parts.scene:table(), options = parts.options,
        fitness = description.fitness }
  end, parts.control and function()
    local lattice = description.lattice
    return function_control.caller(simulation, parts.control, parts.scene:table().control.rate,
      lattice[1] * lattice[2] * lattice[3])
  end
end

return prepared
