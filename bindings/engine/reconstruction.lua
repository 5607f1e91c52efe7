--- reconstruction.lua: a population stepped by a reconstruction of the scheme that the paper
--- sketches, to compare speeds with: a thread per spring, then a thread per mass; shared-memory
--- float atomics are our assumption. On a GPU alone. SI units.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local device = require "limax.engine.device"
local materials = require "limax.engine.materials"
local memory = require "limax.engine.memory"
local object = require "limax.engine.object"
local population = require "limax.engine.population"
local scene = require "limax.engine.scene"
local schema = require "limax.engine.schema"
local simulation = require "limax.engine.simulation"

local C = abi.C

--- Steps every robot from the start. The options are a simulation's, and must be symplectic Euler
--- in single precision. Nothing looks for divergence.
---@param robots limax.population
---@param table_of_materials limax.materials
---@param in_scene limax.scene
---@param options table as of engine.simulation
---@param steps integer of each robot
---@param on limax.device|nil
---@return number seconds that the GPU took for the steps, the least of three runs
---@return number[][] centers centre of mass at the end, [robot][3], m
local function reconstruction(robots, table_of_materials, in_scene, options, steps, on)
  local what = "reconstruction"
  local population_handle = object.handle(what .. ": population", robots, population.class)
  local materials_handle = object.handle(what .. ": materials", table_of_materials, materials.class)
  local scene_handle = object.handle(what .. ": scene", in_scene, scene.class)
  local o = simulation.options_of(options)
  steps = schema.demand(schema.whole(1, 1e9), steps, what .. ": steps")
  local target = device.handle(what, on)
  memory.collect()
  local seconds = ffi.new "double[1]"
  local center = ffi.new("double[?]", 3 * robots.count)
  abi.check(C.limax_reconstruction_run(target, population_handle, materials_handle, scene_handle, o,
    steps, seconds, center), what)
  local centers = {}
  for i = 1, robots.count do
    local first = 3 * (i - 1)
    centers[i] = { center[first], center[first + 1], center[first + 2] }
  end
  return seconds[0], centers
end

return { reconstruction = reconstruction }
