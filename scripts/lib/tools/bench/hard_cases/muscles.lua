--- muscles.lua: hard cases of muscles: resonance, absurd frequencies, full amplitude, jumps. A
--- voxel all of one muscle swings in the mode of modes.lua, driven: s'' = -w^2 (s - a sin(2 pi f
--- t)) - 2 xi w s'. SI units.

local engine = require "limax.engine"
local evolve = require "limax.evolution.evolve"
local general = require "limax.tools.bench.hard_cases.general"
local limax = require "limax"
local statics = require "limax.tools.bench.hard_cases.statics"

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

-- Why XPBD is not asked.
local DAMPS = "a long step damps motion, by what is measured in ACCURACY.md"

local EDGE, MASS, STIFFNESS = 0.1, 0.125, 2e3 -- m, kg, N/m
local MODE = math.sqrt(8 * STIFFNESS / MASS) -- rad/s

-- A voxel of one muscle at an amplitude, driven at a frequency.
local function driven(amplitude, frequency, fields)
  local spec = { lattice = { 1, 1, 1 }, voxels = "e", weights = { phase = 0 }, energy = false,
    materials = { e = { mass_per_site = MASS, stiffness = STIFFNESS, amplitude = amplitude } },
    scene = { damping = true, actuation = { frequency = frequency } } }
  for name, value in pairs(fields or {}) do spec[name] = value end
  return spec
end

local function stretch_of(positions) return (positions[2][1] - positions[1][1]) / EDGE - 1 end

for _, share in ipairs { 0.5, 1, 1.5 } do
  case { row = 33, name = ("driven at %g of its first mode"):format(share), smooth = true,
    except = { xpbd = DAMPS },
    run = function(c)
      local amplitude, zeta = 0.01, 0.1
      local frequency = share * MODE / (2 * math.pi)
      local run = c:prepare(driven(amplitude, frequency, { duration = 1, bound_fraction = 0.05 }))
      -- over after some 20 decays: what is left is the answer to the drive
      local h = run:outcome().time_step
      run:advance(math.ceil(20 / (2 * zeta * MODE) / h))
      local most = 0
      for _ = 1, math.ceil(2 / frequency / h) do
        run:advance(1)
        most = math.max(most, math.abs(stretch_of(run:state())))
      end
      local xi = 2 * zeta
      c:near("amplitude", most, amplitude
        / math.sqrt((1 - share * share) ^ 2 + (2 * xi * share) ^ 2), { rtol = 0.02 })
    end }
end

-- Muscles in antiphase, voxel by voxel.
local function checkerboard(x, y, z) return (x + y + z) % 2 == 0 and "e" or "c" end

-- The shortest spring along an axis, as a share of its length, while a body works. It is looked
-- at 50 times a second.
local function shortest(run, lattice)
  local least = math.huge
  local nx, ny = lattice[1] + 1, lattice[2] + 1
  local samples = run:trace "position"
  for sample = 1, #samples do
    local p = samples[sample]
    for i = 1, #p do
      local x = (i - 1) % nx
      local y = math.floor((i - 1) / nx) % ny
      for _, step in ipairs { x + 1 < nx and 1 or 0, y + 1 < ny and nx or 0, nx * ny } do
        local q = step > 0 and p[i + step]
        if q then
          least = math.min(least, math.sqrt((p[i][1] - q[1]) ^ 2 + (p[i][2] - q[2]) ^ 2
            + (p[i][3] - q[3]) ^ 2) / EDGE)
        end
      end
    end
  end
  return least
end

for _, amplitude in ipairs { 0.25, 0.9, 0.95 } do
  case { row = 35, name = ("all muscles in antiphase, amplitude %g"):format(amplitude),
    brief = true, run = function(c)
      -- free in the air: internal forces alone, so that the centre stays (the general check)
      local spec = { lattice = { 5, 5, 5 }, voxels = checkerboard, duration = 2,
        weights = { phase = 0 }, record = { position = 50, energy = 20 },
        scene = { damping = true, actuation = { frequency = 5 } },
        table_of_materials = c:materials { e = { amplitude = amplitude },
          c = { amplitude = amplitude } } }
      local run = c:run(spec)
      local outcome = run:outcome()
      for axis = 1, 3 do
        c:near("centre of mass", outcome.center_end[axis], outcome.center_start[axis],
          -- fp32: forces of 1e3 N that cancel leave their roundings
          { atol = c:by_precision { double = 1e-9, fp32 = 1e-5 } })
      end
      c:at_least("shortest spring", shortest(run, spec.lattice), amplitude < 0.5 and 0.2 or 1e-6)
    end }
