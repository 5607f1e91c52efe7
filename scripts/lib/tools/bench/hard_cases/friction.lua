--- friction.lua: hard cases of Coulomb friction. A slope is flat ground under tilted gravity. SI
--- units.

local general = require "limax.tools.bench.hard_cases.general"

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

local STANDARD_GRAVITY, GROUND = 9.81, 1e5 -- m/s^2, N/m

-- A flat, well damped sheet: it does not topple, and its masses load the ground alike.
local SHEET = { lattice = { 4, 4, 1 }, voxels = "b",
  materials = { b = { damping_ratio = 1 } } }

local function with(fields)
  local spec = {}
  for name, value in pairs(SHEET) do spec[name] = value end
  for name, value in pairs(fields) do spec[name] = value end
  return spec
end

local function both(mu) return { static = mu, kinetic = mu } end

-- Gravity on a slope of `angle` rad, downhill along `heading` rad.
local function slope(angle, heading)
  heading = heading or 0
  local along = STANDARD_GRAVITY * math.sin(angle)
  return { acceleration = { along * math.cos(heading), along * math.sin(heading),
    -STANDARD_GRAVITY * math.cos(angle) } }
end

-- Centre of mass at each sample.
local function path_of(run) return run:trace "center_of_mass" end

local MU = 0.5

for _, how in ipairs { { 1, nil }, { 0.25, " at a quarter of the step" } } do
  case { row = 24, name = "holds half a degree below the angle of friction" .. (how[2] or ""),
    brief = true, run = function(c)
      local seconds = c.full and 60 or 5
      local run = c:run(with { settle = 2, duration = seconds, bound_fraction = 0.9 * how[1],
        scene = { gravity = slope(math.atan(MU) - math.rad(0.5)), ground = true, damping = true,
          friction = both(MU) } })
      local outcome = run:outcome()
      for axis = 1, 2 do
        c:at_most("creep (m/s)",
          math.abs(outcome.center_end[axis] - outcome.center_start[axis]) / outcome.time, 1e-5)
      end
    end }
end

