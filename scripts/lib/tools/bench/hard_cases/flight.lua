--- flight.lua: hard cases without contact: nothing but gravity and springs, where physics has a
--- closed form. SI units.

local general = require "limax.tools.bench.hard_cases.general"

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

-- Why XPBD is not asked.
local DAMPS = "a long step damps motion, by what is measured in ACCURACY.md"

-- m/s^2, the engine's own default
local STANDARD_GRAVITY = 9.81

-- Centre, angular momentum about it and kinetic energy of masses of 1 kg.
local function motion(positions, velocities)
  local center, momentum, spin, kinetic = { 0, 0, 0 }, { 0, 0, 0 }, { 0, 0, 0 }, 0
  for i, p in ipairs(positions) do
    for axis = 1, 3 do
      center[axis] = center[axis] + p[axis] / #positions
      momentum[axis] = momentum[axis] + velocities[i][axis]
      kinetic = kinetic + 0.5 * velocities[i][axis] ^ 2
    end
  end
  for i, p in ipairs(positions) do
    local x, y, z = p[1] - center[1], p[2] - center[2], p[3] - center[3]
    local u, v, w = unpack(velocities[i])
    spin[1] = spin[1] + y * w - z * v
    spin[2] = spin[2] + z * u - x * w
    spin[3] = spin[3] + x * v - y * u
  end
  return { center = center, momentum = momentum, spin = spin, kinetic = kinetic }
end

-- Turns a body at `rate` rad/s about the z axis through its centre.
local function spinning(rate)
  return function(positions, velocities)
    local center = motion(positions, velocities).center
    for i, p in ipairs(positions) do
      velocities[i] = { -rate * (p[2] - center[2]), rate * (p[1] - center[1]), 0 }
    end
  end
end

-- How far lengths between masses are from those of the start, as a share of an edge.
local function largest_strain(run)
  local rows, most = run:trace "strain", 0
  for _, row in ipairs(rows) do most = math.max(most, row[2]) end
  return most
end

case { row = 1, name = "free fall", smooth = true, run = function(c)
  local run = c:run { lattice = { 3, 3, 3 }, scene = { gravity = true, damping = true },
    duration = 2, record = { strain = 20 } }
  -- every mass has the same kick: in fp32 a length is rounded at a place of up to 4 m
  c:at_most("strain", largest_strain(run), c:by_precision { double = 1e-12, fp32 = 2e-5 })
  local outcome = run:outcome()
  local n = outcome.steps
  local expected = 0.5 * STANDARD_GRAVITY * outcome.time_step ^ 2
    * (general.WHOLE_KICKS[c.integrator] and n * (n + 1) or n * n)
  c:near("height fallen", outcome.center_start[3] - outcome.center_end[3], expected,
    { rtol = c:by_precision { double = 1e-12, compensated = 1e-6, mixed = 1e-6, single = 1e-3 } })
  -- what rounding makes a mass vibrate by is in no mean
  local positions, velocities = run:state()
  c:near("mean speed", motion(positions, velocities).momentum[3] / #positions,
    -STANDARD_GRAVITY * outcome.time_step * n, { rtol = c:by_precision { double = 1e-12,
      compensated = 1e-6, mixed = 1e-6, single = 1e-5 } })
end }

