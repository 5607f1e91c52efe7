--- agreement.lua: the check of a GPU before it is timed: every mass within a tolerance of its
--- position on the CPU. SI units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local failure = require "limax.base.failure"

local agreement = {}

--- Times of the check, s: long enough to fall, touch and bend, well before chaos.
agreement.SETTLE, agreement.DURATION, agreement.TIME_STEP = 0.05, 0.1, 1e-4

--- Largest distance of a mass between two devices after 1500 steps, m. The laws are the same source
--- on both, so that only the order of summing forces and the last bit of an inverse length differ.
--- In double that stays in the last bits (2e-15 m measured on an H200). In fp32 positions are
--- rounded to 6e-8 m at a metre, which 1500 steps add up to 1e-6 m. On the ground a rounding
--- decides when a mass touches and whether friction holds it, in every precision that rounds
--- forces: damped bodies stay within 4.4e-5 m on an H200; the CPU's own undamped `single` is
--- up to 3.4e-4 m from its `double` (10x10x10, symplectic Euler). The tolerances are three to ten
--- times what was measured.
function agreement.tolerance(precision, scene)
  if precision == "double" then return 2e-14 end
  if not scene.ground then return 1.1e-5 end
  return scene.damping and 3e-4 or 1e-3
end

-- Coordinates of all masses at the end, flat.
local function last_state(population, materials, precision, device)
  local simulation = engine.simulation(population, materials, engine.scene(bodies.ALL), {
    precision = precision, time_step = agreement.TIME_STEP, settle = agreement.SETTLE,
    duration = agreement.DURATION }, device)
  simulation:run()
  local coordinates = {}
  for robot = 1, population.count do
    local status = simulation:outcome(robot).status
    assert(status == "done", status)
    for _, row in ipairs((simulation:state(robot)):table()) do
      for axis = 1, 3 do coordinates[#coordinates + 1] = row[axis] end
    end
  end
  simulation:free()
  return coordinates
end

--- Compares a device with the CPU, with all effects, and raises if they differ too much.
---@return number worst distance over the tolerance
function agreement.check(materials, device, lattices, precisions)
  local cpu, worst = engine.device "cpu", 0
  for _, lattice in ipairs(lattices) do
    local population = bodies.population(materials, lattice, 2)
    for _, precision in ipairs(precisions) do
      local got = last_state(population, materials, precision, device)
      local expected = last_state(population, materials, precision, cpu)
      local allowed, off = agreement.tolerance(precision, bodies.ALL), 0
      for i, value in ipairs(expected) do off = math.max(off, math.abs(got[i] - value)) end
      if not (off <= allowed) then
        failure.raise(1, ("%dx%dx%d %s: a mass is %.3g m from its position on the CPU after %g s; "
          .. "%.3g m are allowed: nothing is timed"):format(lattice[1], lattice[2], lattice[3],
          precision, off, agreement.SETTLE + agreement.DURATION, allowed))
      end
      worst = math.max(worst, off / allowed)
    end
    population:free()
  end
  return worst
end

return agreement
