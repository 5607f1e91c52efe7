--- modes.lua: hard cases of linear modes, and of the steps that they stand. The eight masses of one
--- voxel of one material that stretch alike about their centre are an exact linear oscillator at
--- any amplitude: the forces of the seven springs of a corner add up to -8 k s (x - centre) at a
--- stretch s, so that s'' = -w^2 s - 2 xi w s', w^2 = 8 k / m and, with c = 2 zeta sqrt(k m / 2),
--- xi = 2 zeta. SI units.

local ffi = require "ffi"

local statics = require "limax.tools.bench.hard_cases.statics"

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

-- Why XPBD is not asked.
local OWN_LAW = "its springs act one after another: it follows no law of one mode"
local DAMPS = "a long step damps motion, by what is measured in ACCURACY.md"
local NO_LIMIT = "its springs are implicit: that limit is none of its own"

-- m, kg, N/m; the mass is a number that fp32 holds exactly, as the engine keeps masses
local EDGE, MASS, BONE = 0.1, 0.125, 1e4
local MATERIALS = { b = { mass_per_site = MASS, stiffness = BONE } }

-- The nearest fp32, as the engine keeps dampings and masses.
local function rounded(value) return tonumber(ffi.new("float[1]", value)[0]) end

-- gamma of the stretch at a damping ratio: each of the eight springs' worth of forces brings c.
local function gamma_of(zeta)
  return 8 * rounded(2 * zeta * math.sqrt(BONE * MASS / 2)) / MASS
end

-- Puts all masses of a voxel at (1 + stretch) of their way from the centre.
local function stretched(stretch)
  return function(positions)
    local center = { 0, 0, 0 }
    for _, p in ipairs(positions) do
      for axis = 1, 3 do center[axis] = center[axis] + p[axis] / #positions end
    end
    for i, p in ipairs(positions) do
      local q = {}
      for axis = 1, 3 do q[axis] = center[axis] + (1 + stretch) * (p[axis] - center[axis]) end
      positions[i] = q
    end
  end
end

-- The stretch of a voxel, by the length of its first edge along x.
local function stretch_of(positions) return (positions[2][1] - positions[1][1]) / EDGE - 1 end

-- One step of the integrators on s'' = -w^2 s - gamma s', as DESIGN writes them.
local function scalar(integrator, w, gamma, h, s)
  local u, before, n = 0, 0, 0
  return function()
    local leapfrog = integrator == "leapfrog"
    local p = leapfrog and n > 0 and u + before * h / 2 or u
    local kick = leapfrog and n == 0 and h / 2 or h
    local a = -w * w * s - gamma * p
    u = u + kick * a
    before, n, s = a, n + 1, s + h * u
    return s
  end
end

-- Follows a voxel's stretch step by step beside the scalar law.
local function follow(c, spec, w, gamma, steps, allowed)
  local run = c:prepare(spec)
  local h = run:outcome().time_step
  local step = scalar(c.integrator, w, gamma, h, spec.stretch)
  local seen = {}
  for n = 1, steps do
    run:advance(1)
    seen[n] = stretch_of(run:state())
    c:near(("stretch at step %d"):format(n), seen[n], step(), { atol = allowed })
  end
  return seen, h
end

local function voxel(fields)
  local spec = { lattice = { 1, 1, 1 }, voxels = "b", scene = {}, duration = 1, energy = false,
    materials = MATERIALS }
  for name, value in pairs(fields) do spec[name] = value end
  spec.place = stretched(spec.stretch)
  return spec
end

