--- outcome.lua: the one primary outcome of a run: the champion of its last generation, under the
--- run's first materials, simulated again at `publish` and scored by the run's own fitness.

local body = require "limax.robot.body"
local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local fitness = require "limax.fitness"
local folder_script = require "limax.run.folder_script"
local folders = require "limax.tools.report.runs"
local host = require "limax.host"
local rescore = require "limax.evolution.rescore"
local robot = require "limax.robot.robot"
local robot_file = require "limax.robot.robot_file"
local run_files = require "limax.settings.run_files"
local scored_robot = require "limax.robot.scored_robot"
local scoring = require "limax.robot.scoring"
local source = require "limax.base.source"
local state = require "limax.run.state"
local verify = require "limax.run.verify"

local outcome = {}

--- What the outcome is, for tables.
outcome.TEXT = "best_standard of the last generation, its champion simulated again at publish"
local TIER = "publish"

-- The fitness of a configuration: by name, or the function of the run's script, which needs trust.
-- `functions` are those of scripts by their folder, so that a script is run once.
local function fitness_of(run, functions, trust)
  local stored = run.config.fitness
  if type(stored) ~= "table" then return fitness.get(stored).call end
  if not stored["function"] then
    local spec = source.copy(stored)
    spec[1], spec.name = stored[1] or stored.name, nil
    return fitness.get(spec).call
  end
  if functions[run.path] then return functions[run.path] end
  local experiment = folder_script.run(run.path, run.config.run, trust,
    "its fitness is a function of its script, which scores the champions again")
  local call = experiments.is(experiment) and experiment.fitness.call
  if not call or source.of_function(call).sha256 ~= stored["function"].sha256 then
    failure.raise(2, ("%s: its fitness is a function that no script in it returns with its "
      .. "experiment; the outcome cannot be measured"):format(run.path))
  end
  functions[run.path] = call
  return call
end

-- The state of a script after a run's last generation; nil where it had none.
local function state_of(run)
  local line = run.lines[#run.lines]
  local text = source.read(run.path .. "/" .. verify.place("state", run.repetition,
    line.generation))
  return text and state.decode(text)
end

-- Simulates a champion in the trials of its last generation, which its file holds.
local function simulate_trials(run, device, values, calls)
  local path = folders.champion(run, run.lines[#run.lines])
  local description = run_files.about(path, robot_file.read, path)
  description.materials = run.config.materials
  local walked = run_files.about(path, robot.of, description):simulate { accuracy = TIER,
    device = device }
  if walked.status == "done" then values[run] = scoring.call(calls[run], walked, state_of(run)) end
end

-- Simulates the champions of runs with the same world in one batch.
local function simulate(list, device, values, calls)
  local config = list[1].config
  local stored = list[1].path .. "/config.json"
  local materials = run_files.about(stored, engine.materials, config.materials)
  local scene = run_files.about(stored, engine.scene, config.scene)
  local options = rescore.options(config, { accuracy = TIER })
  local robots = engine.population { lattice = config.lattice, count = #list }
  for i, run in ipairs(list) do
    local path = folders.champion(run, run.lines[#run.lines])
    local description = run_files.about(path, robot_file.read, path)
    run_files.about(path, robot_file.place, robots, i, description, materials)
  end
  robots:check(materials, { require_muscle = false })
  local simulation = engine.simulation(robots, materials, scene, options, device)
  simulation:run()
  for i, run in ipairs(list) do
    local result = simulation:outcome(i)
    if result.status == "done" then
      local record = { id = 1, generation = 0, parents = {}, origin = "hand", status = "done",
        outcome = result, body = body.record(robots, i, materials) }
      values[run] = scoring.call(calls[run], scored_robot.new(record, { population = robots,
        index = i, simulation = simulation, materials = materials, scene = config.scene,
        options = options, device = device }), state_of(run))
    end
  end
end

--- The outcome of each run; a champion whose simulation fails at `publish` has none.
---@param options? { fitness?: function, trust?: boolean } the fitness of all of them, if the caller
--- has it; may scripts of the folders run?
---@return table<limax.compare.run, number>
function outcome.measure(list, device, options)
  options = options or {}
  local values, groups, by_key, functions, calls = {}, {}, {}, {}, {}
  for _, run in ipairs(list) do
    calls[run] = options.fitness or fitness_of(run, functions, options.trust)
    local config = run.config
    local key = host.json.encode { config.lattice, config.materials, config.scene,
      config.simulation, config.record }
    if config.trials then
      simulate_trials(run, device, values, calls)
    elseif not by_key[key] then
      by_key[key] = { run }
      groups[#groups + 1] = by_key[key]
    else
      table.insert(by_key[key], run)
    end
  end
  for _, group in ipairs(groups) do simulate(group, device, values, calls) end
  return values
end

return outcome
