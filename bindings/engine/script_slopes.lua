--- script_slopes.lua: how steep the scripted forces of a scene are at one moment, which their
--- bounds must cover. SI units.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local materials = require "limax.engine.materials"
local object = require "limax.engine.object"
local population = require "limax.engine.population"
local scene = require "limax.engine.scene"
local simulation = require "limax.engine.simulation"

local C = abi.C

---@class limax.script_slope
---@field name string of the effect
---@field bounded boolean does the scene state its bound?
---@field stated { stiffness: number, damping: number } N/m, N s/m
---@field found { stiffness: number, damping: number } largest |df/dx| and |df/dv| along an axis

--- Differences of each scripted force over a change of the place and of the velocity of each mass
--- of robot i.
---@param robots limax.population
---@param i integer
---@param table_of_materials limax.materials
---@param in_scene limax.scene
---@param options table fields of `simulation`, of which `edge` and `sharing` count
---@param running limax.simulation in which robot i is
---@param held? table<integer, boolean> masses that are left out
---@return limax.script_slope[]
local function script_slopes(robots, i, table_of_materials, in_scene, options, running, held)
  local what = "script_slopes"
  local population_handle, robot = object.entry(what .. ": population", robots, population.class, i)
  local materials_handle = object.handle(what .. ": materials", table_of_materials, materials.class)
  local scene_handle = object.handle(what .. ": scene", in_scene, scene.class)
  object.handle(what .. ": simulation", running, simulation.class)
  local positions, velocities = running:state(i)
  local x, v = positions:pointer(), velocities:pointer()
  for mass in pairs(held or {}) do
    -- the engine ignores slopes that are not numbers
    for c = 3 * mass - 3, 3 * mass - 1 do x[c], v[c] = 0 / 0, 0 / 0 end
  end
  local slopes = ffi.new("limax_script_slope[?]", C.LIMAX_MOST_SCRIPTS)
  local count = ffi.new "int32_t[1]"
  abi.check(C.limax_script_slopes(population_handle, robot, materials_handle, scene_handle,
    (simulation.options_of(options)), x, v, running:outcome(i).time, slopes, count), what)
  local list = {}
  for k = 1, count[0] do
    local slope = slopes[k - 1]
    list[k] = { name = ffi.string(slope.name), bounded = slope.bounded ~= 0,
      stated = { stiffness = slope.stated_stiffness, damping = slope.stated_damping },
      found = { stiffness = slope.stiffness, damping = slope.damping } }
  end
  return list
end

return script_slopes