for _, fraction in ipairs { 0.02, 0.5, 0.99 } do
  case { row = 4, name = ("an oscillator at %g of its limit"):format(fraction),
    except = { xpbd = OWN_LAW }, run = function(c)
    local w = math.sqrt(8 * BONE / MASS)
    -- the step that is this share of 2 / w, as near as steps divide 50 ms
    local h = 0.05 / math.ceil(0.05 / (fraction * 2 / w) - 1e-9)
    -- Near the limit so little that the stretch does not stiffen other modes beyond it: at 0.99 of
    -- it, symplectic Euler in double, a disturbance of 1e-12 m grows to 16 mm in 300 steps where
    -- springs stretch by 5 % at first, to 9e-9 m at 2 %, and not at all at 0.5 %; at 0.9, which
    -- `auto` keeps to, it does not grow at 5 % either. A CPU rounds a symmetric body's forces
    -- symmetrically and shows none of it; an H200 does.
    local stretch, steps = fraction > 0.9 and 0.005 or 0.05, 300
    local run = c:prepare(voxel { stretch = stretch, time_step = h })
    -- s_n = cos(n t) + b sin(n t), sin(t / 2) = w h / 2; a whole first kick gives symplectic Euler
    -- s_1 = 1 - (w h)^2
    local angle = 2 * math.asin(w * h / 2)
    local beside = c.integrator == "leapfrog" and 0
      or (1 - w * w * h * h - math.cos(angle)) / math.sin(angle)
    -- in fp32 places of 0.1 m are rounded to 6e-8 of it, and 300 forces add that up; near the limit
    -- the same forces move more, by 1 / cos(t / 2)
    local allowed = c:by_precision { double = 5e-12, fp32 = 1e-5, single = 1.5e-5 }
      / math.cos(angle / 2)
    local seen = {}
    for n = 1, steps do
      run:advance(1)
      local expected = stretch * (math.cos(n * angle) + beside * math.sin(n * angle))
      seen[n] = stretch_of(run:state())
      c:near(("stretch at step %d"):format(n), seen[n], expected, { atol = allowed })
    end
    -- the angle at n, of s_n = A cos(a_n) and s_(n-1) = A cos(a_n - t)
    local function angle_at(n)
      return math.atan2((seen[n - 1] - seen[n] * math.cos(angle)) / math.sin(angle), seen[n])
    end
    local turn = 2 * math.pi
    local ahead = angle_at(steps) - angle_at(2) - (steps - 2) * angle
    ahead = (ahead + math.pi) % turn - math.pi
    c:at_most("relative error of the period", math.abs(ahead) / ((steps - 2) * angle),
      c:by_precision { double = 1e-10, fp32 = 1e-5 })
  end }
end

case { row = 5, name = "damped decay", except = { xpbd = OWN_LAW }, run = function(c)
  local w = math.sqrt(8 * BONE / MASS)
  local gamma, stretch = gamma_of(0.1), 0.05
  local allowed = stretch * c:by_precision { double = 1e-10, fp32 = 1e-4, single = 1e-3 }
  local seen, h = follow(c, voxel { stretch = stretch, time_step = 2.5e-4,
    scene = { damping = true } }, w, gamma, 200, allowed)
  -- symplectic Euler: the product of the two roots is 1 - gamma h, so that amplitudes shrink by its
  -- root each step. s_n^2 - s_(n-1) s_(n+1) is the square of an amplitude whatever the phase.
  if c.integrator == "symplectic_euler" then
    local function squared(n) return seen[n] ^ 2 - seen[n - 1] * seen[n + 1] end
    c:near("decay per step", (squared(60) / squared(20)) ^ (1 / 80), math.sqrt(1 - gamma * h),
      { rtol = c:by_precision { double = 1e-10, fp32 = 1e-4, single = 1e-3 } })
  end
  -- amplitudes of s'' = -w^2 s - gamma s' fall by exp(-gamma t / 2); the error of that falls by the
  -- order of the integrator. fp32's is rounding.
  if c.precision ~= "double" then return end
  local function decay_error(time_step)
    local run, s = c:prepare(voxel { stretch = stretch, time_step = time_step,
      scene = { damping = true } }), {}
    local begun, ended = math.floor(0.01 / time_step + 0.5), math.floor(0.05 / time_step + 0.5)
    for n = 1, ended + 1 do
      run:advance(1)
      s[n] = stretch_of(run:state())
    end
    local function squared(n) return s[n] ^ 2 - s[n - 1] * s[n + 1] end
    return 0.5 * math.log(squared(begun) / squared(ended)) / (gamma * 0.04 / 2) - 1
  end
  local ratio = decay_error(2.5e-4) / decay_error(1.25e-4)
  c:near("decrement's error at h over that at h / 2", ratio,
    c.integrator == "leapfrog" and 4 or 2, { rtol = 0.1 })
end }

