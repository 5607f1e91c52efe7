--- flight.lua: hard cases without contact, where motion has a closed form. SI units.

local context = require "limax.tools.bench.hard_cases.context"
local invariants = require "limax.tools.bench.hard_cases.invariants"
local case = require("limax.tools.bench.hard_cases").suite "flight"

-- Largest change of a length between masses during a run, in edges.
local function largest_strain(run)
  local most = 0
  for _, row in ipairs(run:trace "strain") do most = math.max(most, row[2]) end
  return most
end

case { row = 1, name = "free fall", smooth = true, run = function(c)
  local run = c:run { lattice = { 3, 3, 3 }, scene = { gravity = true, damping = true },
    duration = 2, record = { strain = 20 } }
  c:at_most("strain", largest_strain(run), { double = 1e-12, fp32 = 2e-5 })
  local h, n = run:outcome().time_step, run:outcome().steps
  c:near("height fallen", -run:moved(3), 0.5 * context.GRAVITY * h * h
    * (c.integrator == "symplectic_euler" and n * (n + 1) or n * n),
    { rtol = { double = 1e-12, fp32 = 1e-6, single = 1e-3 } })
  c:near("mean speed", invariants.motion(run:state()).velocity[3], -context.GRAVITY * h * n,
    { rtol = { double = 1e-12, fp32 = 1e-6, single = 1e-5 } })
end }

case { row = 2, name = "free flight without gravity", smooth = true, brief = true,
  run = function(c)
    local steps, velocity = c.full and 1e6 or 4e4, { 3, -2, 1 }
    local run = c:run { lattice = { 2, 2, 2 }, voxels = "s", scene = { damping = true },
      velocity = velocity, time_step = 5e-4, duration = 5e-4 * steps, record = { strain = 1 },
      center_tolerance = 10 }
    c:at_most("strain", largest_strain(run), { double = 1e-10, fp32 = 3e-5 })
    local off, now = 0, invariants.motion(run:state()).velocity
    for axis = 1, 3 do off = off + (now[axis] - velocity[axis]) ^ 2 end
    -- in plain sums rounded rest lengths kick 1e6 times; a few parts in 1e5 remain
    c:at_most("change of momentum over momentum", math.sqrt(off / 14),
      { double = 1e-13, fp32 = 1e-8, single = 1e-4 })
  end }

case { row = 3, name = "free spin, undamped", brief = true, run = function(c)
  local first
  local run = c:run { lattice = { 2, 2, 2 }, voxels = "s", scene = {}, time_step = 5e-4,
    duration = 5e-4 * (c.full and 1e6 or 4e4), center_tolerance = c.full and 20 or 1,
    place = function(positions, velocities)
      for i, p in ipairs(positions) do
        velocities[i] = { -5 * (p[2] - 0.1), 5 * (p[1] - 0.1), 0 }
      end
      first = invariants.motion(positions, velocities)
    end }
  c:near("angular momentum", invariants.motion(run:state()).spin[3], first.spin[3],
    { rtol = { double = 1e-11, fp32 = 1e-6, single = 5e-5 } })
  -- the spin stretches the body; kinetic and elastic energy oscillate and keep their sum
  local rows = run:trace "energy"
  local share = math.floor(#rows / 10)
  local function mean(from, to)
    local sum = 0
    for i = from, to do sum = sum + (rows[i][1] + rows[i][2]) / (to - from + 1) end
    return sum
  end
  c:near("energy", mean(#rows - share, #rows), mean(1, share),
    { rtol = { double = 1e-6, fp32 = 5e-5, single = 1e-4 } })
end }

case { row = 40, name = "far from the origin, the same motion", run = function(c)
  local function ends_at(x)
    local run = c:run { lattice = { 2, 2, 2 }, position = { x, 0, 0.02 }, duration = 0.5,
      voxels = function(vx, vy, vz) return (vx + vy + vz) % 2 == 0 and "e" or "b" end,
      scene = { gravity = true, ground = true, friction = true, damping = true, actuation = true } }
    local positions = run:state()
    for _, p in ipairs(positions) do p[1] = p[1] - x end
    return positions
  end
  local here = ends_at(0)
  -- the robot's own coordinates have the same bits; subtracting the start rounds them to a double
  for _, away in ipairs { 10, 1e3, 1e4, 1e5, 1e8 } do
    c:near_rows(("%g m away"):format(away), ends_at(away), here, 4e-16 * away + 1e-15)
  end
end }

case { row = 50, name = "turned by 37 degrees about z", smooth = true, run = function(c)
  local spec = { lattice = { 3, 2, 2 }, duration = 0.5,
    voxels = function(x, y, z)
      local k = (x + 2 * y + z) % 4 + 1
      return ("ecsb"):sub(k, k)
    end, scene = { gravity = true, damping = true, actuation = true } }
  local cosine, sine = math.cos(math.rad(37)), math.sin(math.rad(37))
  local function turn(positions)
    for i, p in ipairs(positions) do
      positions[i] = { cosine * p[1] - sine * p[2], sine * p[1] + cosine * p[2], p[3] }
    end
    return positions
  end
  local straight = turn(c:run(spec):state())
  spec.place = function(positions) turn(positions) end
  c:near_rows("turned", (c:run(spec):state()), straight,
    { double = 1e-9, fp32 = 3e-5, single = 3e-4 })
end }

case { row = 51, name = "time reversal", smooth = true, run = function(c)
  -- distance from the start after `count` steps forth and as many back
  local function there_and_back(step, count)
    local start
    local spec = { lattice = { 2, 2, 2 }, voxels = "s", scene = {}, time_step = step, duration = 1,
      energy = false, place = function(positions, velocities)
        for i, p in ipairs(positions) do
          velocities[i] = { 0.3 * math.sin(7 * i), 0.3 * math.cos(5 * i), 0.2 * math.sin(3 * i) }
          p[1] = p[1] + 0.005 * math.sin(11 * i)
        end
        start = positions
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
      for axis = 1, 3 do most = math.max(most, math.abs(p[axis] - start[i][axis])) end
    end
    return most
  end
  local off = there_and_back(5e-4, 400)
  if c.integrator == "symplectic_euler" then
    -- not its own inverse: an error of first order in the step
    c:at_most("distance from the start", off, 0.02)
    c:near("ratio of the distances at h and h / 2", off / there_and_back(2.5e-4, 800), 2,
      { atol = 0.3 })
  elseif c.integrator == "leapfrog" then
    c:at_most("distance from the start", off, { double = 1e-10, fp32 = 3e-5, single = 3e-4 })
  else
    c:at_most("distance from the start", off, 1e-3)
  end
end }

case { row = 55, name = "denormal speeds", smooth = true, run = function(c)
  -- a denormal may be kept or flushed, and must decay to nothing
  local kick = c.precision == "double" and 1e-310 or 1e-42
  local function ends(speed)
    local run = c:run { lattice = { 1, 1, 1 }, voxels = "s", scene = { damping = true },
      duration = 1, place = function(_, velocities)
        for i = 1, #velocities do velocities[i] = { (i % 2 == 0 and 1 or -1) * speed, 0, 0 } end
      end }
    return select(2, run:state())
  end
  local still = ends(0)
  -- rest lengths rounded to fp32 pull by their rounding
  for _, v in ipairs(still) do
    for axis = 1, 3 do c:at_most("speed", math.abs(v[axis]), { double = 1e-14, fp32 = 1e-5 }) end
  end
  c:near_rows("speed with the denormal", ends(kick), still, 0)
end }
