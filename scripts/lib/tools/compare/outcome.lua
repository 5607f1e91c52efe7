--- outcome.lua: the one primary outcome of a run: the champion of its last generation, under the
--- run's first materials, simulated again at `publish` and scored by the run's own fitness.

local body = require "limax.robot.body"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local fitness = require "limax.fitness"
local host = require "limax.host"
local rescore = require "limax.evolution.rescore"
local robot_file = require "limax.robot.robot_file"
local runs = require "limax.tools.compare.runs"
local scored_robot = require "limax.robot.scored_robot"
local scoring = require "limax.robot.scoring"
local script = require "limax.base.script"
local source = require "limax.base.source"

local outcome = {}

--- What the outcome is, for tables.
outcome.TEXT = "best_standard of the last generation, its champion simulated again at publish"
local TIER = "publish"

-- The fitness of a configuration: by name, or the function of the run's script. `functions` are
-- those of scripts by their text, so that a script is run once.
local function fitness_of(run, functions)
  local stored = run.config.fitness
  if type(stored) ~= "table" then return fitness.get(stored).call end
  if stored.name then
    local spec = { stored.name }
    for key, value in pairs(stored) do
      if key ~= "name" then spec[key] = value end
    end
    return fitness.get(spec).call
  end
  local sha256 = stored["function"].sha256
  if functions[sha256] then return functions[sha256] end
  local name = run.config.run.script
  local experiment = name and script.run(("%s/scripts/%s"):format(run.path, name))
  local call = type(experiment) == "table" and experiment.fitness and experiment.fitness.call
  if not call or source.of_function(call).sha256 ~= sha256 then
    failure.raise(2, ("%s: its fitness is a function that no script in it returns with its "
      .. "experiment; the outcome cannot be measured"):format(run.path))
  end
  functions[sha256] = call
  return call
end

-- Equal for runs whose champions can be simulated together.
local function key_of(run)
  local config = run.config
  return host.json.encode { config.lattice, config.materials, config.scene, config.simulation,
    config.record }
end

-- Simulates the champions of runs with the same world in one batch.
local function simulate(list, device, values, fitness_call, functions)
  local config = list[1].config
  local materials, scene = engine.materials(config.materials), engine.scene(config.scene)
  local options = rescore.options(config, { accuracy = TIER })
  local robots = engine.population { lattice = config.lattice, count = #list }
  for i, run in ipairs(list) do
    robot_file.place(robots, i, robot_file.read(runs.champion(run)), materials)
  end
  robots:check(materials, { require_muscle = false })
  local simulation = engine.simulation(robots, materials, scene, options, device)
  simulation:run()
  for i, run in ipairs(list) do
    local result = simulation:outcome(i)
    if result.status == "done" then
      local record = { id = 1, generation = 0, parents = {}, origin = "hand", status = "done",
        outcome = result, body = body.record(robots, i, materials) }
      local call = fitness_call or fitness_of(run, functions)
      values[run] = scoring.call(call, scored_robot.new(record, { population = robots,
        index = i, simulation = simulation, materials = materials, scene = config.scene,
        options = options, device = device }))
    end
  end
end

--- The outcome of each run; a champion whose simulation fails at `publish` has none.
---@param fitness_call? function the fitness of all of them, if the caller has it
---@return table<limax.compare.run, number>
function outcome.measure(list, device, fitness_call)
  local values, groups, by_key, functions = {}, {}, {}, {}
  for _, run in ipairs(list) do
    local key = key_of(run)
    if not by_key[key] then
      by_key[key] = {}
      groups[#groups + 1] = by_key[key]
    end
    table.insert(by_key[key], run)
  end
  for _, group in ipairs(groups) do simulate(group, device, values, fitness_call, functions) end
  return values
end

return outcome