end

case { row = 36, name = "an amplitude of 1 is refused", run = function(c)
  c:raises("amplitude", function() c:materials { e = { amplitude = 1 } } end)
  c:raises("amplitude", function() c:materials { e = { amplitude = -0.1 } } end)
end }

case { row = 37, name = "a muscle that jumps", run = function(c)
  -- no ramp and a phase of a quarter turn: the rest lengths jump by a at t = 0, and every spring
  -- holds k (a L)^2 / 2 before anything has moved: 12 edges, 12 and 4 diagonals
  local amplitude = 0.2
  local run = c:run(driven(amplitude, 2, { weights = { phase = 0.5 }, duration = 0.5,
    scene = { damping = true, actuation = { frequency = 2, ramp = 0 } }, center = false,
    record = { energy = 100 } }))
  c:near("energy of the jump", run:trace("energy")[1][2],
    0.5 * STIFFNESS * (amplitude * EDGE) ^ 2 * (12 + 12 * 2 + 4 * 3), { rtol = 1e-6 })
end }

case { row = 37, name = "a square wave", run = function(c)
  -- Rest lengths follow sines alone. A square wave is put together of runs in which a drive of
  -- 1 mHz stands at its crest, each of which begins where the one before ended and with the other
  -- muscle, so that all rest lengths jump between (1 + a) L and (1 - a) L at every half period.
  local amplitude, half = 0.25, 0.1
  local box = statics.box({ 1, 1, 1 }, EDGE)
  -- what all springs hold at the rest lengths (1 + change) L
  local function held(positions, change)
    local stretched = { springs = {} }
    for i, spring in ipairs(box.springs) do
      stretched.springs[i] = { spring[1], spring[2], (1 + change) * spring[3] }
    end
    return statics.energy(stretched, STIFFNESS, positions)
  end
  local positions, velocities
  local before = 0
  for jump = 1, 6 do
    local voxels = jump % 2 == 1 and "e" or "c"
    local change = jump % 2 == 1 and amplitude or -amplitude
    local run = c:prepare { lattice = { 1, 1, 1 }, voxels = voxels, weights = { phase = 0.5 },
      energy = false, center = false, duration = half, record = { energy = 100 },
      materials = { [voxels] = { mass_per_site = MASS, stiffness = STIFFNESS,
        amplitude = amplitude } },
      scene = { damping = true, actuation = { frequency = 1e-3, ramp = 0 } },
      place = function(p, v)
        for i = 1, #p do
          if positions then p[i], v[i] = positions[i], velocities[i] end
        end
      end }
    local start = run:state()
    run.simulation:run()
    general.check(c, run)
    local rows = run:trace "energy"
    -- the work of a jump is what the springs hold after it less what they held before it
    c:near(("energy of jump %d"):format(jump), rows[1][2] - before,
      held(start, change) - (jump > 1 and held(start, -change) or 0), { rtol = 1e-6 })
    for i = 2, #rows do
      c:at_most("energy between jumps", rows[i][1] + rows[i][2], rows[1][1] + rows[1][2])
    end
    before = rows[#rows][2]
    positions, velocities = run:state()
  end
end }

for _, frequency in ipairs { 0.001, 20, 1000 } do
  case { run = function(c)
    -- at 1 kHz a period is a few steps of `auto`: the drive is not what was meant, and does no harm
    c:run { lattice = { 3, 3, 3 }, voxels = checkerboard, duration = 2, energy = false,
      scene = { gravity = true, ground = true, friction = true, damping = true,
        actuation = { frequency = frequency } } }
  end, name = ("actuation at %g Hz"):format(frequency) }
end

case { row = 34, name = "a drive too fast for the step is said", brief = true, run = function(c)
  -- 20 steps of 0.5 ms are a period of 100 Hz: that one is still the wave that was meant
  local function simulated(frequency)
    return limax.robot { voxels = "ec\nce" }:simulate { duration = 0.05, settle = 0,
      time_step = 5e-4, integrator = c.integrator, precision = c.precision, device = c.device,
      scene = { damping = true, actuation = { frequency = frequency } } }
  end
  for _, drive in ipairs { { 90, false }, { 100, false }, { 101, true }, { 1000, true } } do
    c:same_bits(("undersampled at %g Hz"):format(drive[1]), simulated(drive[1]).undersampled,
      drive[2])
  end
  c:same_bits("undersampled without a drive", limax.robot { voxels = "ec" }:simulate {
    duration = 0.05, settle = 0, time_step = 1e-2, integrator = "xpbd", device = "cpu",
    scene = { damping = true } }.undersampled, false)
  -- a run says it once, whatever the number of generations, and goes on
  for _, drive in ipairs { { 2, 0 }, { 1000, 1 } } do
    local said = 0
    local run = evolve.start(limax.experiment { lattice = { 2, 2, 2 }, population = 4,
      generations = 2, repetitions = 1, seed = 1, supervisor = "fixed", fitness = "walk",
      genome = { require_muscle = false },
      simulation = { duration = 0.1, settle = 0, integrator = c.integrator,
        precision = c.precision },
      scene = { damping = true, actuation = { frequency = drive[1] } } },
      { device = c.device, say = function(text)
        if text:find("a period is", 1, true) then said = said + 1 end
      end })
    run:finish()
    c:same_bits(("warnings at %g Hz"):format(drive[1]), said, drive[2])
  end
end }

case { name = "actuation at 0 Hz is refused, and at none is none", run = function(c)
  c:raises("frequency", function()
    engine.scene { actuation = { frequency = 0 } }
  end)
  c:raises("frequency", function()
    engine.scene { actuation = { frequency = 1001 } }
  end)
  -- muscles in a scene that names no actuation are tissue
  local run = c:run { lattice = { 2, 2, 2 }, voxels = checkerboard, scene = { damping = true },
    duration = 0.5, record = { strain = 20 } }
  for _, row in ipairs(run:trace "strain") do
    c:at_most("strain", row[2], c:by_precision { double = 1e-12, fp32 = 1e-5 })
  end
end }

case { row = 39, name = "walking on and on", brief = true, run = function(c)
  -- A slab on a wave of swelling muscles, whose strides are 88 mm in the mean: the length of its
  -- strides and its energy are at the end what they were at first.
  local frequency, h, settle = 1, 5e-4, 3 -- Hz, s, s
  local steps = c.full and 1e7 or 8e4
  local run = c:run { lattice = { 5, 2, 2 }, duration = steps * h, settle = settle, time_step = h,
    voxels = function(_, _, z) return z == 1 and "e" or "s" end,
    weights = { phase = function(x) return (x - 1) / 4 end },
    scene = { gravity = true, ground = true, friction = true, damping = true,
      actuation = { frequency = frequency } }, record = { energy = 20, center_of_mass = 20 } }
  local path, energies = run:trace "center_of_mass", run:trace "energy"
  local period = 20 / frequency -- samples
  local strides = math.floor((#path - 1) / period)
  local part = math.floor(strides / (c.full and 10 or 3))
  local function stride(k)
    local p, q = path[1 + (k - 1) * period], path[1 + k * period]
    return math.sqrt((q[1] - p[1]) ^ 2 + (q[2] - p[2]) ^ 2)
  end
  -- kinetic and elastic, in the mean of a stride
  local function energy(k)
    local sum = 0
    for i = 1 + (k - 1) * period, k * period do sum = sum + (energies[i][1] + energies[i][2]) end
    return sum / period
  end
  -- The mean of a part of the strides and the square of its standard error.
  local function mean(value, first)
    local sum, squares = 0, 0
    for k = first, first + part - 1 do
      sum, squares = sum + value(k), squares + value(k) ^ 2
    end
    local middle = sum / part
    return middle, (squares / part - middle ^ 2) / (part - 1)
  end
  -- 1 % is asked. Strides differ by a sixth of their mean from one to the next, as contact has it,
  -- so that means do too: three standard errors of their difference are allowed on top.
  local function lasts(what, value)
    local early, scatter = mean(value, 2)
    local late, later_scatter = mean(value, strides - part + 1)
    c:near(what, late, early, { atol = 0.01 * early + 3 * math.sqrt(scatter + later_scatter) })
    return early, late
  end
  local early, late = lasts("stride at the end", stride)
  c:at_least("stride", early, 0.08)
  lasts("energy at the end", energy)
  c:note("strides of %.1f mm at first, %.1f mm at the end", 1e3 * early, 1e3 * late)
end }

return cases
