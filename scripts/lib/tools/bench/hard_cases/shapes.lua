--- shapes.lua: hard cases of degenerate bodies and poses: coincident masses, turned-out voxels,
--- sheets, strings, pieces, nothing at all, and very much. SI units.

local engine = require "limax.engine"

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

-- Why XPBD is not asked.
local IN_ORDER = "springs come in an order, whose mirror image is another"

local STANDARD_GRAVITY, GROUND, EDGE = 9.81, 1e5, 0.1 -- m/s^2, N/m, m
local LAND = { gravity = true, ground = true, friction = true, damping = true }

-- Holds a body to the weight that its ground carries.
local function stands(c, run, tolerance)
  local sum = 0
  for _, p in ipairs((run:state())) do sum = sum + GROUND * math.max(0, -p[3]) end
  c:near("force of the ground", sum, STANDARD_GRAVITY * run:outcome().mass, tolerance)
end

case { row = 12, name = "two masses in one place", run = function(c)
  -- their spring has no direction and pulls nowhere: |f| <= k L, and the others part them. Momentum
  -- is held by the general checks.
  local run = c:run { lattice = { 2, 2, 2 }, scene = { damping = true }, duration = 2,
    bound_fraction = 0.5, center_tolerance = 10, place = function(positions)
      for axis = 1, 3 do positions[14][axis] = positions[1][axis] end
    end }
  local positions = run:state()
  local most = 0
  for axis = 1, 3 do most = math.max(most, math.abs(positions[14][axis] - positions[1][axis])) end
  c:at_least("distance of the two", most, 0.05)
end }

case { row = 12, name = "all masses in one place", smooth = true, run = function(c)
  -- every force is exactly 0: an unstable balance that nothing leaves
  local run = c:run { lattice = { 2, 2, 2 }, scene = { damping = true }, duration = 1,
    place = function(positions)
      for _, p in ipairs(positions) do p[1], p[2], p[3] = 0.5, 0.25, 1 end
    end }
  local positions, velocities = run:state()
  for i = 1, #positions do
    c:same_bits("place", positions[i], { 0.5, 0.25, 1 })
    c:same_bits("velocity", velocities[i], { 0, 0, 0 })
  end
end }

-- Volume of the tetrahedra of a voxel's first corner, six times, m^3: below 0 if it is inside out.
local function signed_volume(p)
  local function edge(i)
    return { p[i][1] - p[1][1], p[i][2] - p[1][2], p[i][3] - p[1][3] }
  end
  local a, b, d = edge(2), edge(3), edge(5)
  return a[1] * (b[2] * d[3] - b[3] * d[2]) - a[2] * (b[1] * d[3] - b[3] * d[1])
    + a[3] * (b[1] * d[2] - b[2] * d[1])
end

case { row = 13, name = "a voxel turned inside out", run = function(c)
  -- its upper face is put as far below the lower one: a mirrored voxel is as relaxed as itself
  local before
  local run = c:run { lattice = { 1, 1, 1 }, scene = { damping = true }, duration = 1,
    place = function(positions)
      before = signed_volume(positions)
      for i = 5, 8 do positions[i][3] = -1.3 * positions[i][3] end
    end }
  local positions = run:state()
  c:at_least("volume at first", before, 0.9e-3)
  -- springs alone do not know their left from their right: it stays inside out, and at rest
  c:near("volume", signed_volume(positions), -1e-3, { rtol = 1e-3 })
  c:at_most("speed", run:fastest(), c:by_precision { double = 1e-6, fp32 = 1e-4 })
end }

