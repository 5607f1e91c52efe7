--- scene_report.lua: `limax doctor --scene FILE`: the effects of a scene with every parameter, and
--- the loops or kernel that run it, for a body that fills the lattice.

local choice = require "limax.base.choice"
local drive = require "limax.settings.drive"
local engine = require "limax.engine"
local experiment = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local script = require "limax.base.script"
local settings = require "limax.settings.settings"

local scene_report = {}

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
  local simulation = scene_report.simulation(config, config.scene, device,
    settings.engine_options(config.simulation, config.record))
  local facts = { file = file, lattice = config.lattice, effects = {},
    runs = simulation:describe() }
  for i, name in ipairs(names) do
    facts.effects[i] = { name = name, fields = config.scene[name] }
  end
  -- the step is known after the first look at a state
  simulation:advance(0, 1)
  facts.problem = drive.problem(config.scene, simulation:outcome(1).time_step)
  return facts
end

--- Facts about the scene of an experiment's file, or the scenes of its trials.
---@param file string
---@return table[] facts of each trial: `effects`, a list of { name, fields }; `runs`, from
--- simulation:describe(); `problem`, of its muscles' frequency; `trial`, its number, where the
--- experiment has trials
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
  for _, effect in ipairs(facts.effects) do
    local info = infos[effect.name]
    local list = info and info.instances > 1 and effect.fields or { effect.fields }
    for i, values in ipairs(list) do
      line("  %-10s %s", effect.name .. (#list > 1 and "[" .. i .. "]" or ""),
        fields_of(info, values))
    end
  end
  if facts.problem then line("%s", facts.problem) end
  return lines
end

return scene_report
