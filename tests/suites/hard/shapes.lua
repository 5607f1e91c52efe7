--- shapes.lua: hard cases of degenerate bodies and poses: coincident masses, inverted voxels,
--- pieces and very large bodies. Row 43, a mass without a spring, is not a body of voxels:
--- tests/engine/physics/contact_test.cpp has it. SI units.

local context = require "limax.tools.bench.hard_cases.context"
local engine = require "limax.engine"
local case = require("limax.tools.bench.hard_cases").suite "shapes"

local LAND = context.LAND

case { row = 12, name = "two masses at one position", run = function(c)
  -- their spring has no direction and no force; the other springs separate them
  local run = c:run { lattice = { 2, 2, 2 }, scene = { damping = true }, duration = 2,
    bound_fraction = 0.5, center_tolerance = 10, place = function(positions)
      for axis = 1, 3 do positions[14][axis] = positions[1][axis] end
    end }
  local positions, most = run:state(), 0
  for axis = 1, 3 do most = math.max(most, math.abs(positions[14][axis] - positions[1][axis])) end
  c:at_least("distance of the two", most, 0.05)
end }

case { row = 12, name = "all masses at one position", smooth = true, run = function(c)
  -- every force is exactly 0
  local run = c:run { lattice = { 2, 2, 2 }, scene = { damping = true }, duration = 0.5,
    place = function(positions)
      for _, p in ipairs(positions) do p[1], p[2], p[3] = 0.5, 0.25, 1 end
    end }
  local positions, velocities = run:state()
  for i = 1, #positions do
    c:same_bits("position", positions[i], { 0.5, 0.25, 1 })
    c:same_bits("velocity", velocities[i], { 0, 0, 0 })
  end
end }

-- Signed volume of the box of a voxel's first three edges, m^3; negative if it is inverted.
local function signed_volume(p)
  local function edge(i)
    return { p[i][1] - p[1][1], p[i][2] - p[1][2], p[i][3] - p[1][3] }
  end
  local a, b, d = edge(2), edge(3), edge(5)
  return a[1] * (b[2] * d[3] - b[3] * d[2]) - a[2] * (b[1] * d[3] - b[3] * d[1])
    + a[3] * (b[1] * d[2] - b[2] * d[1])
end

case { row = 13, name = "an inverted voxel", run = function(c)
  local run = c:run { lattice = { 1, 1, 1 }, scene = { damping = true }, duration = 1,
    place = function(positions)
      for i = 5, 8 do positions[i][3] = -1.3 * positions[i][3] end
    end }
  -- springs do not distinguish left from right: it stays inverted, at rest
  c:near("volume", signed_volume((run:state())), -1e-3, { rtol = 1e-3 })
  c:at_most("speed", run:fastest(), { double = 1e-6, fp32 = 1e-4 })
end }

case { row = 13, name = "a corner pushed through the opposite face", run = function(c)
  local run = c:run { lattice = { 3, 3, 3 }, scene = { damping = true }, duration = 2,
    bound_fraction = 0.5, place = function(positions)
      local corner = positions[#positions]
      for axis = 1, 3 do corner[axis] = corner[axis] - 0.15 end
    end }
  c:at_most("speed", run:fastest(), 1e-2)
end }

case { row = 14, name = "a body pressed flat", run = function(c)
  local function flat(lift)
    return c:run { lattice = { 2, 2, 2 }, scene = { damping = true }, duration = 1,
      bound_fraction = 0.5, center_tolerance = 50, place = function(positions)
        for i, p in ipairs(positions) do p[3] = lift * math.sin(7 * i) end
      end }
  end
  -- no force has a component along z
  c:same_bits("heights", { flat(0):extent(3) }, { 0, 0 })
  -- the least bend leaves that balance
  local low, high = flat(1e-4):extent(3)
  c:at_least("thickness", high - low, 0.05)
end }

case { row = 15, name = "crushed to 0.7, 0.3 and 0.05 of its length", run = function(c)
  -- below half its length a spring is stiffer sideways than the bound assumes: a smaller step
  for _, crushed in ipairs { { 0.7, 0.9 }, { 0.3, 0.09 }, { 0.05, 0.09 } } do
    c:run { lattice = { 3, 3, 3 }, scene = { damping = true }, duration = 0.5,
      bound_fraction = crushed[2], center_tolerance = 5, place = function(positions)
        for _, p in ipairs(positions) do
          for axis = 1, 3 do p[axis] = 0.15 + crushed[1] * (p[axis] - 0.15) end
        end
      end }
  end
end }

case { row = 44, name = "two separate pieces do not affect each other", run = function(c)
  local function first_piece(second)
    local run = c:run { lattice = { 4, 1, 1 }, duration = 1, energy = false,
      voxels = function(x) return x == 1 and "e" or (x == 4 and second or ".") end,
      scene = { gravity = true, ground = true, friction = true, damping = true,
        actuation = true } }
    local piece = {}
    for _, p in ipairs((run:state())) do
      if p[1] < 0.2 then piece[#piece + 1] = p end
    end
    return piece, run:outcome()
  end
  local both, outcome = first_piece "c"
  c:same_bits("the first piece", both, (first_piece "."))
  c:near("centre of mass of both", outcome.center_start[1], 0.2, { atol = 0.01 })
end }

case { row = 45, name = "a table on legs of one voxel",
  run = function(c)
    local function leg(x, y) return (x == 1 or x == 5) and (y == 1 or y == 5) end
    local run = c:run { lattice = { 5, 5, 4 }, scene = LAND, duration = 2,
      voxels = function(x, y, z) return (z == 4 or leg(x, y)) and "b" or "." end,
      materials = { b = { damping_ratio = 1 } } }
    c:near("force of the ground", run:ground_force(), run:weight(), { rtol = 0.01 })
    local left, right = run:extent(1)
    c:near("middle", 0.5 * (left + right), 0.25, { atol = { double = 1e-9, fp32 = 1e-5 } })
  end }

case { name = "voxels joined only by edges and corners", run = function(c)
  local run = c:run { lattice = { 5, 5, 5 }, scene = LAND, duration = 0.5,
    voxels = function(x, y, z) return (x + y + z) % 2 == 0 and "b" or "." end }
  c:near("masses", run:outcome().mass / 0.1, run.simulation.masses[1], { rtol = 1e-6 })
end }

case { row = 47, name = "50x50x50 voxels, some of them holes", brief = true, run = function(c)
  local random, before = engine.random(47, 1, "user"), engine.bytes_held()
  local spec = { lattice = { 50, 50, 50 }, scene = LAND, energy = c.full, duration = 0.5,
    time_step = c.full and "auto" or 2.5e-4, record = c.full and { energy = 20 } or nil,
    voxels = function() return random:uniform() < 0.2 and "." or "b" end }
  local run = c.full and c:run(spec) or c:prepare(spec)
  if not c.full then run:advance(16) end
  local outcome, held = run:outcome(), engine.bytes_held() - before
  c:same_bits("status", outcome.status, c.full and "done" or "running")
  c:at_least("springs", outcome.springs, 1e6)
  -- at most 10 columns of doubles and two of springs' fields; and for each thread of a CPU
  -- the scratch memory of a step, 6 columns
  local threads = c.device:describe().threads or 1
  c:at_most("bytes of a site", held / 51 ^ 3, 450 + 50 * threads)
  c:at_most("speed", run:fastest(), 40)
  c:at_least("lowest mass", (run:extent(3)), -0.1)
end }
