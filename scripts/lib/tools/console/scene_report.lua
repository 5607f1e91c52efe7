--- scene_report.lua: `limax doctor --scene FILE`: the effects of a scene with every parameter, the
--- loops or kernel that run it, and the cost of each effect, measured on one CPU thread with a body
--- that fills the lattice.

local choice = require "limax.base.choice"
local drive = require "limax.settings.drive"
local engine = require "limax.engine"
local experiment = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local script = require "limax.base.script"
local settings = require "limax.settings.settings"
local timing = require "limax.tools.bench.timing"

local scene_report = {}

-- wall time of one measurement, s, and their number: the fastest counts
local SLICE, ROUNDS = 0.02, 8
-- s of simulated time, more than these measurements reach
local ENDLESS = 1e4

--- A simulation of one body of all materials, in a scene.
---@param config table of an experiment: its lattice and materials
---@param scene table
---@param options table of the simulation
---@return limax.simulation
function scene_report.simulation(config, scene, device, options)
  local materials = engine.materials(config.materials)
  local population = engine.population { lattice = config.lattice, count = 1 }
  local voxels = {}
  for i = 1, population.voxels_each do voxels[i] = 1 + i % (materials.count - 1) end
  population:set_body(1, voxels)
  population:check(materials)
  return engine.simulation(population, materials, engine.scene(scene), options, device)
end

-- The scene without one effect, and without those that need it.
local function without(infos, scene, left_out)
  local rest = {}
  for name, fields in pairs(scene) do
    if name ~= left_out then rest[name] = fields end
  end
  for _, info in ipairs(infos) do
    local usable = #info.needs == 0
    for _, need in ipairs(info.needs) do usable = usable or rest[need] ~= nil end
    if not usable then rest[info.name] = nil end
  end
  return rest
end

-- A case for best_rates: runs a slice of a simulation and returns the number of steps.
local function timed(config, scene, options)
  local device = engine.device("cpu", { threads = 1 })
  local simulation = scene_report.simulation(config, scene, device, options)
  simulation:advance(SLICE)
  local before = simulation:advance(SLICE).steps
  return { run = function()
    local progress = simulation:advance(SLICE)
    if progress.finished then
      failure.raise(1, "a full body's simulation ended in this scene: nothing can be timed")
    end
    local done = progress.steps - before
    before = progress.steps
    return done
  end }
end

