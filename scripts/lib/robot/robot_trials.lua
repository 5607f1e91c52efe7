--- robot_trials.lua: the trials of one robot: the worlds in which it is simulated. Its record holds
--- their outcomes as `trials`, that of the first one also as `outcome`; its file holds scene and
--- settings of each.

local body = require "limax.robot.body"
local drive = require "limax.settings.drive"
local engine = require "limax.engine"
local robot_file = require "limax.robot.robot_file"

local robot_trials = {}

local function copied(value)
  local copy = {}
  for name, entry in pairs(value) do copy[name] = entry end
  return copy
end

--- Status and reason of a robot whose trial k is the first one that did not end well.
---@param k? integer nil for a robot without trials
---@return string status
---@return string|nil reason
function robot_trials.status_of(status, reason, k)
  local prefix = k and status == "diverged" and ("trial %d: "):format(k) or ""
  return status, reason and prefix .. reason
end

--- Sets status and reason of a record from its outcomes: it is done if all its trials ended well,
--- else what the first one is that did not.
---@param record table
---@return table record
function robot_trials.set_status(record)
  local outcome = record.outcome
  record.status, record.reason = outcome.status, outcome.reason
  for k, each in ipairs(record.trials or {}) do
    if each.status ~= "done" then
      record.status, record.reason = robot_trials.status_of(each.status, each.reason, k)
      return record
    end
  end
  return record
end

--- Is a step of any of its trials coarse?
function robot_trials.is_coarse(record)
  for _, each in ipairs(record.trials or {}) do
    if each.coarse then return true end
  end
  return record.outcome ~= nil and record.outcome.coarse == true
end

--- Has a period of the muscles too few steps in any of its trials?
---@param record table
---@param whole limax.robot.context
function robot_trials.is_undersampled(record, whole)
  local outcomes = record.trials or { record.outcome }
  for k, each in ipairs(whole.trials or { whole }) do
    local step = outcomes[k] and outcomes[k].time_step
    if step and drive.problem(each.scene, step) then return true end
  end
  return false
end

-- The record of a robot in one of its trials only, which has no score.
local function record_of(record, k, context, whole)
  local outcome, body_record = record.trials[k], record.body
  if context.materials ~= whole.materials then
    body_record = copied(body_record)
    body_record.mass = outcome.mass
  end
  return { id = record.id, generation = record.generation, parents = record.parents,
    origin = record.origin, body = body_record, outcome = outcome, status = outcome.status,
    reason = outcome.reason }
end

--- A robot in each of its trials.
---@param record table
---@param whole limax.robot.context
---@param make fun(record: table, context: limax.robot.context): limax.scored_robot
---@return limax.scored_robot[]
function robot_trials.each(record, whole, make)
  local list = {}
  for k, context in ipairs(whole.trials) do
    list[k] = make(record_of(record, k, context, whole), context)
  end
  return list
end

--- The trials of a robot as its file holds them.
---@param context limax.robot.context
---@return table[]|nil
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
---@param k integer
function robot_trials.of(robot, k)
  local trials = robot.description.trials
  local count = trials and #trials or 1
  if type(k) ~= "number" or k % 1 ~= 0 or k < 1 or k > count then
    engine.fail(("simulate: trial: expected a whole number from 1 to %d, got %s"):format(count,
      tostring(k)))
  end
  if not trials then return robot end
  local description = copied(robot.description)
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

--- Record and context of a robot that was simulated in each of its trials.
---@param options limax.robot.simulate_options
---@param simulate fun(robot: table, options: table): table, limax.robot.context
---@return table record
---@return limax.robot.context
function robot_trials.joined(robot, options, simulate)
  local records, contexts, outcomes, own = {}, {}, {}, copied(options)
  for k = 1, #robot.description.trials do
    own.trial = k
    records[k], contexts[k] = simulate(robot, own)
    outcomes[k] = records[k].outcome
  end
  local record, context = records[1], copied(contexts[1])
  if not options.materials then
    context.population, context.materials = robot.population, robot.materials
    record.body = body.record(robot.population, 1, robot.materials)
  end
  for k, trial in ipairs(robot.description.trials) do
    if options.materials or not trial.materials then contexts[k].materials = context.materials end
  end
  record.trials, context.trials = outcomes, contexts
  return robot_trials.set_status(record), context
end

return robot_trials
