--- muscles.lua: hard cases of muscles: resonance, extreme frequencies and amplitudes, jumps. A
--- voxel of one muscle is the oscillator of modes.lua, driven:
--- s'' = -w^2 (s - a sin(2 pi f t)) - 2 xi w s'. SI units.

local invariants = require "limax.tools.bench.hard_cases.invariants"
local limax = require "limax"
local statics = require "limax.tools.bench.hard_cases.statics"
local case = require("limax.tools.bench.hard_cases").suite "muscles"

local EDGE, MASS, STIFFNESS = 0.1, 0.125, 2e3 -- m, kg, N/m
local MODE = math.sqrt(8 * STIFFNESS / MASS) -- rad/s

local function muscle(letter, amplitude)
  return { [letter] = { mass_per_site = MASS, stiffness = STIFFNESS, amplitude = amplitude } }
end

-- Muscles in antiphase, voxel by voxel.
local function checkerboard(x, y, z) return (x + y + z) % 2 == 0 and "e" or "c" end

for _, share in ipairs { 0.5, 1, 1.5 } do
  case { row = 33, name = ("driven at %g of its first mode"):format(share), smooth = true,
    run = function(c)
      local amplitude, zeta, frequency = 0.01, 0.1, share * MODE / (2 * math.pi)
      local run = c:prepare { lattice = { 1, 1, 1 }, voxels = "e", weights = { phase = 0 },
        energy = false, bound_fraction = 0.05, materials = muscle("e", amplitude),
        scene = { damping = true, actuation = { frequency = frequency } } }
      -- after 20 decays only the response to the drive is left
      local h, most = run:outcome().time_step, 0
      run:advance(math.ceil(20 / (2 * zeta * MODE) / h))
      for _ = 1, math.ceil(2 / frequency / h) do
        run:advance(1)
        local positions = run:state()
        most = math.max(most, math.abs((positions[2][1] - positions[1][1]) / EDGE - 1))
      end
      c:near("amplitude", most,
        amplitude / math.sqrt((1 - share * share) ^ 2 + (4 * zeta * share) ^ 2), { rtol = 0.02 })
    end }
end

for _, amplitude in ipairs { 0.25, 0.95 } do
  case { row = 35, name = ("all muscles in antiphase, amplitude %g"):format(amplitude),
    brief = true, run = function(c)
      local run = c:run { lattice = { 5, 5, 5 }, voxels = checkerboard, duration = 1,
        weights = { phase = 0 }, record = { energy = 20 },
        scene = { damping = true, actuation = { frequency = 5 } },
        materials = { e = { amplitude = amplitude }, c = { amplitude = amplitude } } }
      for axis = 1, 3 do
        -- fp32: forces of 1e3 N cancel up to their roundings
        c:near("centre of mass", run:moved(axis), 0, { atol = { double = 1e-9, fp32 = 1e-5 } })
      end
    end }
end

case { row = 36, name = "without actuation muscles are tissue", run = function(c)
  local run = c:run { lattice = { 2, 2, 2 }, voxels = checkerboard, scene = { damping = true },
    duration = 0.5, record = { strain = 20 } }
  for _, row in ipairs(run:trace "strain") do
    c:at_most("strain", row[2], { double = 1e-12, fp32 = 1e-5 })
  end
end }

