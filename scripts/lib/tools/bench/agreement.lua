--- agreement.lua: the tolerance between a GPU and the CPU, and the check of it. SI units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local host = require "limax.host"

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

-- Positions and velocities of all robots at the end, flat.
local function last_state(population, materials, precision, device)
  local simulation = engine.simulation(population, materials, engine.scene(bodies.ALL), {
    precision = precision, time_step = agreement.TIME_STEP, settle = agreement.SETTLE,
    duration = agreement.DURATION }, device)
  simulation:run()
  local places, text = {}, {}
  for robot = 1, population.count do
    local status = simulation:outcome(robot).status
    assert(status == "done", status)
    for k, view in ipairs { simulation:state(robot) } do
      for _, row in ipairs(view:table()) do
        for _, value in ipairs(row) do
          if k == 1 then places[#places + 1] = value end
          text[#text + 1] = ("%a"):format(value)
        end
      end
    end
  end
  simulation:free()
  return places, host.sha256(table.concat(text, " "))
end

--- Compares a device with the CPU, with all effects, and raises if they differ too much.
---@param lattices integer[][]
---@param precisions string[]
---@return table<string, string> hashes of the last state on the device, by "5x5x5 single"
---@return number worst distance over the tolerance
function agreement.check(materials, device, lattices, precisions)
  local cpu, hashes, worst = engine.device "cpu", {}, 0
  for _, lattice in ipairs(lattices) do
    local population = bodies.population(materials, lattice, 2)
    for _, precision in ipairs(precisions) do
      local name = ("%dx%dx%d %s"):format(lattice[1], lattice[2], lattice[3], precision)
      local got, hash = last_state(population, materials, precision, device)
      local expected = last_state(population, materials, precision, cpu)
      local allowed, off = agreement.tolerance(precision, bodies.ALL), 0
      for i, value in ipairs(expected) do off = math.max(off, math.abs(got[i] - value)) end
      if not (off <= allowed) then
        error(("%s: a mass is %.3g m from its position on the CPU after %g s; %.3g m are allowed: "
          .. "nothing is timed"):format(name, off, agreement.SETTLE + agreement.DURATION, allowed),
          0)
      end
      hashes[name], worst = hash, math.max(worst, off / allowed)
    end
    population:free()
  end
  return hashes, worst
end

return agreement