case { row = 6, name = "over-damped", except = { xpbd = OWN_LAW }, run = function(c)
  -- zeta = 2, the largest that is legal, makes xi = 4
  local w = math.sqrt(8 * BONE / MASS)
  local gamma, stretch = gamma_of(2), 0.05
  local spec = voxel { stretch = stretch, scene = { damping = true },
    materials = { b = { mass_per_site = MASS, stiffness = BONE, damping_ratio = 2 } },
    bound_fraction = 0.1 }
  local allowed = stretch * c:by_precision { double = 1e-10, fp32 = 1e-4, single = 3e-4 }
  local seen = follow(c, spec, w, gamma, 400, allowed)
  local before = stretch
  for n, s in ipairs(seen) do
    -- never faster back than it came, never through zero, up to rounding
    c:at_most(("stretch at step %d"):format(n), s, before + allowed)
    c:at_least(("stretch at step %d"):format(n), s, -allowed)
    before = s
  end
  -- the bound of one mass with seven springs: A = 14 k / m, B = 14 c / m
  local damping = 2 * 2 * math.sqrt(BONE * MASS / 2)
  local a, b = 14 * BONE / MASS, 14 * damping / MASS
  if c.integrator == "leapfrog" then b = 2 * b end
  c:near("bound of the step", c:prepare(spec):outcome().time_step_bound,
    4 / (b + math.sqrt(b * b + 4 * a)), { rtol = 1e-6 })
end }

-- A kick of `speed` m/s that follows from the mass alone.
local function kicked(speed)
  return function(_, velocities)
    for i = 1, #velocities do
      velocities[i] = { speed * math.sin(12.9898 * i), speed * math.sin(78.233 * i),
        speed * math.sin(37.719 * i) }
    end
  end
end

-- The energy that an integrator keeps exactly in a linear undamped body, J, and the one that is
-- measured: leapfrog E - (h^2 / 8) sum m a^2, symplectic Euler E + (h / 2) sum F v. Near the limit
-- of the step they differ by as much as they are.
local function shadow_energy(c, box, stiffness, mass, h, positions, velocities)
  local forces, energy = statics.forces(box, stiffness, positions), 0
  local correction = 0
  for i, force in ipairs(forces) do
    for axis = 1, 3 do
      local f, v = force[axis], velocities[i][axis]
      energy = energy + 0.5 * mass * v * v
      correction = correction
        + (c.integrator == "leapfrog" and -h * h / 8 * f * f / mass or h / 2 * f * v)
    end
  end
  energy = energy + statics.energy(box, stiffness, positions)
  return energy + correction, energy
end

case { row = 7, name = "the shadow energy of a linear mode at 99 % of the bound",
  except = { xpbd = DAMPS }, run = function(c)
    -- one voxel's stretch is linear at any size, so that nothing but rounding changes it
    local box = statics.box({ 1, 1, 1 }, EDGE)
    local run = c:prepare(voxel { stretch = 0.05, bound_fraction = 0.99 })
    local h = run:outcome().time_step
    local first, least, most = nil, math.huge, -math.huge
    for _ = 1, 100 do
      run:advance(100)
      local shadow = shadow_energy(c, box, BONE, MASS, h, run:state())
      first = first or shadow
      least, most = math.min(least, shadow), math.max(most, shadow)
    end
    -- fp32 rounds places of 0.1 m to 1e-6 of the stretch, in each of 1e4 steps
    c:at_most("swing of the shadow energy", (most - least) / first,
      c:by_precision { double = 1e-9, fp32 = 1e-3 })
  end }

case { row = 7, name = "the shadow energy at 99 % of the bound", brief = true,
  except = { xpbd = DAMPS }, run = function(c)
    local lattice, mass, samples = { 5, 5, 5 }, MASS, c.full and 200 or 40
    -- Strains of 3e-8: smaller ones drown in the roundings of places of 0.5 m, and what larger ones
    -- bend is not linear. Ten times slower or three times faster kicks give more than the 1.4e-8 of
    -- this one, so that 1e-9, a figure of linear springs, cannot be had. fp32 has no such strains.
    if c.precision ~= "double" then
      c:note "asked of double alone: strains of 3e-8 are below fp32's resolution"
      return
    end
    local box = statics.box(lattice, EDGE)
    local run = c:prepare { lattice = lattice, scene = {}, bound_fraction = 0.99, energy = false,
      materials = MATERIALS, place = kicked(3e-6) }
    local h = run:outcome().time_step
    local first, least, most, swing = nil, math.huge, -math.huge, { math.huge, -math.huge }
    for _ = 1, samples do
      run:advance(25)
      local shadow, measured = shadow_energy(c, box, BONE, mass, h, run:state())
      first = first or shadow
      least, most = math.min(least, shadow), math.max(most, shadow)
      swing = { math.min(swing[1], measured), math.max(swing[2], measured) }
    end
    c:at_most("swing of the shadow energy", (most - least) / first, 1e-7)
    c:note("the shadow energy swings by %.2g of itself, the measured one by %.2g",
      (most - least) / first, (swing[2] - swing[1]) / first)
  end }

