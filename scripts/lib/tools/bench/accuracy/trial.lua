--- trial.lua: one setting, tried: where the masses of a body end, what it took, and whether it came
--- through. Wall time is the least of several runs, without the making of kernels and springs. SI
--- units.

local engine = require "limax.engine"
local host = require "limax.host"
local methods = require "limax.tools.bench.accuracy.methods"

local trial = {}

---@class limax.accuracy.subject what is simulated
---@field population limax.population equal bodies: robot 1 is looked at
---@field materials limax.materials
---@field scene limax.scene
---@field duration number s
---@field settle number s
---@field position number[]|nil m
---@field velocity number[]|nil m/s
---@field place fun(simulation: limax.simulation, robot: integer)|nil puts a robot's masses

---@class limax.accuracy.setting
---@field integrator string
---@field precision string
---@field time_step number|"auto" s
---@field bound_fraction number|nil
---@field time_step_most number|nil s

---@class limax.accuracy.trial
---@field status "done"|"diverged"|"refused"|"invalid"
---@field reason string|nil why it is not "done"
---@field positions number[]|nil of all masses at the end, m, flat
---@field seconds number|nil least wall time of one robot and one simulated second, s
---@field time_step number|nil s
---@field runs integer|nil

--- Options of a subject under a setting.
---@param subject limax.accuracy.subject
---@param setting limax.accuracy.setting
---@param record table<string, integer>|nil
---@return table
function trial.options(subject, setting, record)
  return { integrator = setting.integrator, precision = setting.precision,
    time_step = setting.time_step, bound_fraction = setting.bound_fraction,
    time_step_most = setting.time_step_most, duration = subject.duration, settle = subject.settle,
    position = subject.position, velocity = subject.velocity, record = record }
end

--- A simulation of a subject, every robot in its place.
---@param subject limax.accuracy.subject
---@param options table
---@param device limax.device
---@return limax.simulation
function trial.simulation(subject, options, device)
  local simulation =
    engine.simulation(subject.population, subject.materials, subject.scene, options, device)
  if subject.place then
    for robot = 1, subject.population.count do subject.place(simulation, robot) end
  end
  -- kernels and springs are made here, outside of what is timed
  simulation:describe()
  return simulation
end

--- Positions of a robot's masses now, flat, m.
---@param simulation limax.simulation
---@param robot integer
---@return number[]
function trial.positions(simulation, robot)
  local flat = {}
  for _, row in ipairs((simulation:state(robot)):table()) do
    for axis = 1, 3 do flat[#flat + 1] = row[axis] end
  end
  return flat
end

--- Root of the mean square of the distances between masses, m.
---@param a number[] flat
---@param b number[]
---@return number
function trial.rms(a, b)
  local sum = 0
  for i = 1, #a do sum = sum + (a[i] - b[i]) ^ 2 end
  return math.sqrt(sum / (#a / 3))
end

--- Tries a setting: at least two runs, then more until `effort` is spent.
---@param subject limax.accuracy.subject
---@param setting limax.accuracy.setting
---@param device limax.device
---@param effort { seconds: number, runs: integer }|nil wall time and number of runs at most; one
--- run, untimed, if left out
---@return limax.accuracy.trial
function trial.run(subject, setting, device, effort)
  local options = trial.options(subject, setting)
  local refused = methods.refusal(subject, options, device)
  if refused then return { status = "refused", reason = refused } end
  local result = { runs = 0 }
  local least, spent = math.huge, 0
  repeat
    local simulation = trial.simulation(subject, options, device)
    local began = host.clock()
    simulation:run()
    local seconds = host.clock() - began
    least, spent, result.runs = math.min(least, seconds), spent + seconds, result.runs + 1
    local outcome = simulation:outcome(1)
    result.status, result.reason = outcome.status, outcome.reason
    result.time_step = outcome.time_step
    if outcome.status == "done" then result.positions = trial.positions(simulation, 1) end
    simulation:free "its trial was over"
  until result.status ~= "done" or not effort or result.runs >= effort.runs
    or result.runs >= 2 and spent >= effort.seconds
  if result.status == "done" then
    result.seconds = least / subject.population.count / (subject.duration + subject.settle)
  end
  return result
end

return trial
