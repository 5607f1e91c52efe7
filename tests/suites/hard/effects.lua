--- effects.lua: hard cases of planes, obstacles, terrain, wind, drag, self-collision and rigid
--- blocks. SI units.

local block_picture = require "limax.draw.block_picture"
local context = require "limax.tools.bench.hard_cases.context"
local case = require("limax.tools.bench.hard_cases").suite "effects"

case { name = "a tilted plane holds half a degree below the angle of friction", brief = true,
  run = function(c)
    local mu = 0.5
    local angle = math.atan(mu) - math.rad(0.5)
    local cosine, sine = math.cos(angle), math.sin(angle)
    local run = c:run { lattice = { 4, 4, 1 }, settle = 2, duration = c.full and 60 or 2,
      materials = { b = { damping_ratio = 1 } },
      scene = { gravity = true, planes = { normal = { sine, 0, cosine }, offset = 0 },
        damping = true, friction = { static = mu, kinetic = mu } },
      place = function(positions)
        for i, p in ipairs(positions) do
          positions[i] = { cosine * p[1] + sine * p[3], p[2], cosine * p[3] - sine * p[1] }
        end
      end }
    for axis = 1, 3 do
      c:at_most("creep (m/s)", math.abs(run:moved(axis)) / run:outcome().time, 1e-5)
    end
  end }

case { name = "in the corner of two planes", run = function(c)
  local run = c:run { lattice = { 2, 2, 2 }, duration = 3,
    materials = { b = { damping_ratio = 1 } },
    scene = { gravity = true, damping = true, friction = true,
      planes = { { normal = { 1, 0, 1 }, offset = 0 }, { normal = { -1, 0, 1 }, offset = 0 } } },
    place = function(positions)
      -- turned by 45 degrees, so that it fits, and a little above
      local s = math.sqrt(0.5)
      for i, p in ipairs(positions) do
        positions[i] = { s * (p[1] - p[3]), p[2], s * (p[1] + p[3]) + 0.05 }
      end
    end }
  c:at_most("speed", run:fastest(), 0.05)
  for _, p in ipairs((run:state())) do
    c:at_least("height above the planes", p[3] - math.abs(p[1]), -0.01)
  end
end }

case { name = "on a step of a height field", brief = true, run = function(c)
  local heights = {}
  for x = 1, 12 do
    heights[x] = {}
    for y = 1, 12 do heights[x][y] = x > 6 and 0.15 or 0 end
  end
  local run = c:run { lattice = { 4, 3, 2 }, duration = 2, position = { 0.35, 0.3, 0.2 },
    materials = { b = { damping_ratio = 1 } }, scene = { gravity = true, damping = true,
      friction = true, terrain = { heights = heights, spacing = 0.1 } } }
  c:at_least("lowest mass", (run:extent(3)), -0.02)
end }

case { name = "a mass at the centre of a sphere, a body inside a box", run = function(c)
  for _, scene in ipairs {
    { damping = true, spheres = { center = { 0.1, 0.1, 0.1 }, radius = 0.3 } },
    { damping = true, boxes = { from = { -1, -1, -1 }, to = { 1, 1, 1 } } },
  } do
    local run = c:run { lattice = { 2, 2, 2 }, scene = scene, duration = 0.5,
      may_diverge = { "stretch", "speed" } }
    if run.verdict == "holds" then
      c:at_least("motion outwards",
        math.abs(run:moved(1)) + math.abs(run:moved(2)) + math.abs(run:moved(3)), 1e-3)
    end
  end
  c.reported = nil -- either outcome is fine
end }

case { name = "wind of 1000 m/s", run = function(c)
  local run = c:run { lattice = { 2, 2, 2 }, duration = 0.5, energy = false, max_speed = 1e4,
    scene = { damping = true, wind = { velocity = { 1000, 0, 0 }, drag = 1000 } } }
  c:at_most("speed", run:fastest(), 1010)
end }

