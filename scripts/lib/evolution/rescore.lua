--- rescore.lua: the robots of a population simulated and scored again under another setting of
--- `simulation`: a finer tier for the promising ones, a reference to hold a cheap setting against.
--- The population itself is left as it is. SI units.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local schema = require "limax.base.schema"
local scored_robot = require "limax.robot.scored_robot"
local scoring = require "limax.robot.scoring"
local settings = require "limax.settings.settings"

local rescore = {}

-- What a tier sets, and so another setting sets anew.
local OF_TIER = { "integrator", "precision", "time_step", "bound_fraction", "time_step_most" }

local KNOWN = { accuracy = true }
for _, name in ipairs(OF_TIER) do KNOWN[name] = true end

---@class limax.rescored
---@field fitness table<integer, number> by index of the robot; nil where it failed
---@field distance table<integer, number> m, horizontal, from t = 0 to the end
---@field status table<integer, string> "done", "diverged", "invalid" or "failed"
---@field time_step table<integer, number> s
---@field failed integer robots without a fitness
---@field robots integer that were simulated
---@field seconds number wall time of simulating them
---@field simulated number s of simulated time, all robots together

--- Options of the engine for an experiment's `simulation` with another setting in the place of its
--- own tier. Raises at `level` where the setting is not legal.
---@param config table of the experiment
---@param setting { accuracy: string|nil, integrator: string|nil, precision: string|nil,
--- time_step: number|"auto"|nil, bound_fraction: number|nil, time_step_most: number|nil }
---@param level integer|nil 1 is the caller of this function
---@return table
function rescore.options(config, setting, level)
  for name in pairs(setting) do
    if not KNOWN[name] then
      failure.raise(2, ("rescore: unknown setting %s; known are accuracy, %s"):format(
        schema.show(name), table.concat(OF_TIER, ", ")), (level or 1) + 1)
    end
  end
  local simulation = {}
  for name, value in pairs(config.simulation) do simulation[name] = value end
  for _, name in ipairs(OF_TIER) do simulation[name] = nil end
  for name, value in pairs(setting) do simulation[name] = value end
  return settings.simulation_options(simulation, config.record, (level or 1) + 1)
end

-- Simulates the robots of the mask; the scored robots by index, and the rest of the result.
local function simulate(robots, options, mask)
  local run = robots.run
  local simulation =
    engine.simulation(robots.engine, robots.materials, run.scene, options, run.device, mask)
  -- kernels and springs are made outside of what is timed
  simulation:describe()
  local began = host.clock()
  run:advance(simulation)
  local result = { fitness = {}, distance = {}, status = {}, time_step = {}, failed = 0,
    robots = 0, seconds = host.clock() - began, simulated = 0 }
  local scored = {}
  for i, record in ipairs(robots.records) do
    if mask[i] then
      local copy, context, outcome = {}, {}, simulation:outcome(i)
      for key, value in pairs(record) do copy[key] = value end
      for key, value in pairs(robots.contexts[i]) do context[key] = value end
      copy.outcome, copy.status, copy.reason = outcome, outcome.status, outcome.reason
      context.simulation, context.options = simulation, options
      scored[i] = scored_robot.new(copy, context)
      result.robots = result.robots + 1
      result.simulated = result.simulated + outcome.step * (outcome.time_step or 0)
      result.status[i], result.time_step[i] = outcome.status, outcome.time_step
    end
  end
  return result, scored, simulation
end

--- Scores robots of an expressed population under another setting, by the experiment's fitness.
---@param robots limax.population.scored
---@param setting table see rescore.options
---@param which integer[]|nil indices; every robot if left out
---@return limax.rescored
function rescore.population(robots, setting, which)
  local options, mask = rescore.options(robots.run.config, setting, 2), {}
  for i = 1, #robots do mask[i] = which == nil end
  for k, i in ipairs(which or {}) do
    if robots.records[i] == nil then
      failure.raise(2, ("rescore: robot %s of the list (place %d); the population has %d"):format(
        schema.show(i), k, #robots), 2)
    end
    mask[i] = true
  end
  local result, scored, simulation = simulate(robots, options, mask)
  local call = robots.run.experiment.fitness.call
  for i = 1, #robots do
    local robot = scored[i]
    if robot and robot.status == "done" then
      result.distance[i] = robot:distance()
      local value, _, message = scoring.call(call, robot)
      result.fitness[i] = value
      if message then result.status[i] = "failed" end
    end
    if robot and not result.fitness[i] then result.failed = result.failed + 1 end
  end
  simulation:free "its robots had been scored again"
  return result
end

return rescore
