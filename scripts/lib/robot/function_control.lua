--- function_control.lua: a Lua function as the controller of a robot by hand, for trying things
--- out: `scene = { control = function(robot, t) ... end }`, or with fields of the effect
--- `control = { signal = function(robot, t) ... end, rate = 50 }`. One step before each tick it is
--- called with the robot in motion and the time of the tick (s), and returns the activation of all
--- voxels, or a list with one for each voxel of the lattice, x first.

local engine = require "limax.engine"
local output = require "limax.base.output"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local function_control = {}

-- The text whose state the function sets.
local SIGNAL = "a = s[0]; s[0] = s[0]; "

local any_number = schema.number {}
local warned = false

--- The scene that the engine takes, and the function that controls it; nil without one.
---@param scene any as a script wrote it
function function_control.split(scene)
  local control = type(scene) == "table" and scene.control
  local is_table = type(control) == "table"
  if is_table and control.signal == SIGNAL then
    engine.fail("simulate: a Lua function controlled the robot, which its file does not hold: give"
      .. " it again, as scene = { control = ... }")
  end
  local call = is_table and control.signal or control
  -- the engine's scene refuses a function of limax.control that was not called
  if type(call) ~= "function" or strict.name_of(call) then return scene, nil end
  for _, name in ipairs { "delay", "noise" } do
    if is_table and control[name] ~= nil then
      engine.fail(("scene: control.%s: it acts on the sensors that a text reads; a Lua function"
        .. " reads the robot in motion itself: remove it"):format(name))
    end
  end
  local own = { control = { signal = SIGNAL } }
  for name, effect in pairs(scene) do own[name] = own[name] or effect end
  for name, value in pairs(is_table and control or {}) do
    if name ~= "signal" then own.control[name] = value end
  end
  if not warned then
    warned = true
    output.warn("! control: a Lua function is called at each tick, on the CPU only: it is slow,"
      .. " for trying things out; texts and limax.control run everywhere\n")
  end
  return own, call
end

--- Calls `call` before the ticks of a simulation.
---@param simulation limax.simulation of one robot that has not begun
---@param call function
---@param rate number Hz
---@param voxels integer of the lattice
---@return fun(robot: limax.robot_in_motion): integer steps to do before it is called again
function function_control.caller(simulation, call, rate, voxels)
  local start = simulation:outcome(1)
  local tick = math.floor(1 / (rate * start.time_step) + 0.5)
  local settle = math.floor(-start.time / start.time_step + 0.5)
  if tick < 2 then
    engine.fail(("scene: control.rate: a function needs two steps between ticks; at steps of %.4g s"
      .. " the rate is at most %.6g Hz"):format(start.time_step,
      math.floor(1 / (2 * start.time_step))))
  end
  local list_rule = schema.list(any_number, { count = voxels,
    expected = ("a number, or a list of one for each of the %d voxels of the lattice")
      :format(voxels) })
  local number, due = 0, math.max(0, settle - 1)
  return function(robot)
    local now = simulation:outcome(1).step
    if now == due then
      local value = call(robot, number / rate)
      local path = "the function that is scene.control"
      if type(value) == "number" then
        value = schema.demand(any_number, value, path)
        local all = {}
        for voxel = 1, voxels do all[voxel] = value end
        value = all
      else
        value = schema.demand(list_rule, value, path)
      end
      simulation:set_state(1, 0, value)
      number = number + 1
      local next_tick = settle + number * tick
      due = next_tick < start.steps and next_tick - 1 or math.huge
    end
    return due - now
  end
end

return function_control