-- A velocity that gets n kicks of nothing but rounding is off by about sqrt(n) roundings.
case { row = 2, name = "free flight without gravity", smooth = true, brief = true,
  run = function(c)
    local steps = c.full and 1e6 or 4e4
    local run = c:run { lattice = { 2, 2, 2 }, voxels = "s", scene = { damping = true },
      velocity = { 3, -2, 1 }, time_step = 5e-4, duration = 5e-4 * steps,
      record = { strain = 1 }, center_tolerance = 10 }
    c:at_most("strain", largest_strain(run), c:by_precision { double = 1e-10, fp32 = 3e-5 })
    local positions, velocities = run:state()
    local now, off, whole = motion(positions, velocities), 0, 0
    for axis, expected in ipairs { 3, -2, 1 } do
      off = off + (now.momentum[axis] / #positions - expected) ^ 2
      whole = whole + expected ^ 2
    end
    -- plain sums: 1e6 kicks of 1e-7 of a rest length's rounding, of which a few parts in 1e5 stay
    c:at_most("change of momentum over momentum", math.sqrt(off / whole),
      c:by_precision { double = 1e-13, fp32 = 1e-8, single = 1e-4 })
  end }

case { row = 3, name = "free spin, undamped", brief = true,
  except = { xpbd = DAMPS }, run = function(c)
  local first
  local steps = c.full and 1e6 or 4e4
  local run = c:run { lattice = { 2, 2, 2 }, voxels = "s", scene = {}, time_step = 5e-4,
    duration = 5e-4 * steps, center_tolerance = c.full and 20 or 1,
    place = function(positions, velocities)
      spinning(5)(positions, velocities)
      first = motion(positions, velocities)
    end }
  local last = motion(run:state())
  c:near("angular momentum", last.spin[3], first.spin[3],
    { rtol = c:by_precision { double = 1e-11, fp32 = 1e-6, single = 5e-5 } })
  -- the spin stretches the body, and what that takes oscillates between springs and masses:
  -- the sum of both is what is kept
  local rows = run:trace "energy"
  local share = math.floor(#rows / 10)
  local function mean_of(from, to)
    local sum = 0
    for i = from, to do sum = sum + (rows[i][1] + rows[i][2]) / (to - from + 1) end
    return sum
  end
  c:near("energy", mean_of(#rows - share, #rows), mean_of(1, share),
    { rtol = c:by_precision { double = 1e-6, fp32 = 5e-5, single = 1e-4 } })
end }

for _, how in ipairs {
  { "no gravity", { 0, 0, 0 } }, { "gravity reversed", { 0, 0, 9.81 } },
  { "1000 g", { 0, 0, -9810 } }, { "gravity along x", { 9.81, 0, 0 } },
} do
  case { name = how[1], smooth = true, run = function(c)
    -- the general checks know where the centre goes; a body that falls freely keeps its shape
    local run = c:run { lattice = { 3, 2, 2 }, voxels = "s", duration = 0.1,
      scene = { gravity = { acceleration = how[2] }, damping = true }, record = { strain = 20 } }
    c:at_most("strain", largest_strain(run), c:by_precision { double = 1e-12, fp32 = 1e-4 })
  end }
end

case { row = 40, name = "far from the origin, the same motion", run = function(c)
  local function ends_at(x)
    local run = c:run { lattice = { 2, 2, 2 },
      voxels = function(vx, vy, vz) return (vx + vy + vz) % 2 == 0 and "e" or "b" end,
      scene = { gravity = true, ground = true, friction = true, damping = true, actuation = true },
      position = { x, 0, 0.02 }, duration = 0.5 }
    local positions = run:state()
    for _, p in ipairs(positions) do p[1] = p[1] - x end
    return positions
  end
  local here = ends_at(0)
  -- an origin at a whole multiple of 2 m gives the same bits of the robot's own coordinates; taking
  -- the distance off again rounds them to that of a double at 10^5 m
  for _, away in ipairs { 10, 1e3, 1e4, 1e5, 1e8 } do
    local there = ends_at(away)
    for mass, p in ipairs(here) do
      for axis = 1, 3 do
        c:near(("%g m away: mass %d"):format(away, mass), there[mass][axis], p[axis],
          { atol = 4e-16 * away + 1e-15 })
      end
    end
  end
end }

case { row = 50, name = "turned by 37 degrees about z", smooth = true, run = function(c)
  local spec = { lattice = { 3, 2, 2 }, duration = 0.5,
    voxels = function(x, y, z) return ("ecsb"):sub((x + 2 * y + z) % 4 + 1, (x + 2 * y + z) % 4 + 1)
    end, scene = { gravity = true, damping = true, actuation = true } }
  local straight = c:run(spec):state()
  local cosine, sine = math.cos(math.rad(37)), math.sin(math.rad(37))
  local function turned(p) return { cosine * p[1] - sine * p[2], sine * p[1] + cosine * p[2], p[3] }
  end
  spec.place = function(positions)
    for i, p in ipairs(positions) do positions[i] = turned(p) end
  end
  local allowed = c:by_precision { double = 1e-9, fp32 = 3e-5, single = 3e-4 }
  for mass, p in ipairs((c:run(spec):state())) do
    local expected = turned(straight[mass])
    for axis = 1, 3 do
      c:near(("mass %d"):format(mass), p[axis], expected[axis], { atol = allowed })
    end
  end
end }

case { row = 51, name = "time reversal", smooth = true, except = { xpbd = DAMPS }, run = function(c)
  local steps, h = 400, 5e-4
  local function there_and_back(step, count)
    local begin
    local spec = { lattice = { 2, 2, 2 }, voxels = "s", scene = {}, time_step = step, duration = 1,
      energy = false, place = function(positions, velocities)
        for i, p in ipairs(positions) do
          velocities[i] = { 0.3 * math.sin(7 * i), 0.3 * math.cos(5 * i), 0.2 * math.sin(3 * i) }
          p[1] = p[1] + 0.005 * math.sin(11 * i)
        end
        begin = positions
      end }
    local forth = c:prepare(spec)
    forth:advance(count)
    local positions, velocities = forth:state()
    spec.place = function(p, v)
      for i = 1, #p do
        p[i], v[i] = positions[i], { -velocities[i][1], -velocities[i][2], -velocities[i][3] }
      end
    end
    local back = c:prepare(spec)
    back:advance(count)
    local most = 0
    for i, p in ipairs((back:state())) do
      for axis = 1, 3 do most = math.max(most, math.abs(p[axis] - begin[i][axis])) end
    end
    return most
  end
  local off = there_and_back(h, steps)
  if c.integrator == "symplectic_euler" then
    -- it is not its own inverse: it comes back to an error of first order in the step, which half
    -- the step halves
    local finer = there_and_back(h / 2, 2 * steps)
    c:at_most("distance from the start", off, 0.02)
    c:near("ratio of the distances at h and h / 2", off / finer, 2, { atol = 0.3 })
  elseif c.integrator == "leapfrog" then
    -- single: roundings of 800 steps at 0.1 m
    c:at_most("distance from the start", off,
      c:by_precision { double = 1e-10, compensated = 3e-5, mixed = 3e-5, single = 3e-4 })
  else
    -- order 4 of the step over the period of the stiffest mode
    c:at_most("distance from the start", off, c:by_precision { double = 1e-3, fp32 = 1e-3 })
  end
end }

case { row = 55, name = "denormal speeds", smooth = true, run = function(c)
  -- A denormal of the state's precision may be kept or flushed, and decays: what is left of it is
  -- what a run has that a run without it lacks. That a denormal makes no step slow is no test of
  -- ours: none asserts a speed.
  local kick = (c.precision == "double" or c.precision == "mixed") and 1e-310 or 1e-42
  local function ends(speed)
    local run = c:run { lattice = { 1, 1, 1 }, voxels = "s", scene = { damping = true },
      duration = 1, place = function(_, velocities)
        for i = 1, #velocities do velocities[i] = { (i % 2 == 0 and 1 or -1) * speed, 0, 0 } end
      end }
    return select(2, run:state())
  end
  local still = ends(0)
  for i, v in ipairs(ends(kick)) do
    for axis = 1, 3 do
      -- at rest lengths of sqrt(2) h that are rounded to fp32 a spring pulls by its rounding
      c:at_most("speed", math.abs(v[axis]), c:by_precision { double = 1e-14, fp32 = 1e-5 })
      c:at_most("speed that is left", math.abs(v[axis] - still[i][axis]), 0)
    end
  end
end }

return cases