for _, degrees in ipairs { 0.5, 2 } do
  case { row = 25, name = ("slides %g degrees above the angle of friction"):format(degrees),
    run = function(c)
      local angle = math.atan(MU) + math.rad(degrees)
      local run = c:run(with { settle = 1, duration = 2, record = { center_of_mass = 20 },
        scene = { gravity = slope(angle), ground = true, damping = true, friction = both(MU) } })
      local path = path_of(run)
      -- the second difference over the last second: the first is its start
      local n = 10
      local a = (path[#path][1] - 2 * path[#path - n][1] + path[#path - 2 * n][1]) / (n / 20) ^ 2
      c:near("acceleration", a,
        STANDARD_GRAVITY * (math.sin(angle) - MU * math.cos(angle)), { rtol = 0.02 })
    end }
end

-- Puts the sheet where it rests, so that it neither falls nor bounces, at `speed` along `heading`.
local function resting(speed, heading)
  return function(positions, velocities)
    -- each of the 25 columns of two masses stands on its lower one
    local deep = 2 * 0.1 * STANDARD_GRAVITY / GROUND
    for i, p in ipairs(positions) do
      p[3] = p[3] - deep
      velocities[i] = { speed * math.cos(heading or 0), speed * math.sin(heading or 0), 0 }
    end
  end
end

for _, mu in ipairs { 0.2, 0.4, 0.7 } do
  case { row = 26, name = ("stopping distance at mu = %g"):format(mu), run = function(c)
    local speed = 2
    local run = c:run(with { duration = 2.5, place = resting(speed), energy = false,
      scene = { gravity = true, ground = true, damping = true, friction = both(mu) } })
    local outcome = run:outcome()
    c:near("distance", outcome.center_end[1] - outcome.center_start[1],
      speed ^ 2 / (2 * mu * STANDARD_GRAVITY), { rtol = 0.01 })
  end }
end

case { row = 27, name = "the same distance in twelve directions", run = function(c)
  local speed, mu = 1, 0.4
  local first
  for twelfth = 0, 11 do
    local heading = twelfth * math.pi / 6
    local run = c:run(with { duration = 0.6, place = resting(speed, heading), energy = false,
      scene = { gravity = true, ground = true, damping = true, friction = both(mu) } })
    local outcome = run:outcome()
    local x = outcome.center_end[1] - outcome.center_start[1]
    local y = outcome.center_end[2] - outcome.center_start[2]
    local along = x * math.cos(heading) + y * math.sin(heading)
    local across = -x * math.sin(heading) + y * math.cos(heading)
    first = first or along
    c:near(("distance at %d degrees"):format(30 * twelfth), along, first, { rtol = 0.005 })
    c:at_most("path to the side", math.abs(across), 0.005 * first)
  end
end }

for _, share in ipairs { 0.9, 1.1 } do
  case { row = 28, name = ("a push of %g mu N"):format(share), run = function(c)
    local run = c:run(with { settle = 3, duration = 2, scene = { gravity = { acceleration =
      { share * MU * STANDARD_GRAVITY, 0, -STANDARD_GRAVITY } }, ground = true, damping = true,
      friction = both(MU) } })
    local outcome = run:outcome()
    local gone = outcome.center_end[1] - outcome.center_start[1]
    if share < 1 then
      -- masses of the ground stand still; fp32 moves those above by their rounding
      c:at_most("motion", math.abs(gone), c:by_precision { double = 1e-9, fp32 = 1e-6 })
    else
      c:at_least("motion", gone, 0.5)
    end
  end }
end

for _, share in ipairs { 0.9, 1.1 } do
  case { row = 28, name = ("a push of %g static mu N on a sheet at rest"):format(share),
    run = function(c)
      -- Friction of 1.05 times the push brings it to rest first, so that no foot bears more than
      -- 1.05 times its share; what is put down on kinetic friction alone would slip at once.
      local push = 0.5 -- of the weight
      local function sheet(fields)
        fields.scene = { gravity = { acceleration = { push * STANDARD_GRAVITY, 0,
          -STANDARD_GRAVITY } }, ground = true, damping = true, friction = fields.friction }
        return c:run(with(fields))
      end
      local rest = sheet { duration = 3, friction = both(1.05 * push) }:state()
      local run = sheet { duration = 1, energy = false,
        friction = { static = push / share, kinetic = 0.1 }, place = function(positions, velocities)
          for i, p in ipairs(rest) do positions[i], velocities[i] = p, { 0, 0, 0 } end
        end }
      local outcome = run:outcome()
      local gone = outcome.center_end[1] - outcome.center_start[1]
      if share < 1 then
        -- XPBD's springs still settle when they are put there
        c:at_most("motion", math.abs(gone), c.integrator == "xpbd" and 1e-6
          or c:by_precision { double = 1e-9, fp32 = 1e-6 })
      else
        c:near("motion", gone, 0.5 * (push - 0.1) * STANDARD_GRAVITY, { rtol = 0.05 })
      end
    end }
end

case { row = 29, name = "mu = 0 and mu = 1000", run = function(c)
  local function gone(mu)
    local run = c:run(with { duration = 0.5, place = resting(1), energy = false,
      scene = { gravity = true, ground = true, damping = true, friction = both(mu) } })
    local _, velocities = run:state()
    local mean = 0
    for _, v in ipairs(velocities) do mean = mean + v[1] / #velocities end
    return run:outcome().center_end[1] - run:outcome().center_start[1], mean
  end
  local _, speed = gone(0)
  c:near("speed without friction", speed, 1, { rtol = c:by_precision { double = 1e-12,
    fp32 = 1e-5, single = 1e-4 } })
  -- feet stop at once and the upper half swings on them: it goes no farther than it leans over
  local way = gone(1000)
  c:at_most("way where nothing slips", math.abs(way), 0.1)
  -- the first step stops every foot before it moves: mu N h / m is 2 m/s at 0.1 ms, N the weight of
  -- two masses, and half of that in leapfrog's first half step, the speed to be stopped 0.5 m/s
  local run = c:prepare(with { place = resting(0.5), time_step = 1e-4, energy = false,
    scene = { gravity = true, ground = true, damping = true, friction = both(1000) } })
  local before = run:state()
  run:advance(1)
  for i, p in ipairs((run:state())) do
    if before[i][3] < 0 then
      c:same_bits("place of a foot", { p[1], p[2] }, { before[i][1], before[i][2] })
    else
      c:at_least("way of a mass above", p[1] - before[i][1], 4e-5)
    end
  end
end }

case { row = 30, name = "static below kinetic is kinetic alone", run = function(c)
  local function ends(static, kinetic)
    return (c:run(with { duration = 1, energy = false,
      place = resting(1), scene = { gravity = true, ground = true, damping = true,
        friction = { static = static, kinetic = kinetic } } }):state())
  end
  -- the rule: a slip that mu_k can stop is stopped, whatever mu_s
  c:same_bits("place", ends(0.6, 1), ends(1, 1))
end }

for _, share in ipairs { 0.8, 1.1 } do
  case { row = 30, name = ("a push of %g of the weight, static 0.6, kinetic 1"):format(share),
    run = function(c)
      -- a slow push: gravity tilts, and a sheet at rest is not thrown. Between 0.6 and 1.0 plain
      -- Coulomb friction at 1.0 holds it, and beyond it slips against 1.0
      local run = c:run(with { settle = 3, duration = 1, record = { energy = 20 },
        scene = { gravity = { acceleration = { share * STANDARD_GRAVITY, 0, -STANDARD_GRAVITY } },
          ground = true, damping = true, friction = { static = 0.6, kinetic = 1 } } })
      local outcome, rows = run:outcome(), run:trace "energy"
      local gone = outcome.center_end[1] - outcome.center_start[1]
      if share < 1 then
        c:at_most("motion", math.abs(gone), c:by_precision { double = 1e-9, fp32 = 1e-6 })
        return
      end
      c:at_least("motion", gone, 0.4)
      -- what gravity gives beyond what friction takes is all that moves it
      local first, last = rows[1], rows[#rows]
      c:near("work of gravity less friction's", last[1] - first[1],
        (share - 1) * STANDARD_GRAVITY * outcome.mass * gone, { rtol = 0.01 })
      c:at_most("whole energy at the end", last[1] + last[2] + last[3],
        first[1] + first[2] + first[3])
    end }
end

case { row = 31, name = "work of friction", run = function(c)
  local mu, speed = 0.3, 2
  -- A sheet that is braked from below rocks, and its springs take some of the energy: less, the
  -- stiffer they are. In a state of fp32 stiffer ones take more steps, each of which rounds a speed
  -- of 2 m/s.
  local fine = c.precision == "double" or c.precision == "mixed"
  local run = c:run(with { duration = 0.5, place = resting(speed), energy = false,
    materials = { b = { damping_ratio = 1, stiffness = fine and 1e6 or 1e5 } },
    scene = { gravity = true, ground = true, damping = true, friction = both(mu) },
    record = { energy = 20 } })
  local outcome = run:outcome()
  local rows = run:trace "energy"
  local lost = rows[1][1] - rows[#rows][1]
  local way = outcome.center_end[1] - outcome.center_start[1]
  if general.WHOLE_KICKS[c.integrator] then
    -- such a step goes its way at the speed of its end, and an impulse works at the mean of both
    -- ends: the ways differ by half a step of what the speed has lost
    way = way + 0.5 * outcome.time_step * mu * STANDARD_GRAVITY * outcome.time
  end
  local work = mu * outcome.mass * STANDARD_GRAVITY * way
  -- XPBD brakes at the end of a step by what a push is then. Where the state is fp32, every step
  -- rounds a speed of 2 m/s by 1e-7, which a plain sum keeps.
  c:near("energy lost", lost, work, { rtol = c.integrator == "xpbd" and 2e-4
    or c:by_precision { double = 1e-6, mixed = 1e-6, compensated = 5e-5, single = 2e-4 } })
end }

return cases
