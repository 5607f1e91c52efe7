--- rescore.lua: robots of a population simulated and scored again under another setting of
--- `simulation`: a finer tier for the promising ones, or a reference to compare a cheap setting
--- with. The population itself does not change. SI units.

local failure = require "limax.base.failure"
local generations = require "limax.evolution.generation"
local rows = require "limax.robot.rows"
local schema = require "limax.engine.schema"
local scoring = require "limax.robot.scoring"
local state = require "limax.run.state"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"
local strict = require "limax.engine.strict"

local rescore = strict.module "limax.rescore"

local is_setting = { accuracy = true }
for _, name in ipairs(settings.of_tier) do is_setting[name] = true end

---@class limax.rescored
---@field fitness table<integer, number> by index of the robot; nil if it failed
---@field distance table<integer, number> m, horizontal, from t = 0 to the end
---@field status table<integer, string> "done", "diverged", "invalid" or "failed"
---@field time_step table<integer, number> s
---@field failed integer robots without a fitness
---@field robots integer that were simulated
---@field seconds number wall time of simulating them
---@field simulated number s of simulated time, all robots together

--- Options of the engine for an experiment's `simulation` with another setting instead of its own
--- tier. Raises at `level` where the setting is not valid.
---@param config table of the experiment
---@param setting { accuracy: string|nil, integrator: string|nil, precision: string|nil,
--- time_step: number|"auto"|nil, bound: "springs"|"voxels"|nil,
--- bound_fraction: number|nil, time_step_most: number|nil }
---@param level integer|nil 1 is the caller of this function
---@return table
function rescore.options(config, setting, level)
  level = (level or 1) + 1
  for name in pairs(setting) do
    if not is_setting[name] then
      failure.raise(2, ("rescore: unknown setting %s; the settings are accuracy, %s"):format(
        schema.show(name), table.concat(settings.of_tier, ", ")), level)
    end
  end
  local changes = source.copy(setting)
  changes.accuracy = changes.accuracy or config.simulation.accuracy
  return (settings.simulation_options(settings.replaced(config.simulation, changes, settings.names),
    config.record, level))
end

--- Scores robots of an expressed population under another setting, by the experiment's fitness.
---@param robots limax.population.scored
---@param setting table|fun(simulation: table): table see rescore.options; a function gives that of
--- each trial's `simulation`
---@param which integer[]|nil indices; every robot if left out
---@return limax.rescored
function rescore.population(robots, setting, which)
  if type(robots) ~= "table" or type(rawget(robots, "world")) ~= "table" then
    schema.refuse("rescore.population", "a population of limax.start", robots)
  elseif type(setting) ~= "table" and type(setting) ~= "function" then
    schema.refuse("rescore.population: setting", 'a table such as { accuracy = "publish" }',
      setting)
  elseif which ~= nil and type(which) ~= "table" then
    schema.refuse("rescore.population: which", "a list of indices", which)
  end
  local world, list, options = robots.world, {}, {}
  local own_state = rawget(robots, "state") or robots.before.state
  for k, trial in ipairs(robots.trials) do
    local own = type(setting) == "function" and setting(trial.simulation) or setting
    options[k] = rescore.options({ simulation = trial.simulation,
      record = trial.options.record }, own, 2)
  end
  for i = 1, which and 0 or #robots do list[i] = i end
  for k, i in ipairs(which or {}) do
    if robots.rows[i] == nil then
      failure.raise(2, ("rescore: robot %s of the list (place %d); the population has %d"):format(
        schema.show(i), k, #robots), 2)
    end
    list[k] = i
  end
  local again, simulations, seconds =
    generations.again(robots, list, robots.materials, options)
  local result = { fitness = {}, distance = {}, status = {}, time_step = {}, failed = 0,
    robots = 0, seconds = seconds, simulated = 0 }
  for i = 1, robots.count or #robots do
    local robot = again[i]
    if robot then
      local row = robot.row
      result.robots = result.robots + 1
      for _, o in ipairs(rows.outcomes(row)) do
        local step = o.time_step == o.time_step and o.time_step or 0
        result.simulated = result.simulated + tonumber(o.step) * step
      end
      result.status[i], result.time_step[i] = row.status, row.outcome.time_step
      if row.status == "done" then
        local value, _, message =
          scoring.call(world.fitness.call, robot, state.copy(own_state))
        result.distance[i], result.fitness[i] = robot:distance(), value
        if message then result.status[i] = "failed" end
      end
      if not result.fitness[i] then result.failed = result.failed + 1 end
    end
  end
  generations.free(simulations, "its robots had been scored again")
  return result
end

return strict.close("limax.rescore", rescore)
