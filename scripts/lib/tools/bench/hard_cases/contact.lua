--- contact.lua: hard cases with the ground: rest, overlap, bounces and impacts. SI units.

local general = require "limax.tools.bench.hard_cases.general"

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

-- Why XPBD is not asked.
local DAMPS = "a long step damps motion, by what is measured in ACCURACY.md"

-- m/s^2, N/m: the engine's own defaults
local STANDARD_GRAVITY, GROUND = 9.81, 1e5
local LAND = { gravity = true, ground = true, friction = true, damping = true }

-- Sum over the masses of what the ground's penalty pushes back with, N.
local function pushed(positions, stiffness)
  local sum = 0
  for _, p in ipairs(positions) do sum = sum + (stiffness or GROUND) * math.max(0, -p[3]) end
  return sum
end

local function mean_height(positions)
  local sum = 0
  for _, p in ipairs(positions) do sum = sum + p[3] / #positions end
  return sum
end

-- Moves all masses by `up` m, and gives all the velocity `v` along z.
local function lifted(up, v)
  return function(positions, velocities)
    for i, p in ipairs(positions) do
      p[3] = p[3] + up
      velocities[i][3] = v or velocities[i][3]
    end
  end
end

case { row = 18, name = "rest on the ground", brief = true, run = function(c)
  local run = c:run { lattice = { 5, 5, 5 }, scene = LAND, duration = 10,
    materials = { b = { damping_ratio = 0.5 } }, record = { energy = 20 } }
  local positions = run:state()
  local outcome = run:outcome()
  local weight = STANDARD_GRAVITY * outcome.mass
  -- fp32: a place below the ground is rounded to 1e-7 of a penetration, a spring's pull to 1e-7 of
  -- what its rest length is rounded to
  c:near("force of the ground", pushed(positions), weight,
    { rtol = c:by_precision { double = 1e-6, fp32 = 1e-4 } })
  local rows = run:trace "energy"
  c:at_most("kinetic energy at rest", rows[#rows][1],
    c:by_precision { double = 1e-12, fp32 = 1e-7, single = 2e-6 })
  c:at_most("speed at rest", run:fastest(), c:by_precision { double = 1e-6, fp32 = 1e-3 })
  local below = 0
  for _, p in ipairs(positions) do below = below + math.max(0, -p[3]) / 36 end
  c:near("penetration", below, weight / (36 * GROUND),
    { rtol = c:by_precision { double = 1e-3, fp32 = 1e-3 } })
end }

case { row = 19, name = "grazing: masses exactly at z = 0", run = function(c)
  -- a depth of 0 is no contact. Springs whose rest lengths are rounded lift and lower masses by
  -- their rounding, which makes no chatter and takes no speed.
  local run = c:run { lattice = { 2, 2, 1 }, velocity = { 1, 0, 0 }, duration = 1,
    scene = { ground = true, friction = true, damping = true } }
  local rows = run:trace "energy"
  c:near("kinetic energy", rows[#rows][1], rows[1][1],
    { rtol = c:by_precision { double = 1e-12, fp32 = 1e-5, single = 1e-4 } })
  local positions, velocities = run:state()
  for i, p in ipairs(positions) do
    if i <= 9 then
      c:near("height", p[3], 0,
        { atol = c:by_precision { double = 1e-13, fp32 = 1e-5, single = 3e-5 } })
    end
    c:near("speed upwards", velocities[i][3], 0,
      { atol = c:by_precision { double = 1e-12, fp32 = 1e-4 } })
  end
end }

for _, depth in ipairs { 0.1, 1 } do
  case { row = 20, name = ("deep overlap: %g m below the ground"):format(depth), run = function(c)
    local stored = 0
    local run = c:run { lattice = { 3, 3, 3 }, voxels = "s", scene = LAND, duration = 1,
      may_diverge = { "speed", "stretch" },
      place = function(positions)
        for _, p in ipairs(positions) do
          p[3] = p[3] - depth
          stored = stored + 0.5 * GROUND * math.max(0, -p[3]) ^ 2
        end
      end }
    -- what comes out was stored in the penalty springs
    local most = 0
    for _, row in ipairs(run:trace "energy") do most = math.max(most, row[1]) end
    c:at_most("kinetic energy", most, stored)
    c:at_least("kinetic energy", most, 0.01 * stored)
    if run.verdict == "holds" then
      c:at_least("height", mean_height((run:state())), 0.1)
    end
  end }
end

case { row = 21, name = "elastic bounce", except = { xpbd = DAMPS }, run = function(c)
  -- There is no body of one mass. A stiff voxel on a soft floor without damping is a point that
  -- rebounds to where it came from, but for what it keeps in its own springs, some 1e-6 of it. Each
  -- of the four masses that touch carries two.
  local drop, k, mass = 1, 1e4, 0.1
  local w, speed = math.sqrt(k / (2 * mass)), math.sqrt(2 * STANDARD_GRAVITY * drop)
  -- -k z = 2 m (z'' + g) from z = 0 at -speed until z = 0 again
  local contact = 2 / w * (math.pi - math.atan(w * speed / STANDARD_GRAVITY))
  local function bounce(fraction)
    local run = c:prepare { lattice = { 1, 1, 1 }, bound_fraction = fraction,
      materials = { b = { stiffness = 1e6 } },
      scene = { gravity = true, ground = { stiffness = k, damping_ratio = 0 } },
      position = { 0, 0, drop }, duration = 1, record = { center_of_mass = 1000, energy = 100 } }
    local h = run:outcome().time_step
    run:advance(math.floor(speed / STANDARD_GRAVITY / h) - 5)
    local steps = 0
    for _ = 1, 1.2 * contact / h + 10 do
      run:advance(1)
      if run:state()[1][3] < 0 then steps = steps + 1 end
    end
    run.simulation:run()
    general.check(c, run)
    local top, down = 0, false
    for _, row in ipairs(run:trace "center_of_mass") do
      down = down or row[3] < 0.1
      if down then top = math.max(top, row[3] - 0.05) end
    end
    return top, steps * h, h
  end
  for _, fraction in ipairs { 0.9, 0.09 } do
    local top, lasted, h = bounce(fraction)
    -- Where in a step it touches is chance, so that the error has no sign and no clean order: at
    -- auto it is 2e-5, at a tenth 3e-6, in plain fp32 more, a centre's rounding and a sample's
    -- being 1 ms from the top (5e-6 m).
    c:near(("rebound at %g of the bound"):format(fraction), top, drop,
      { rtol = c:by_precision { double = 5e-5, fp32 = 1e-4, single = 1e-3 } })
    -- the voxel is not quite rigid; and whole steps are counted
    c:near(("contact at %g of the bound"):format(fraction), lasted, contact,
      { atol = h, rtol = 2e-3 })
  end
end }

case { row = 22, name = "damped bounce", run = function(c)
  -- the same, against the law of one mass: N = max(0, -k z - c z') until it leaves. Each of the
  -- four masses that touch carries two.
  local k, zeta, mass, speed = 1e4, 0.2, 0.1, 2
  local damping = 2 * zeta * math.sqrt(k * mass)
  local function law(z, v) return math.max(0, -k * z - damping * v) / (2 * mass) end
  local z, v, h = 0, -speed, 1e-7
  repeat
    local a = law(z, v)
    local middle = law(z + 0.5 * h * v, v + 0.5 * h * a)
    z, v = z + h * (v + 0.5 * h * a), v + h * middle
  until z > 0 or (v > 0 and law(z, v) == 0)
  local run = c:run { lattice = { 1, 1, 1 }, bound_fraction = 0.05,
    materials = { b = { stiffness = 1e6 } }, center = false,
    scene = { ground = { stiffness = k, damping_ratio = zeta } },
    place = lifted(0.01, -speed), duration = 0.1 }
  local _, velocities = run:state()
  local up = 0
  for _, row in ipairs(velocities) do up = up + row[3] / #velocities end
  c:near("restitution", up / speed, v / speed, { rtol = 0.01 })
  c:at_most("restitution", up / speed, 1)
end }

for _, size in ipairs { 1, 3 } do
  for _, speed in ipairs { 100, 300 } do
    case { row = 23, run = function(c)
      -- the body goes deep, springs turn inside out, and what is left afterwards is less than what
      -- came (the general check). A report of a spring that is torn is an answer too.
      local run = c:run { lattice = { size, size, size }, scene = LAND, duration = 0.3,
        place = lifted(0.5, -speed), record = { energy = 1000 }, may_diverge = { "stretch" } }
      local rows, outcome = run:trace "energy", run:outcome()
      local function whole(row) return row[1] + row[2] + row[3] end
      local most = 0
      for _, row in ipairs(rows) do most = math.max(most, whole(row) / whole(rows[1])) end
      -- a step of so many edges sees the ground late: 1.06 was the most at 1.5 edges
      local edges = outcome.time_step * speed / 0.1
      c:at_most("largest energy over that of the start", most, 1 + 0.1 * edges)
      -- and it is said
      c:same_bits("coarse", outcome.coarse, edges > 0.1)
      c:note("%.2g edges a step; the energy is %.4g of the first at most, %.2g at the end", edges,
        most, whole(rows[#rows]) / whole(rows[1]))
    end, name = ("impact at %g m/s, %s"):format(speed,
      size == 1 and "one voxel" or "3x3x3 voxels") }
  end
end

case { name = "a drop from 1 km", run = function(c)
  local function rest(height)
    local run = c:run { lattice = { 2, 2, 2 }, scene = { gravity = true,
      ground = { damping_ratio = 1 }, friction = true, damping = true },
      position = { 0, 0, height },
      materials = { b = { damping_ratio = 1 } },
      duration = height == 1 and 6 or 40, record = { energy = 20 }, max_stretch = 100 }
    local positions = run:state()
    c:at_most("speed", run:fastest(), c:by_precision { double = 1e-2, fp32 = 2e-2 })
    return pushed(positions), 9.81 * run:outcome().mass
  end
  -- it hits at 140 m/s
  for _, height in ipairs { 1, 1000 } do
    local got, weight = rest(height)
    -- plain fp32 2 m from its own origin: a speed below 1e-7 m over the step moves nothing, and
    -- the ground's damping takes that part of the weight, which a depth does not show
    c:near(("force of the ground after %g m"):format(height), got, weight,
      { rtol = c:by_precision { fp32 = 0.02, double = 0.02, single = 0.2 } })
  end
end, brief = true }

case { row = 46, name = "on its back", run = function(c)
  -- turned by half a turn about x: the same weight on the same ground
  local function force(turn)
    local run = c:run { lattice = { 3, 3, 2 }, scene = LAND, duration = 6,
      voxels = function(x, y, z) return z == 1 and (x + y) % 2 == 0 and "." or "s" end,
      materials = { s = { damping_ratio = 1, stiffness = 1e4 } }, record = { energy = 20 },
      place = function(positions)
        for _, p in ipairs(positions) do
          if turn then p[2], p[3] = 0.3 - p[2], 0.2 - p[3] end
        end
      end }
    local positions = run:state()
    c:at_most("speed", run:fastest(), c:by_precision { double = 1e-4, fp32 = 1e-3 })
    return pushed(positions), 9.81 * run:outcome().mass
  end
  for _, turn in ipairs { false, true } do
    local got, weight = force(turn)
    c:near("force of the ground", got, weight, { rtol = 1e-3 })
  end
end }

case { row = 38, name = "resting on and on", brief = true, run = function(c)
  local steps, h = c.full and 1e7 or 1e5, 5e-4
  -- at rest first, so that the drift is none of settling down
  local run = c:run { lattice = { 1, 1, 1 }, scene = LAND, settle = 5, duration = steps * h,
    time_step = h, position = { 1, 0, 0 }, materials = { b = { damping_ratio = 0.5 } },
    record = { energy = 1 } }
  local outcome = run:outcome()
  for axis = 1, 3 do
    c:near("drift", outcome.center_end[axis], outcome.center_start[axis],
      { atol = c:by_precision { double = 1e-9, fp32 = 1e-7, single = 1e-6 } })
  end
end }

return cases
