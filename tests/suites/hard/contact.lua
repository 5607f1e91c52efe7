--- contact.lua: hard cases with the ground: rest, overlap, bounces and impacts. SI units.

local context = require "limax.tools.bench.hard_cases.context"
local invariants = require "limax.tools.bench.hard_cases.invariants"
local case = require("limax.tools.bench.hard_cases").suite "contact"

local LAND, GRAVITY, GROUND = context.LAND, context.GRAVITY, context.GROUND

case { row = 18, name = "rest on the ground", brief = true, run = function(c)
  local run = c:run { lattice = { 4, 4, 4 }, scene = LAND, duration = 8,
    materials = { b = { damping_ratio = 0.5 } }, record = { energy = 20 } }
  -- fp32 rounds positions below the ground to 1e-7 of a penetration, and forces of springs
  c:near("force of the ground", run:ground_force(), run:weight(),
    { rtol = { double = 1e-6, fp32 = 1e-4 } })
  local rows = run:trace "energy"
  c:at_most("kinetic energy", rows[#rows][1], { double = 1e-12, fp32 = 1e-7, single = 2e-6 })
  c:at_most("speed", run:fastest(), { double = 1e-6, fp32 = 1e-3 })
end }

case { row = 19, name = "grazing: masses exactly at z = 0", run = function(c)
  -- a depth of 0 is not a contact, and rounding of rest lengths causes no chatter
  local run = c:run { lattice = { 2, 2, 1 }, velocity = { 1, 0, 0 }, duration = 1,
    scene = { ground = true, friction = true, damping = true } }
  local rows = run:trace "energy"
  c:near("kinetic energy", rows[#rows][1], rows[1][1],
    { rtol = { double = 1e-12, fp32 = 1e-5, single = 1e-4 } })
  c:near("height", run:extent(3), 0, { atol = { double = 1e-13, fp32 = 1e-5, single = 3e-5 } })
  for _, v in ipairs(select(2, run:state())) do
    c:near("speed upwards", v[3], 0, { atol = { double = 1e-12, fp32 = 1e-4 } })
  end
end }

for _, depth in ipairs { 0.1, 1 } do
  case { row = 20, name = ("deep overlap: %g m below the ground"):format(depth), run = function(c)
    local stored, most = 0, 0
    local run = c:run { lattice = { 3, 3, 3 }, voxels = "s", scene = LAND, duration = 1,
      may_diverge = { "speed", "stretch" }, place = function(positions)
        for _, p in ipairs(positions) do
          p[3] = p[3] - depth
          stored = stored + 0.5 * GROUND * math.max(0, -p[3]) ^ 2
        end
      end }
    -- the penalty springs' energy comes out again
    for _, row in ipairs(run:trace "energy") do most = math.max(most, row[1]) end
    c:at_most("kinetic energy", most, stored)
    c:at_least("kinetic energy", most, 0.01 * stored)
    if run.verdict == "holds" then c:at_least("height", select(2, run:extent(3)), 0.2) end
  end }
end

-- A stiff voxel on a soft floor acts as a point; each of the four masses that touch carries two.
local FLOOR, MASS = 1e4, 0.1 -- N/m, kg

case { row = 21, name = "elastic bounce", run = function(c)
  local w, speed = math.sqrt(FLOOR / (2 * MASS)), math.sqrt(2 * GRAVITY)
  -- of -k z = 2 m (z'' + g) from z = 0 at -speed until z = 0 again
  local contact = 2 / w * (math.pi - math.atan(w * speed / GRAVITY))
  for _, fraction in ipairs { 0.9, 0.09 } do
    local run = c:prepare { lattice = { 1, 1, 1 }, bound_fraction = fraction,
      materials = { b = { stiffness = 1e6 } },
      scene = { gravity = true, ground = { stiffness = FLOOR, damping_ratio = 0 } },
      position = { 0, 0, 1 }, record = { center_of_mass = 1000, energy = 100 } }
    local h, steps = run:outcome().time_step, 0
    run:advance(math.floor(speed / GRAVITY / h) - 5)
    for _ = 1, 1.2 * contact / h + 10 do
      run:advance(1)
      if run:state()[1][3] < 0 then steps = steps + 1 end
    end
    run.simulation:run()
    invariants.check(c, run)
    local top, down = 0, false
    for _, row in ipairs(run:trace "center_of_mass") do
      down = down or row[3] < 0.1
      if down then top = math.max(top, row[3] - 0.05) end
    end
    -- where in a step it touches is random: errors are 2e-5 at 0.9, 3e-6 at 0.09, more in fp32
    c:near(("rebound at %g of the bound"):format(fraction), top, 1,
      { rtol = { double = 5e-5, fp32 = 1e-4, single = 1e-3 } })
    c:near(("contact at %g of the bound"):format(fraction), steps * h, contact,
      { atol = h, rtol = 2e-3 })
  end
end }

case { row = 22, name = "damped bounce", run = function(c)
  -- against the law of one mass: N = max(0, -k z - c z') until it leaves
  local zeta, speed = 0.2, 2
  local damping = 2 * zeta * math.sqrt(FLOOR * MASS)
  local function law(z, v) return math.max(0, -FLOOR * z - damping * v) / (2 * MASS) end
  local z, v, h = 0, -speed, 1e-6
  repeat
    local a = law(z, v)
    local middle = law(z + 0.5 * h * v, v + 0.5 * h * a)
    z, v = z + h * (v + 0.5 * h * a), v + h * middle
  until z > 0 or (v > 0 and law(z, v) == 0)
  local run = c:run { lattice = { 1, 1, 1 }, bound_fraction = 0.05, duration = 0.1,
    materials = { b = { stiffness = 1e6 } }, center = false, position = { 0, 0, 0.01 },
    velocity = { 0, 0, -speed }, scene = { ground = { stiffness = FLOOR, damping_ratio = zeta } } }
  local up = invariants.motion(run:state()).velocity[3]
  c:near("restitution", up / speed, v / speed, { rtol = 0.01 })
end }

for _, impact in ipairs { { 1, 300 }, { 3, 100 }, { 3, 300 } } do
  local size, speed = impact[1], impact[2]
  case { row = 23, name = ("impact at %g m/s, %dx%dx%d voxels"):format(speed, size, size, size),
    run = function(c)
      -- springs turn inside out and energy is lost; a torn spring may be reported
      local run = c:run { lattice = { size, size, size }, scene = LAND, duration = 0.3,
        -- placed, so that the automatic step does not see the speed
        place = function(positions, velocities)
          for i, p in ipairs(positions) do p[3], velocities[i][3] = p[3] + 0.5, -speed end
        end, record = { energy = 1000 }, may_diverge = { "stretch" } }
      local rows, outcome = run:trace "energy", run:outcome()
      local function whole(row) return row[1] + row[2] + row[3] end
      local most = 0
      for _, row in ipairs(rows) do most = math.max(most, whole(row) / whole(rows[1])) end
      -- a step of many edges sees the ground late: 1.06 was the most at 1.5 edges
      local edges = outcome.time_step * speed / 0.1
      c:at_most("largest energy over that of the start", most, 1 + 0.1 * edges)
      c:same_bits("coarse", outcome.coarse, edges > 0.1)
    end }
end

case { name = "a drop from 1 km", brief = true, run = function(c)
  local run = c:run { lattice = { 2, 2, 2 }, position = { 0, 0, 1000 }, duration = 25,
    scene = { gravity = true, ground = { damping_ratio = 1 }, friction = true, damping = true },
    materials = { b = { damping_ratio = 1 } }, record = { energy = 20 }, max_stretch = 100 }
  c:at_most("speed", run:fastest(), { double = 1e-2, fp32 = 2e-2 })
  -- plain fp32: speeds below 1e-7 m over the step move nothing, and the ground's damping takes
  -- their part of the weight
  c:near("force of the ground", run:ground_force(), run:weight(),
    { rtol = { double = 0.02, fp32 = 0.02, single = 0.2 } })
end }

case { row = 38, name = "resting on and on", brief = true, run = function(c)
  local h = 5e-4
  local run = c:run { lattice = { 1, 1, 1 }, scene = LAND, settle = 5, time_step = h,
    duration = h * (c.full and 1e7 or 1e5), position = { 1, 0, 0 },
    materials = { b = { damping_ratio = 0.5 } }, record = { energy = 1 } }
  for axis = 1, 3 do
    c:near("drift", run:moved(axis), 0, { atol = { double = 1e-9, fp32 = 1e-7, single = 1e-6 } })
  end
end }
