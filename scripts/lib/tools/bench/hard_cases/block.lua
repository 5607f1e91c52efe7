--- block.lua: hard cases of the rigid block: what falls on a body, loads it or is hit by it. Those
--- that read the ledger of energy are the CPU's. SI units.

local block_picture = require "limax.draw.block_picture"

local cases = {}

local function case(fields)
  fields.needs = { "block" }
  fields.except = { xpbd = "it has no place for a rigid solid" }
  cases[#cases + 1] = fields
end

local STANDARD_GRAVITY, GROUND = 9.81, 1e5 -- m/s^2, N/m

-- Fails where the energy of body and block ever rises by more than `share` of the most that there
-- is, from the lowest that their weight gets to.
local function never_gains(c, run, share)
  local rows, lowest, most, worst = run:trace "ledger", math.huge, 0, 0
  for _, row in ipairs(rows) do lowest = math.min(lowest, row[4]) end
  local least = math.huge
  for _, row in ipairs(rows) do
    local energy = row[1] + row[2] + row[3] + row[4] - lowest
    most, worst = math.max(most, energy), math.max(worst, energy - least)
    least = math.min(least, energy)
  end
  c:at_most("rise of the energy, of the most", worst / most, share)
end

local SIZE = { 0.3, 0.3, 0.3 } -- m

case { name = "a block dropped on a body from 1 m", brief = true, cpu = true, run = function(c)
  local run = c:run { lattice = { 4, 4, 2 }, duration = 6, energy = false,
    scene = { gravity = true, ground = true, friction = true, damping = true,
      block = { size = SIZE, position = { 0.05, 0.05, 1.2 } } },
    record = { ledger = 200 } }
  never_gains(c, run, 1e-2)
  -- it bounces and tumbles off: on the body, beside it or leaning on it
  local block = run.simulation:block(1)
  local at, q = block.position, block.orientation
  for _, corner in ipairs(block_picture.corners({ at[1], at[2], at[3], unpack(q) }, SIZE)) do
    c:at_least("height of a corner", corner[3], -1e-3)
  end
  for axis = 1, 3 do c:at_most("speed of the block", math.abs(block.velocity[axis]), 1e-2) end
end }

case { row = 32, name = "a block of 100 kg on a soft body", brief = true, run = function(c)
  local mass, lattice = 100, { 5, 5, 5 }
  local run = c:run { lattice = lattice, voxels = "s", duration = 3, energy = false,
    materials = { s = { stiffness = 5e3, damping_ratio = 2 } },
    scene = { gravity = true, ground = { damping_ratio = 1 }, friction = true, damping = true,
      block = { size = { 0.6, 0.6, 0.1 }, position = { -0.05, -0.05, 0.5 }, mass = mass,
        stiffness = 1e5, damping_ratio = 1 } } }
  local positions, velocities = run:state()
  local carried, speed = 0, c:by_precision { double = 1e-5, fp32 = 1e-3, single = 1e-2 }
  for i, p in ipairs(positions) do
    carried = carried + GROUND * math.max(0, -p[3])
    for axis = 1, 3 do c:at_most("speed at rest", math.abs(velocities[i][axis]), speed) end
  end
  c:near("force of the ground", carried, STANDARD_GRAVITY * (run:outcome().mass + mass),
    { rtol = c:by_precision { double = 1e-4, fp32 = 1e-3 } })
  c:at_least("height of the block", run.simulation:block(1).position[3], 0.35)
  c:at_least("uprightness of the block", run:outcome().block_upright, 1 - 1e-6)
end }

case { name = "a body that hits a block at 20 m/s", cpu = true, run = function(c)
  local block_mass, speed = 5, 20
  local run = c:run { lattice = { 3, 3, 3 }, duration = 0.5, energy = false,
    velocity = { speed, 0, 0 }, may_diverge = { "stretch" },
    scene = { damping = true, block = { size = { 0.2, 0.5, 0.5 }, position = { 0.4, -0.1, -0.1 },
      mass = block_mass } },
    record = { ledger = 1000 } }
  if run.verdict ~= "holds" then return end
  never_gains(c, run, 1e-2)
  local _, velocities = run:state()
  local momentum, block = 0, run.simulation:block(1)
  local each = run:outcome().mass / #velocities -- every mass is 0.1 kg
  for _, v in ipairs(velocities) do momentum = momentum + each * v[1] end
  c:at_least("speed of the block", block.velocity[1], 5)
  c:near("momentum", momentum + block_mass * block.velocity[1], speed * run:outcome().mass,
    { rtol = c:by_precision { double = 1e-12, fp32 = 1e-5, single = 1e-4 } })
end }

return cases