case { row = 7, name = "99 % of the bound", brief = true,
  except = { xpbd = DAMPS }, run = function(c)
  local steps = c.full and 1e6 or 5e3
  local start = c:prepare { lattice = { 5, 5, 5 }, scene = {}, bound_fraction = 0.99,
    energy = false }
  local h = start:outcome().time_step
  -- undamped, and with nothing to rest on: what is kicked in stays in. The general checks hold the
  -- energy to the ratio that the step allows.
  local run = c:run { lattice = { 5, 5, 5 }, scene = {}, bound_fraction = 0.99,
    duration = steps * h, place = kicked(1), record = { energy = 100 } }
  local rows = run:trace "energy"
  local tenth = math.floor(#rows / 10)
  local function mean_of(from, to)
    local sum = 0
    for i = from, to do sum = sum + (rows[i][1] + rows[i][2]) / (to - from + 1) end
    return sum
  end
  -- No secular growth: the mean of many beats. In fp32 a place of 0.5 m is off by 2e-8 m and its 26
  -- springs' forces by 1e-3 N, so that every step kicks a mass by 3.5e-6 m/s at random: 4e-10 J a
  -- step for 648 directions, a few times that near the limit, and plain sums add as much. The kick
  -- gives 17 J.
  c:near("energy of the last tenth", mean_of(#rows - tenth, #rows), mean_of(1, tenth),
    { rtol = 5e-3, atol = steps * c:by_precision { double = 0, fp32 = 2e-9, single = 5e-9 } })
end }

for _, limit in ipairs { { 0.98, nil }, { 1.02, { "speed", "stretch", "nonfinite" } } } do
  case { row = 8, name = ("%g of the true limit"):format(limit[1]),
    except = { xpbd = NO_LIMIT }, run = function(c)
    -- the stretch is the stiffest mode of one voxel, whose true limit is w h = 2; the stiffness is
    -- made so that a step of 1 ms is the wanted share of it. Above it, the kick doubles every few
    -- steps and must be found out.
    local h = 1e-3
    local k = MASS / 8 * (2 * limit[1] / h) ^ 2
    local run = c:run { lattice = { 1, 1, 1 }, scene = {}, time_step = h, duration = 1,
      materials = { b = { mass_per_site = MASS, stiffness = k } }, place = stretched(1e-4),
      diverges = limit[2],
      energy = false }
    local outcome = run:outcome()
    if limit[2] then c:at_most("step at which it is found out", outcome.step, 128) end
  end }
end

case { row = 11, name = "springs of almost no length",
  except = { xpbd = OWN_LAW }, run = function(c)
  -- No spring has a rest length of 0: they are edges and diagonals, and amplitudes end at 0.95.
  -- Crushed to a thousandth, springs swing through the centre to the other side of their length.
  local stretch = -0.999
  local w = math.sqrt(8 * BONE / MASS)
  -- a period later they are crushed again, and then the least rounding decides where they go:
  -- three quarters of one are compared, and the rest is held to the general checks
  follow(c, voxel { stretch = stretch, time_step = 2e-4 }, w, 0, 28,
    c:by_precision { double = 1e-9, fp32 = 1e-3, single = 1e-3 })
  -- the bound of the step holds for springs of at least half their length. Shorter ones turn
  -- farther in a step than it sees, which costs or brings energy once each time that they pass
  -- their centre: 1.2 % on an H200.
  c:run(voxel { stretch = stretch, energy = true, energy_rise = 0.05, bound_fraction = 0.05 })
end }

return cases
