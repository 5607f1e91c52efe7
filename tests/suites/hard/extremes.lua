--- extremes.lua: hard cases of large ratios within a body and of parameters at the ends of their
--- ranges. SI units.

local case = require("limax.tools.bench.hard_cases").suite "extremes"

local function checkered(x, y, z) return (x + y + z) % 2 == 0 and "c" or "b" end

case { row = 9, name = "stiffness contrast of 1e6 in one body", run = function(c)
  local function tip(fraction)
    local run = c:run { lattice = { 4, 1, 1 }, scene = { damping = true }, duration = 0.2,
      voxels = function(x) return x <= 2 and "b" or "s" end, bound_fraction = fraction,
      materials = { s = { stiffness = 10, stiffness_floor = 1 }, b = { stiffness = 1e7 } },
      place = function(positions)
        for _, p in ipairs(positions) do
          if p[1] > 0.35 then p[1] = p[1] + 0.02 end
        end
      end }
    -- the stiff springs set the step
    c:at_most("step", run:outcome().time_step, 2 / math.sqrt(1e7 / 0.1))
    return run:state()[5][1]
  end
  -- the step is a thousandth of the soft part's period; plain sums round 1e4 steps by 3e-8 m
  c:near("place of the soft end", tip(0.9), tip(0.45),
    { atol = { double = 1e-6, fp32 = 1e-6, single = 3e-5 } })
end }

case { row = 10, name = "mass ratio of 1e4", brief = true, run = function(c)
  local run = c:run { lattice = { 2, 2, 2 },
    voxels = function(_, _, z) return z == 1 and "s" or "b" end,
    materials = { s = { mass_per_site = 1e-3, stiffness = 1e5 },
      b = { mass_per_site = 10, stiffness = 1e5 } },
    scene = { gravity = true, ground = { damping_ratio = 2 }, friction = true, damping = true },
    duration = 10, record = { energy = 20 } }
  c:near("force of the ground", run:ground_force(), run:weight(),
    { rtol = { double = 1e-4, fp32 = 1e-3 } })
end }

case { name = "materials at the ends of their ranges", brief = true, run = function(c)
  for i, fields in ipairs {
    { stiffness = 1, damping_ratio = 0 }, { stiffness = 1e7, damping_ratio = 2 },
    { mass_per_site = 1e-6, damping_ratio = 0 }, { mass_per_site = 1e4, damping_ratio = 2 },
    { stiffness = 1, mass_per_site = 1e4 },
    { amplitude = 0.95, stiffness = 1e5, damping_ratio = 0 },
  } do
    -- only the invariants: such bodies may sink through the ground
    local fine, message = pcall(c.run, c, { lattice = { 2, 2, 2 },
      duration = fields.mass_per_site == 1e-6 and 0.01 or 0.3,
      voxels = function(x, y) return (x + y) % 2 == 0 and "e" or "c" end,
      materials = { e = fields, c = fields }, scene = { gravity = true, ground = true,
        friction = true, damping = true, actuation = true } })
    if not fine then error(("material %d: %s"):format(i, message), 0) end
  end
end }

case { row = 48, name = "half and ten times the size", run = function(c)
  -- lengths and accelerations times s, stiffness over mass the same: the motion times s
  local function ends(s)
    local positions = c:run({ lattice = { 2, 2, 2 }, edge = 0.1 * s, duration = 0.3,
      time_step = 2e-4, voxels = checkered, position = { 0, 0, 0.02 * s },
      scene = { gravity = { acceleration = { 0, 0, -9.81 * s } }, ground = true, friction = true,
        damping = true, actuation = { frequency = 5 } } }):state()
    for _, p in ipairs(positions) do
      for axis = 1, 3 do p[axis] = p[axis] / s end
    end
    return positions
  end
  -- s is not a power of two: roundings differ, and contact amplifies them
  local one = ends(1)
  for _, s in ipairs { 0.5, 10 } do
    c:near_rows(("%g times the size"):format(s), ends(s), one,
      { double = 1e-7, fp32 = 3e-4, single = 1e-3 })
  end
end }
