--- extremes.lua: hard cases of bodies whose parts, sizes or parameters lie far apart, or at the
--- edges of what is legal. SI units.

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

-- kg, of a mass where a case names no other
local MASS = 0.1

case { row = 9, name = "stiffness contrast of 1e6 in one body", brief = true, run = function(c)
  -- soft voxels are pulled out by a tenth and swing; stiff ones only follow
  local spec = { lattice = { 3, 3, 3 }, scene = { damping = true }, duration = 0.1,
    voxels = function(x, y, z) return (x + y + z) % 2 == 0 and "s" or "b" end,
    materials = { s = { stiffness = 10, stiffness_floor = 1 }, b = { stiffness = 1e7 } },
    place = function(positions)
      for _, p in ipairs(positions) do p[3] = p[3] * 1.01 end
    end }
  local run = c:run(spec)
  -- 39 springs at most end in a mass: by the bound's own formula stiff springs set the step
  c:at_most("step", run:outcome().time_step, 2 / math.sqrt(1e7 / MASS))
end }

case { row = 9, name = "a soft end beside a stiff one does not mind the step", run = function(c)
  local function tip(fraction)
    local run = c:run { lattice = { 4, 1, 1 }, scene = { damping = true }, duration = 0.2,
      voxels = function(x) return x <= 2 and "b" or "s" end, bound_fraction = fraction,
      materials = { s = { stiffness = 10, stiffness_floor = 1 }, b = { stiffness = 1e7 } },
      place = function(positions)
        for _, p in ipairs(positions) do
          if p[1] > 0.35 then p[1] = p[1] + 0.02 end
        end
      end }
    return run:state()[5][1]
  end
  -- order 1 and 2 of a step that is a thousandth of the soft part's period; plain sums at 0.4 m
  -- round 1e4 steps by 3e-8 m each. XPBD takes steps that are seven times longer.
  c:near("place of the soft end", tip(0.9), tip(0.45), { atol = c.integrator == "xpbd" and 1e-4
    or c:by_precision { double = 1e-6, fp32 = 1e-6, single = 3e-5 } })
end }

case { row = 10, name = "mass ratio of 1e4", brief = true, run = function(c)
  local run = c:run { lattice = { 2, 2, 2 },
    voxels = function(_, _, z) return z == 1 and "s" or "b" end,
    materials = { s = { mass_per_site = 1e-3, stiffness = 1e5 },
      b = { mass_per_site = 10, stiffness = 1e5 } },
    scene = { gravity = true, ground = { damping_ratio = 2 }, friction = true, damping = true },
    duration = 10, record = { energy = 20 } }
  -- the ground's penalty carries the weight: k_g d summed over what is below it
  local carried = 0
  for _, p in ipairs((run:state())) do carried = carried + 1e5 * math.max(0, -p[3]) end
  c:near("force of the ground", carried, 9.81 * run:outcome().mass,
    { rtol = c:by_precision { double = 1e-4, fp32 = 1e-3 } })
end }

case { name = "materials at the edges of their ranges", brief = true, run = function(c)
  local edges = {
    { stiffness = 1, damping_ratio = 0 }, { stiffness = 1e7, damping_ratio = 2 },
    { mass_per_site = 1e-6, damping_ratio = 0 }, { mass_per_site = 1e4, damping_ratio = 2 },
    { stiffness = 1, mass_per_site = 1e4 },
    { amplitude = 0.95, stiffness = 1e5, damping_ratio = 0 },
  }
  for i, edge in ipairs(edges) do
    -- a body as heavy or as soft as this sinks through a ground that carries robots: its place is
    -- not asked for, only that it ends, finite
    local duration = edge.mass_per_site == 1e-6 and 0.02 or 0.5
    local fine, message = pcall(c.run, c, { lattice = { 2, 2, 2 }, duration = duration,
      voxels = function(x, y) return (x + y) % 2 == 0 and "e" or "c" end,
      materials = { e = edge, c = edge }, scene = { gravity = true, ground = true, friction = true,
        damping = true, actuation = true } })
    if not fine then error(("edge %d: %s"):format(i, message), 0) end
  end
end }

case { row = 48, name = "half and ten times the size", run = function(c)
  -- lengths times s, accelerations times s, stiffness over mass the same: the same motion, times s
  local function ends(s)
    local run = c:run { lattice = { 2, 2, 2 }, edge = 0.1 * s, duration = 0.3, time_step = 2e-4,
      voxels = function(x, y, z) return (x + y + z) % 2 == 0 and "c" or "b" end,
      position = { 0, 0, 0.02 * s },
      scene = { gravity = { acceleration = { 0, 0, -9.81 * s } }, ground = true, friction = true,
        damping = true, actuation = { frequency = 5 } } }
    return run:state()
  end
  local one = ends(1)
  -- amplitudes are kept in fp32, and s is no power of two, so that their roundings differ; contact
  -- carries them on
  local allowed = c:by_precision { double = 1e-7, fp32 = 3e-4, single = 1e-3 }
  for _, s in ipairs { 0.5, 10 } do
    for mass, p in ipairs(ends(s)) do
      for axis = 1, 3 do
        c:near(("%g times the size: mass %d"):format(s, mass), p[axis] / s, one[mass][axis],
          { atol = allowed })
      end
    end
  end
end }

case { row = 54, name = "parameters that are none", run = function(c)
  local function with(fields)
    return function()
      local spec = { lattice = { 1, 1, 1 }, scene = { gravity = true } }
      for name, value in pairs(fields) do spec[name] = value end
      c:prepare(spec)
    end
  end
  local nan = 0 / 0
  for _, bad in ipairs {
    { { time_step = 0 }, "time_step" }, { { time_step = -1 }, "time_step" },
    { { time_step = nan }, "time_step" }, { { time_step = 1e300 }, "time_step" },
    { { duration = nan }, "duration" }, { { duration = -1 }, "duration" },
    { { edge = 0 }, "edge" }, { { edge = math.huge }, "edge" },
    { { materials = { b = { stiffness = -1 } } }, "stiffness" },
    { { materials = { b = { stiffness = nan } } }, "stiffness" },
    { { materials = { b = { mass_per_site = 0 } } }, "mass_per_site" },
    { { materials = { b = { damping_ratio = math.huge } } }, "damping_ratio" },
    { { scene = { gravity = { acceleration = { 0, 0, nan } } } }, "acceleration" },
    { { scene = { ground = { stiffness = -1 } } }, "stiffness" },
    { { velocity = { nan, 0, 0 } }, "velocity" }, { { max_speed = 0 }, "max_speed" },
    { { place = function(p) p[1][1] = nan end }, "finite" },
    { { place = function(_, v) v[1][1] = math.huge end }, "finite" },
    { { weights = { stiffness = 2 } }, "weight" },
  } do
    c:raises(bad[2], with(bad[1]))
  end
end }

return cases