case { row = 37, name = "muscles that jump: a square wave", run = function(c)
  -- Each run holds a drive of 1 mHz at its crest and starts where the one before ended, with the
  -- opposite muscle: all rest lengths jump between (1 + a) L and (1 - a) L.
  local amplitude, box = 0.25, statics.box({ 1, 1, 1 }, EDGE)
  local positions, velocities
  local before, held = 0, 0
  for jump = 1, 6 do
    local letter = jump % 2 == 1 and "e" or "c"
    local sign = jump % 2 == 1 and 1 or -1
    local run = c:prepare { lattice = { 1, 1, 1 }, voxels = letter, weights = { phase = 0.5 },
      energy = false, center = false, duration = 0.1, record = { energy = 100 },
      materials = muscle(letter, amplitude),
      scene = { damping = true, actuation = { frequency = 1e-3, ramp = 0 } },
      place = function(p, v)
        for i = 1, positions and #p or 0 do p[i], v[i] = positions[i], velocities[i] end
      end }
    local start = run:state()
    run.simulation:run()
    invariants.check(c, run)
    local rows = run:trace "energy"
    -- the work of a jump is the change of the springs' energy
    if positions then held = statics.energy(box, STIFFNESS, start, 1 - sign * amplitude) end
    c:near(("energy of jump %d"):format(jump), rows[1][2] - before,
      statics.energy(box, STIFFNESS, start, 1 + sign * amplitude) - held, { rtol = 1e-6 })
    for i = 2, #rows do
      c:at_most("energy between jumps", rows[i][1] + rows[i][2], rows[1][1] + rows[1][2])
    end
    before = rows[#rows][2]
    positions, velocities = run:state()
  end
end }

case { name = "actuation at 0.001, 20 and 1000 Hz", run = function(c)
  for _, frequency in ipairs { 0.001, 20, 1000 } do
    c:run { lattice = { 3, 3, 3 }, voxels = checkerboard, duration = 1, energy = false,
      scene = { gravity = true, ground = true, friction = true, damping = true,
        actuation = { frequency = frequency } } }
  end
end }

case { row = 34, name = "a drive too fast for the step is reported", brief = true,
  run = function(c)
    -- 20 steps of 0.5 ms are a period of 100 Hz
    for frequency, undersampled in pairs { [100] = false, [101] = true, [1000] = true } do
      local robot = limax.robot { voxels = "ec\nce" }:simulate { duration = 0.05, settle = 0,
        time_step = 5e-4, integrator = c.integrator, precision = c.precision, device = c.device,
        scene = { damping = true, actuation = { frequency = frequency } } }
      c:same_bits(("undersampled at %g Hz"):format(frequency), robot.undersampled, undersampled)
    end
  end }

case { row = 39, name = "walking on and on", brief = true, run = function(c)
  -- A slab on a wave of muscles: its strides and its energy are the same at the end as at first.
  local h = 5e-4
  local run = c:run { lattice = { 5, 2, 2 }, duration = h * (c.full and 1e7 or 6e4), settle = 3,
    time_step = h, voxels = function(_, _, z) return z == 1 and "e" or "s" end,
    weights = { phase = function(x) return (x - 1) / 4 end },
    scene = { gravity = true, ground = true, friction = true, damping = true,
      actuation = { frequency = 1 } }, record = { energy = 20, center_of_mass = 20 } }
  local path, energies = run:trace "center_of_mass", run:trace "energy"
  local period = 20 -- samples
  local strides = math.floor((#path - 1) / period)
  local part = math.floor(strides / (c.full and 10 or 3))
  local function stride(k)
    local p, q = path[1 + (k - 1) * period], path[1 + k * period]
    return math.sqrt((q[1] - p[1]) ^ 2 + (q[2] - p[2]) ^ 2)
  end
  local function energy(k)
    local sum = 0
    for i = 1 + (k - 1) * period, k * period do sum = sum + energies[i][1] + energies[i][2] end
    return sum / period
  end
  -- Mean of a part of the strides and the square of its standard error.
  local function mean(value, first)
    local sum, squares = 0, 0
    for k = first, first + part - 1 do
      sum, squares = sum + value(k), squares + value(k) ^ 2
    end
    local middle = sum / part
    return middle, (squares / part - middle ^ 2) / (part - 1)
  end
  for what, value in pairs { stride = stride, energy = energy } do
    local early, scatter = mean(value, 2)
    local late, late_scatter = mean(value, strides - part + 1)
    -- strides scatter by a sixth of their mean: 1 % and three standard errors
    c:near(what .. " at the end", late, early,
      { atol = 0.01 * early + 3 * math.sqrt(scatter + late_scatter) })
    if value == stride then c:at_least("stride", early, 0.08) end
  end
end }