case { name = "a body that folds onto itself", run = function(c)
  local run = c:run { lattice = { 8, 1, 1 }, voxels = "s", duration = 1, energy = false,
    scene = { damping = true, self_collision = true }, may_diverge = { "stretch" },
    place = function(_, velocities)
      for i = 1, #velocities do
        local arm = ((i - 1) % 9 - 4) / 4
        velocities[i] = { -5 * arm, 0, 3 * arm * arm }
      end
    end, record = { energy = 100 } }
  local rows = run:trace "energy"
  if run.verdict == "holds" then c:at_most("energy at the end", rows[#rows][1], rows[1][1]) end
end }

case { name = "legs that clap do not pass through each other", run = function(c)
  local function gap(self_collision)
    local run = c:run { lattice = { 4, 1, 5 }, duration = 0.15, energy = false, center = false,
      voxels = function(x, _, z) return (z == 1 or x == 1 or x == 4) and "s" or "." end,
      scene = { damping = true, self_collision = self_collision }, record = { position = 200 },
      place = function(positions, velocities)
        for i, p in ipairs(positions) do
          if p[3] > 0.15 then velocities[i][1] = p[1] < 0.2 and 6 or -6 end
        end
      end }
    local samples, least, facing = run:trace "position", math.huge, {}
    -- the masses of the inner sides, in the same order
    for i, p in ipairs(samples[1]) do
      local side = math.floor(10 * p[1] + 0.5)
      if p[3] > 0.15 and (side == 1 or side == 3) then facing[#facing + 1] = i end
    end
    for _, sample in ipairs(samples) do
      for k = 1, #facing, 2 do
        least = math.min(least, sample[facing[k + 1]][1] - sample[facing[k]][1])
      end
    end
    return least
  end
  c:at_least("gap between the legs", gap(true), 0)
  c:at_most("gap without self-collision", gap(false), -0.02)
end }

-- ---- a rigid block -----------------------------------------------------------------------------

-- Fails if the energy of body and block rises by more than 1 % of the most that there was.
local function check_block_energy(c, run)
  local rows, lowest, least, most, rise = run:trace "ledger", math.huge, math.huge, 0, 0
  for _, row in ipairs(rows) do lowest = math.min(lowest, row[4]) end
  for _, row in ipairs(rows) do
    local energy = row[1] + row[2] + row[3] + row[4] - lowest
    most, rise, least = math.max(most, energy), math.max(rise, energy - least),
      math.min(least, energy)
  end
  c:at_most("rise of the energy, of the most", rise / most, 1e-2)
end

case { name = "a block dropped on a body from 1 m", brief = true, cpu = true,
  run = function(c)
    local size = { 0.3, 0.3, 0.3 }
    local run = c:run { lattice = { 4, 4, 2 }, duration = 4, energy = false,
      scene = { gravity = true, ground = true, friction = true, damping = true,
        block = { size = size, position = { 0.05, 0.05, 1.2 } } }, record = { ledger = 200 } }
    check_block_energy(c, run)
    -- at rest on the body, beside it or leaning on it
    local block = run.simulation:block(1)
    local p = block.position
    for _, corner in ipairs(block_picture.corners({ p[1], p[2], p[3],
      unpack(block.orientation) }, size)) do
      c:at_least("height of a corner", corner[3], -1e-3)
    end
    for axis = 1, 3 do c:at_most("speed", math.abs(block.velocity[axis]), 1e-2) end
  end }

case { row = 32, name = "a block of 100 kg on a soft body", brief = true,
  run = function(c)
    local run = c:run { lattice = { 3, 3, 3 }, voxels = "s", duration = 3, energy = false,
      materials = { s = { stiffness = 1e4, damping_ratio = 2 } },
      scene = { gravity = true, ground = { damping_ratio = 1 }, friction = true, damping = true,
        block = { size = { 0.4, 0.4, 0.1 }, position = { -0.05, -0.05, 0.3 }, mass = 100,
          stiffness = 1e5, damping_ratio = 1 } } }
    c:at_most("speed", run:fastest(), { double = 2e-5, fp32 = 2e-3, single = 2e-2 })
    c:near("force of the ground", run:ground_force(), run:weight() + context.GRAVITY * 100,
      { rtol = { double = 1e-4, fp32 = 1e-3 } })
    c:at_least("height of the block", run.simulation:block(1).position[3], 0.3)
    c:at_least("upright block", run:outcome().block_upright, 1 - 1e-6)
  end }

case { name = "a body that hits a block at 20 m/s", cpu = true, run = function(c)
  local block_mass, speed = 5, 20
  local run = c:run { lattice = { 3, 3, 3 }, duration = 0.5, energy = false,
    velocity = { speed, 0, 0 }, may_diverge = { "stretch" }, record = { ledger = 1000 },
    scene = { damping = true, block = { size = { 0.2, 0.5, 0.5 }, position = { 0.4, -0.1, -0.1 },
      mass = block_mass } } }
  if run.verdict ~= "holds" then return end
  check_block_energy(c, run)
  local mass, momentum = run:outcome().mass, run.simulation:block(1).velocity[1] * block_mass
  c:at_least("speed of the block", momentum / block_mass, 5)
  local _, velocities = run:state()
  for _, v in ipairs(velocities) do momentum = momentum + mass / #velocities * v[1] end
  c:near("momentum", momentum, speed * mass,
    { rtol = { double = 1e-12, fp32 = 1e-5, single = 1e-4 } })
end }
