--- robot_trials.lua: the trials of one robot: the worlds in which it is simulated. Its row has
--- their outcomes; its file has scene and settings of each.

local drive = require "limax.settings.drive"
local engine = require "limax.engine"
local robot_file = require "limax.robot.robot_file"
local rows = require "limax.robot.rows"
local source = require "limax.base.source"
local steps = require "limax.robot.steps"

local robot_trials = {}

--- Has a period of the muscles too few steps in any of its trials?
function robot_trials.is_undersampled(row, whole)
  local outcomes = rows.outcomes(row)
  for k, each in ipairs(whole.trials or { whole }) do
    local step = outcomes[k] and outcomes[k].status ~= 0 and outcomes[k].time_step
    if step and step == step and drive.problem(each.scene, step) then return true end
  end
  return false
end

--- A robot in each of its trials.
---@param make fun(row: limax.row, context: limax.robot.context): limax.scored_robot
function robot_trials.each(row, whole, make)
  local list = {}
  for k, context in ipairs(whole.trials) do
    local one = rows.of_trial(row, k)
    -- a trial may have materials of its own
    if context.materials ~= whole.materials then one.mass = rows.outcomes(one)[1].mass end
    list[k] = make(one, context)
  end
  return list
end

--- The trials of a robot as its file holds them.
function robot_trials.described(context)
  if not context.trials then return nil end
  local list = {}
  for k, each in ipairs(context.trials) do
    list[k] = { scene = each.scene, simulation = each.options,
      materials = each.materials ~= context.materials and each.materials:table() or nil }
  end
  return list
end

--- A robot with scene, settings and materials of one of its trials, and without the others. A robot
--- without trials is its own first one.
---@param robot { description: limax.robot.description, materials: limax.materials,
--- population: limax.population }
function robot_trials.of(robot, k)
  local trials = robot.description.trials
  local count = trials and #trials or 1
  if type(k) ~= "number" or k % 1 ~= 0 or k < 1 or k > count then
    engine.fail(("simulate: trial: expected a whole number from 1 to %d, got %s"):format(count,
      tostring(k)))
  end
  if not trials then return robot end
  local description = source.copy(robot.description)
  description.trials, description.outcome, description.score = nil, nil, nil
  description.scene, description.simulation = trials[k].scene, trials[k].simulation
  local materials, population = robot.materials, robot.population
  if trials[k].materials then
    description.materials = trials[k].materials
    materials = engine.materials(description.materials)
    population = robot_file.build(description, materials)
  end
  return { description = description, materials = materials, population = population }
end

--- Simulates a robot in all of its trials together. Returns its row and context.
---@param prepare fun(robot: table, options: table): limax.simulation, fun(): limax.row,
--- limax.robot.context
function robot_trials.joined(robot, options, prepare)
  local simulations, results, list, contexts = {}, {}, {}, {}
  local own = source.copy(options)
  for k = 1, #robot.description.trials do
    own.trial = k
    simulations[k], results[k] = prepare(robot, own)
  end
  steps.finish(simulations, options.progress)
  for k, result in ipairs(results) do list[k], contexts[k] = result() end
  local context = source.copy(contexts[1])
  if not options.materials then
    context.population, context.materials = robot.population, robot.materials
  end
  for k, trial in ipairs(robot.description.trials) do
    if options.materials or not trial.materials then contexts[k].materials = context.materials end
  end
  context.trials = contexts
  return rows.joined(list, context.population, context.materials), context
end

return robot_trials