case { row = 13, name = "a corner pushed through the opposite face", run = function(c)
  local run = c:run { lattice = { 3, 3, 3 }, scene = { damping = true }, duration = 2,
    bound_fraction = 0.5, place = function(positions)
      local corner = positions[#positions]
      for axis = 1, 3 do corner[axis] = corner[axis] - 0.15 end
    end }
  c:at_most("speed", run:fastest(), c:by_precision { double = 1e-2, fp32 = 1e-2 })
end }

case { row = 14, name = "a body pressed flat", run = function(c)
  local function flat(lift)
    return c:run { lattice = { 2, 2, 2 }, scene = { damping = true }, duration = 1,
      bound_fraction = 0.5, center_tolerance = 50, place = function(positions)
        for i, p in ipairs(positions) do p[3] = lift * math.sin(7 * i) end
      end }
  end
  -- no spring has a part along z, so that no force has: heights stay 0, every bit of them
  for _, p in ipairs((flat(0):state())) do c:same_bits("height", p[3], 0) end
  -- the least bend is enough to leave that balance
  local low, high = math.huge, -math.huge
  for _, p in ipairs((flat(1e-4):state())) do
    low, high = math.min(low, p[3]), math.max(high, p[3])
  end
  c:at_least("thickness", high - low, 0.05)
end }

for _, share in ipairs { 0.7, 0.3, 0.05 } do
  case { row = 15, name = ("crushed to %g of its length"):format(share), run = function(c)
    -- the general check holds the energy to what was stored; below half its length a spring is
    -- stiffer to the side than the step's bound asks, so that only a share of the step is taken
    c:run { lattice = { 3, 3, 3 }, scene = { damping = true }, duration = 1,
      bound_fraction = share < 0.5 and 0.09 or 0.9, center_tolerance = 5,
      place = function(positions)
        for _, p in ipairs(positions) do
          for axis = 1, 3 do p[axis] = 0.15 + share * (p[axis] - 0.15) end
        end
      end }
  end }
end

case { row = 41, name = "one voxel falls, lands and rests", run = function(c)
  local run = c:run { lattice = { 1, 1, 1 }, voxels = "s", scene = LAND, duration = 4,
    position = { 0, 0, 0.2 }, materials = { s = { damping_ratio = 0.5 } } }
  stands(c, run, { rtol = 0.02 })
end }

case { row = 42, name = "a robot without a voxel", run = function(c)
  local run = c:run { lattice = { 2, 2, 2 }, voxels = function(_, _, _, robot)
    return robot == 1 and "." or "b" end, count = 2, scene = LAND, status = "invalid" }
  c:same_bits("status", run:outcome(1).status, "invalid")
  c:same_bits("reason", run:outcome(1).reason, "no voxel")
  c:same_bits("its neighbour", run:outcome(2).status, "done")
end }

case { row = 43, name = "one mass without a spring",
  absent = "every voxel brings 8 masses and 28 springs; tests/engine/physics/laws_test.cpp lets one fall" }

case { row = 44, name = "two pieces that know nothing of each other", run = function(c)
  local function first_piece(second)
    local run = c:run { lattice = { 4, 1, 1 }, duration = 1, energy = false,
      voxels = function(x) return x == 1 and "e" or (x == 4 and second or ".") end,
      scene = { gravity = true, ground = true, friction = true, damping = true,
        actuation = true } }
    local positions, piece = run:state(), {}
    for _, p in ipairs(positions) do
      if p[1] < 0.2 then piece[#piece + 1] = p end
    end
    return piece, run:outcome()
  end
  local alone = first_piece "."
  local beside, outcome = first_piece "c"
  c:same_bits("the first piece", beside, alone)
  -- the centre of mass is that of both
  c:near("centre of mass", outcome.center_start[1], 0.2, { atol = 0.01 })
end }

case { row = 45, name = "a table on legs of one voxel",
  except = { xpbd = IN_ORDER }, run = function(c)
  local function leg(x, y) return (x == 1 or x == 5) and (y == 1 or y == 5) end
  local run = c:run { lattice = { 5, 5, 4 }, scene = LAND, duration = 2,
    voxels = function(x, y, z) return (z == 4 or leg(x, y)) and "b" or "." end,
    materials = { b = { damping_ratio = 1 } } }
  local positions = run:state()
  stands(c, run, { rtol = 0.01 })
  -- it is its own mirror image, and stays so
  local left, right = math.huge, -math.huge
  for _, p in ipairs(positions) do left, right = math.min(left, p[1]), math.max(right, p[1]) end
  c:near("middle", 0.5 * (left + right), 0.25,
    { atol = c:by_precision { double = 1e-9, fp32 = 1e-5 } })
end }

case { name = "a sheet of one voxel", run = function(c)
  local run = c:run { lattice = { 10, 10, 1 }, voxels = "s", scene = LAND, duration = 2,
    position = { 0, 0, 0.1 }, materials = { s = { damping_ratio = 1 } } }
  stands(c, run, { rtol = 0.05 })
end }

case { name = "a string of voxels dropped on end", run = function(c)
  -- it buckles and falls over: an end that is finite and near the ground
  local run = c:run { lattice = { 1, 1, 20 }, voxels = "s", duration = 3, scene = LAND,
    materials = { s = { damping_ratio = 0.5 } }, may_diverge = { "stretch" },
    place = function(positions)
      for i, p in ipairs(positions) do p[1], p[3] = p[1] + 1e-3 * math.sin(i), p[3] + 0.3 end
    end }
  local top = 0
  for _, p in ipairs((run:state())) do top = math.max(top, p[3]) end
  c:at_most("height", top, 1.5)
end }

case { name = "voxels that hang together by edges and corners alone", run = function(c)
  -- springs of a checkerboard: half of the voxels are absent, and with them their springs
  local run = c:run { lattice = { 5, 5, 5 }, scene = LAND, duration = 1, voxels =
    function(x, y, z) return (x + y + z) % 2 == 0 and "b" or "." end }
  c:near("masses", run:outcome().mass / 0.1, run.simulation.masses[1], { rtol = 1e-6 })
end }

-- Bytes that a robot of a full lattice takes of this process on the CPU, by what it holds: per site
-- a column of the state for x, u, the next u and 1 / m, for p in leapfrog, for what compensation
-- carries, and for m where it is not as the body has it; springs' stiffness and damping in fp32; x
-- and p as springs see them in `mixed`; and what a thread lends.
local function predicted_bytes(c, lattice)
  local sites = (lattice[1] + 1) * (lattice[2] + 1) * (lattice[3] + 1)
  local voxels = lattice[1] * lattice[2] * lattice[3]
  local wide = c.precision == "double" or c.precision == "mixed"
  local columns = 10 + (c.integrator == "leapfrog" and 3 or 0)
    + (c.precision == "compensated" and 6 or 0) + (wide and 1 or 0)
  local state = columns * (wide and 8 or 4) + (c.precision == "mixed" and 6 * 4 or 0)
  local springs = 2 * 13 * 4
  -- a body has masses and their sites; XPBD what is left of springs and which sites are odd
  local body = 4 + 4
  local extra = springs / 4 + 3 + (c.precision == "mixed" and 4 or 0)
  local xpbd = c.integrator == "xpbd" and extra * (c.precision == "double" and 8 or 4) or 0
  local lent = 6 * 8
  -- material and three weights, of the population and of the simulation
  return sites * (state + springs + body + xpbd + lent) + voxels * 2 * (1 + 3 * 4)
end

case { row = 47, name = "50x50x50 voxels, some of them holes", brief = true, run = function(c)
  local draw = engine.random(47, 1, "user")
  local lattice = { 50, 50, 50 }
  -- each thread that takes the robot on lends it memory: one does
  if c.device.kind == "cpu" then c.device = engine.device("cpu", { threads = 1 }) end
  collectgarbage "collect"
  local before = engine.bytes_held()
  local spec = { lattice = lattice, scene = LAND, energy = c.full,
    duration = c.full and 0.5 or 0.05, time_step = c.full and "auto" or 5e-4 / 2,
    record = c.full and { energy = 20 } or nil,
    voxels = function() return draw:uniform() < 0.2 and "." or "b" end }
  -- in full the general checks watch the energy too
  local run = c.full and c:run(spec) or c:prepare(spec)
  if not c.full then run.simulation:advance(1e6, 64) end
  local outcome = run:outcome()
  c:same_bits("status", outcome.status, c.full and "done" or "running")
  c:at_least("springs", outcome.springs, 1e6)
  local held = engine.bytes_held() - before
  -- one that has ended gives most of its memory back, and a GPU holds its own
  if not c.full and c.device.kind == "cpu" then
    c:near("bytes held", held, predicted_bytes(c, lattice), { rtol = 0.05 })
  end
  local positions, velocities = run:state()
  local lowest = math.huge
  for i, p in ipairs(positions) do
    for axis = 1, 3 do
      c:at_most("speed", math.abs(velocities[i][axis]), 20)
    end
    lowest = math.min(lowest, p[3])
  end
  c:at_least("lowest mass", lowest, -EDGE)
  c:note("%d masses, %d springs, %.0f MB", outcome.masses, outcome.springs, held / 1e6)
end }

return cases
