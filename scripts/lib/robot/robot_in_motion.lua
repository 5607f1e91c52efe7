--- robot_in_motion.lua: a robot that is simulated step by step: `robot:begin { ... }`. Ctrl-C acts
--- between steps, and the simulation can be continued. SI units; t = 0 is when actuation starts.

local engine = require "limax.engine"
local host = require "limax.host"
local output = require "limax.base.output"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local robot_in_motion = {}

-- s of wall time of one slice: Ctrl-C is noticed between slices
local SLICE = 0.05

---@class limax.robot_in_motion
---@field simulation limax.simulation the engine's, of this robot only
---@field time number s since t = 0, negative while the body settles
---@field steps integer done
---@field status "running"|"done"|"invalid"|"diverged" "done" at the end
local Moving = strict.methods "robot in motion"

-- Fields that are read from the engine each time, by the name that they have in an outcome.
local in_outcome = { time = "time", steps = "step", status = "status" }

local class = {}

function class.__index(self, key)
  if in_outcome[key] then return self.simulation:outcome(1)[in_outcome[key]] end
  return Moving[key] or strict.unknown("a robot in motion", key, in_outcome, Moving)
end

function class.__tostring(self)
  local now = self.simulation:outcome(1)
  local center = self:center()
  return ("robot in motion: %s, step %d of %d, t = %.4g s, centre of mass %.4g %.4g %.4g m"):format(
    now.status, now.step, now.steps, now.time or 0, center[1], center[2], center[3])
end

--- Makes the object. `finish` makes a scored robot of a simulation that has ended.
---@param finish fun(): limax.scored_robot
---@param control? function of function_control.lua; makes what calls a script's controller
---@return limax.robot_in_motion
function robot_in_motion.new(simulation, finish, control)
  -- the engine prepares a robot when it is first read
  simulation:state(1)
  return setmetatable({ simulation = simulation, finished = finish,
    controlled = control and control() or false }, class)
end

-- Advances by whole steps, in slices of wall time.
local function advance(self, steps, on_progress)
  local simulation = self.simulation
  local target = simulation:outcome(1).step + steps
  while true do
    local left = target - simulation:outcome(1).step
    if left <= 0 then return end
    if self.controlled and self.status == "running" then
      left = math.min(left, self.controlled(self))
    end
    local progress = simulation:advance(SLICE, left)
    if on_progress then on_progress(progress) end
    if progress.interrupted then
      host.raise_if_interrupted()
      error(host.interrupt, 0)
    end
    if progress.finished then return end
  end
end

--- Advances by whole steps, or fewer if the simulation ends.
---@param steps? integer 1 if absent
---@return limax.robot_in_motion self
function Moving:step(steps)
  steps = steps == nil and 1 or steps
  if type(steps) ~= "number" or steps < 1 or steps % 1 ~= 0 then
    engine.fail(("step: expected a whole number of steps from 1, got %s"):format(
      schema.show(steps)))
  end
  advance(self, steps)
  return self
end

local warned = false

--- Advances by a simulated time, rounded up to whole steps. The first `settle` seconds let the body
--- settle before t = 0.
---@param seconds number s
---@return limax.robot_in_motion self
function Moving:go(seconds)
  if type(seconds) ~= "number" or not (seconds > 0) then
    engine.fail(("go: expected seconds above 0, got %s"):format(schema.show(seconds)))
  end
  local before = self.simulation:outcome(1)
  local step, settle, time_step = before.step, -before.time, before.time_step
  -- a little less, so that rounding adds no step
  advance(self, math.ceil(seconds / time_step - 1e-6))
  if not warned and step == 0 and seconds > settle / 2 and self.time < time_step then
    warned = true
    output.warn(("! go: the body settles for %.4g s, and go(%.4g) ends at t = %.4g s, when muscles"
      .. " have not moved yet: begin { settle = 0 }, or go(%.4g)\n"):format(settle, seconds,
      math.abs(self.time) < 1e-9 and 0 or self.time, settle + seconds))
  end
  return self
end

--- Positions of the masses now, world coordinates, as a copy.
---@return limax.view positions [mass][3] m
function Moving:positions() return (self.simulation:state(1)) end

--- Velocities of the masses now, as a copy.
---@return limax.view velocities [mass][3] m/s
function Moving:velocities() return (select(2, self.simulation:state(1))) end

--- The mean of the masses' positions now: the centre of mass where all have the same mass, as with
--- the paper's materials.
---@return number[] { x, y, z } m
function Moving:center()
  local positions = self:positions()
  local sum, count = { 0, 0, 0 }, positions:size()
  for mass = 1, count do
    for axis = 1, 3 do sum[axis] = sum[axis] + positions[mass][axis] end
  end
  return { sum[1] / count, sum[2] / count, sum[3] / count }
end

--- Simulates to the end.
---@param progress? fun(progress: table)
---@return limax.scored_robot
function Moving:finish(progress)
  if self.controlled then advance(self, self.simulation:outcome(1).steps, progress) end
  self.simulation:run(progress)
  return self.finished()
end

return robot_in_motion
