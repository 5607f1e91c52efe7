--- reconstruction.lua: a population stepped by a reconstruction of the scheme that the paper
--- sketches (engine/bench/reconstruction.h), to compare speeds with. Needs a GPU. SI units.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local object = require "limax.engine.object"
local simulation = require "limax.engine.simulation"

ffi.cdef [[
limax_status limax_bench_reconstruction(limax_device *, const limax_population *,
  const limax_materials *, const limax_scene *, const limax_simulation_options *, int64_t steps,
  double *seconds, double center[3]);
]]

local reconstruction = {}

local function handle(value) return object.handle("reconstruction", value, getmetatable(value)) end

--- Steps every robot from the start.
---@param robots limax.population of one shape
---@param scene limax.scene with exactly the effects of bodies.ALL
---@param options table as of engine.simulation: symplectic Euler, single precision, a time step
---@param steps integer of each robot
---@return number seconds GPU time of the steps, the least of three runs
---@return number[] center centre of mass of the first robot at the end, m
function reconstruction.run(robots, materials, scene, options, steps, device)
  local seconds, center = ffi.new "double[1]", ffi.new "double[3]"
  abi.check(abi.C.limax_bench_reconstruction(handle(device), handle(robots), handle(materials),
    handle(scene), simulation.options_of(options), steps, seconds, center), "reconstruction")
  return seconds[0], { center[0], center[1], center[2] }
end

return reconstruction