-- Seconds per step of the scene, of the springs only, and of the scene without each effect.
local function measure(config, infos, names)
  local options = settings.engine_options(config.simulation, {})
  local device = engine.device("cpu", { threads = 1 })
  local whole = scene_report.simulation(config, config.scene, device, options)
  whole:advance(0, 1)
  -- the same time step in every case: fewer effects would allow a longer one
  options.time_step, options.duration, options.settle = whole:outcome(1).time_step, ENDLESS, 0
  -- a body without ground falls for as long as it is measured
  options.max_speed = 1e30
  local cases = { timed(config, config.scene, options), timed(config, {}, options) }
  for _, name in ipairs(names) do
    cases[#cases + 1] = timed(config, without(infos, config.scene, name), options)
  end
  -- once more, to measure the noise
  cases[#cases + 1] = timed(config, config.scene, options)
  -- processor time, so that other work of the machine does not count
  local rates = timing.best_rates(cases, ROUNDS, os.clock)
  local first, again = 1 / rates[1], 1 / rates[#cases]
  local result = { time_step = options.time_step, step = math.min(first, again),
    noise = math.abs(first - again), springs = 1 / rates[2], effects = {} }
  for i, name in ipairs(names) do result.effects[name] = result.step - 1 / rates[2 + i] end
  return result
end

-- The facts about one scene, that of `config`.
local function facts_of(file, config, device)
  local infos, names = engine.effects(), {}
  for _, info in ipairs(infos) do
    if config.scene[info.name] then names[#names + 1] = info.name end
  end
  -- effects of the script's own
  for _, name in ipairs(choice.sorted_keys(config.scene)) do
    if config.scene[name].force then names[#names + 1] = name end
  end
  local cost = measure(config, infos, names)
  local facts = { file = file, lattice = config.lattice, effects = {}, step = cost.step,
    problem = drive.problem(config.scene, cost.time_step),
    springs = cost.springs / cost.step, noise = cost.noise / cost.step }
  for i, name in ipairs(names) do
    facts.effects[i] = { name = name, fields = config.scene[name],
      cost = cost.effects[name] / cost.step }
  end
  facts.runs = scene_report.simulation(config, config.scene, device,
    settings.engine_options(config.simulation, config.record)):describe()
  return facts
end

--- Facts about the scene of an experiment's file, or the scenes of its trials. An effect's cost is
--- the share of a step that is saved without it and without the effects that need it.
---@param file string
---@return table[] facts of each trial: `effects`, a list of { name, fields, cost }; `springs`,
--- their share; `step`, s; `noise`, the relative difference of two measurements; `runs`, from
--- simulation:describe(); `trial`, its number, where the experiment has trials
function scene_report.gather(file, device)
  local found = script.run(file)
  if not experiment.is(found) then
    failure.raise(2, ("%s returns no experiment"):format(file))
  end
  local list, config = {}, found.config
  for k, trial in ipairs(found.trials:of(1)(0)) do
    local own = trial.engine_materials and trial.engine_materials:table()
    list[k] = facts_of(file, { lattice = config.lattice, materials = own or config.materials,
      scene = trial.scene, simulation = trial.simulation, record = trial.options.record }, device)
    list[k].trial = config.trials and k
  end
  return list
end

-- A value on one line; of a table of heights its size.
local function shown(value)
  if type(value) == "table" and type(value[1]) == "table" then
    return ("%d x %d"):format(#value, #value[1])
  end
  return host.json.encode(value)
end

local function fields_of(info, values)
  local parts = {}
  if not info then
    for _, name in ipairs(choice.sorted_keys(values)) do
      if name ~= "force" then parts[#parts + 1] = name .. " " .. shown(values[name]) end
    end
    return "defined by a script" .. (#parts > 0 and ": " or "") .. table.concat(parts, ", ")
  end
  for i, field in ipairs(info.fields) do
    parts[i] = ("%s %s%s"):format(field.name, shown(values[field.name]),
      field.unit == "1" and "" or " " .. field.unit)
  end
  return #parts == 0 and "no parameters" or table.concat(parts, ", ")
end

--- The facts as lines of text.
---@param facts table
function scene_report.lines(facts)
  local runs, infos, lines = facts.runs, {}, {}
  local function line(...) lines[#lines + 1] = (...):format(select(2, ...)) end
  for _, info in ipairs(engine.effects()) do infos[info.name] = info end
  line("%s: a body of all %s voxels%s", facts.file, table.concat(facts.lattice, "x"),
    facts.trial and (", trial %d"):format(facts.trial) or "")
  if runs.passes then
    line("runs on the CPU, passes for %s", runs.passes)
  else
    line("runs on CUDA: %s path, kernel %s (%s), %d registers, %d bytes spilled", runs.path,
      runs.origin, runs.architecture, runs.registers, runs.spilled)
  end
  line("%.3g us per step on one CPU thread, within %.0f %%; springs %.0f %%",
    1e6 * facts.step, math.ceil(100 * facts.noise), 100 * facts.springs)
  line("before an effect: the share of a step that is saved without it")
  for _, effect in ipairs(facts.effects) do
    local info = infos[effect.name]
    local list = info and info.instances > 1 and effect.fields or { effect.fields }
    for i, values in ipairs(list) do
      line("%4s  %-10s %s", i == 1 and ("%.0f %%"):format(100 * math.max(0, effect.cost)) or "",
        effect.name .. (#list > 1 and "[" .. i .. "]" or ""), fields_of(info, values))
    end
  end
  if facts.problem then line("%s", facts.problem) end
  return lines
end

return scene_report
