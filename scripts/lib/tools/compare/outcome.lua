--- outcome.lua: the one primary outcome of a run: the champion of its last generation, under the
--- run's first materials, simulated again at `publish` and scored by the run's own fitness.

local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local fitness = require "limax.fitness"
local folders = require "limax.tools.report.runs"
local host = require "limax.host"
local rescore = require "limax.evolution.rescore"
local robot = require "limax.robot.robot"
local robot_file = require "limax.robot.robot_file"
local scored_robot = require "limax.robot.scored_robot"
local rows = require "limax.robot.rows"
local scoring = require "limax.robot.scoring"
local scripts = require "limax.run.scripts"
local source = require "limax.base.source"

local outcome = {}

--- Describes the outcome in tables.
outcome.TEXT = "best_standard of the last generation, its champion simulated again at publish"
local TIER = "publish"

-- The fitness of a configuration: by name, or the function of the run's script.
-- `functions` are those of scripts by their folder, so that a script is run once.
local function fitness_of(run, functions)
  local stored = run.config.fitness
  if type(stored) ~= "table" then return fitness.get(stored).call end
  if not stored["function"] then
    local spec = source.copy(stored)
    spec[1], spec.name = stored[1] or stored.name, nil
    return fitness.get(spec).call
  end
  if functions[run.path] then return functions[run.path] end
  local experiment = scripts.run_copy(run.folder)
  local call = experiments.is(experiment) and experiment.fitness.call
  if not call or source.of_function(call).sha256 ~= stored["function"].sha256 then
    failure.raise(2, ("%s: its fitness is a function that no script in it returns with its "
      .. "experiment; the outcome cannot be measured"):format(run.path))
  end
  functions[run.path] = call
  return call
end

-- The state of a script after a run's last generation; nil if it had none.
local function state_of(run)
  return run.folder:kept(run.repetition, run.lines[#run.lines].generation).state
end

-- The champion of a run's last generation, and the path of its file.
local function champion_of(run)
  local line = run.lines[#run.lines]
  local path = folders.champion(run, line)
  local description, message = folders.description(run, line)
  if not description then failure.raise_damaged(message) end
  return description, path
end

-- Simulates a champion in the trials of its last generation, which its file holds.
local function simulate_trials(run, device, values, calls, on_progress)
  local description, path = champion_of(run)
  description.materials = run.config.materials
  local walked = failure.about(path, robot.of, description):simulate { accuracy = TIER,
    device = device, progress = on_progress }
  if walked.status == "done" then values[run] = scoring.call(calls[run], walked, state_of(run)) end
end

-- Simulates the champions of runs with the same world in one batch.
local function simulate(list, device, values, calls, on_progress)
  local config = list[1].config
  local stored = list[1].path .. "/config.json"
  local materials = failure.about(stored, engine.materials, config.materials)
  local scene = failure.about(stored, engine.scene, config.scene)
  local options = rescore.options(config, { accuracy = TIER })
  local descriptions, paths = {}, {}
  for i, run in ipairs(list) do descriptions[i], paths[i] = champion_of(run) end
  local robots = robot_file.population(descriptions, config.lattice)
  for i, description in ipairs(descriptions) do
    failure.about(paths[i], robot_file.place, robots, i, description, materials)
  end
  robots:check(materials, { require_muscle = false })
  local simulation = engine.simulation(robots, materials, scene, options, device)
  simulation:run(on_progress)
  local all = rows.together(robots, materials, simulation)
  for i, run in ipairs(list) do
    if all[i].status == "done" then
      values[run] = scoring.call(calls[run], scored_robot.new(all[i], { population = robots,
        index = i, simulation = simulation, materials = materials, scene = config.scene,
        options = options, device = device }), state_of(run))
    end
  end
end

--- The outcome of each run; a champion whose simulation fails at `publish` has none.
---@param options? { fitness?: function, progress?: fun(progress: table) } the fitness of all of
--- them, if the caller has it; as for simulation:run
---@return table<limax.report.run, number>
function outcome.measure(list, device, options)
  options = options or {}
  local values, groups, by_key, functions, calls = {}, {}, {}, {}, {}
  for _, run in ipairs(list) do
    calls[run] = options.fitness or fitness_of(run, functions)
    local config = run.config
    local key = host.json.encode { config.lattice, config.materials, config.scene,
      config.simulation, config.record }
    if config.trials then
      simulate_trials(run, device, values, calls, options.progress)
    elseif not by_key[key] then
      by_key[key] = { run }
      groups[#groups + 1] = by_key[key]
    else
      table.insert(by_key[key], run)
    end
  end
  for _, group in ipairs(groups) do
    simulate(group, device, values, calls, options.progress)
  end
  return values
end

return outcome
