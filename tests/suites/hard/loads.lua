--- loads.lua: hard cases of bodies that carry loads. SI units.

local context = require "limax.tools.bench.hard_cases.context"
local statics = require "limax.tools.bench.hard_cases.statics"
local case = require("limax.tools.bench.hard_cases").suite "loads"

local EDGE, GROUND = 0.1, context.GROUND

local COLUMN = { lattice = { 1, 1, 20 }, stiffness = 1e4, mass = 0.1 }

-- The upright column under `gravity` by Newton's method, and the number of negative eigenvalues of
-- its stiffness. Friction holds the feet.
local function upright(gravity)
  local box = statics.box(COLUMN.lattice, EDGE)
  local positions = statics.positions(box, EDGE)
  local function held(mass, axis) return box.sites[mass][3] == 0 and axis < 3 end
  for _ = 1, 12 do
    local forces = statics.forces(box, COLUMN.stiffness, positions)
    local matrix, right = statics.stiffness(box, COLUMN.stiffness, positions), {}
    for i, force in ipairs(forces) do
      force[3] = force[3] - COLUMN.mass * gravity
      if box.sites[i][3] == 0 then
        force[3] = force[3] - GROUND * positions[i][3]
        matrix[3 * i][3 * i] = matrix[3 * i][3 * i] + GROUND
      end
      for axis = 1, 3 do right[3 * i - 3 + axis] = held(i, axis) and 0 or force[axis] end
    end
    statics.hold(matrix, held)
    local negative = statics.solve(matrix, right)
    for i, p in ipairs(positions) do
      for axis = 1, 3 do p[axis] = p[axis] + right[3 * i - 3 + axis] end
    end
    if negative > 0 then return positions, negative end
  end
  return positions, 0
end

-- The gravity at which the upright column becomes unstable, m/s^2.
local critical
local function critical_gravity()
  if critical then return critical end
  local stable, unstable = 0, 1
  while select(2, upright(unstable)) == 0 do stable, unstable = unstable, 2 * unstable end
  for _ = 1, 6 do
    critical = 0.5 * (stable + unstable)
    if select(2, upright(critical)) > 0 then unstable = critical else stable = critical end
  end
  return critical
end

for _, share in ipairs { 0.9, 1.1 } do
  case { row = 16, name = ("a column at %g of the load that buckles it"):format(share),
    brief = true, run = function(c)
      local gravity, push = share * critical_gravity(), 1e-4
      local pose = upright(gravity)
      local run = c:run { lattice = COLUMN.lattice, duration = share < 1 and 4 or 12,
        energy = false, materials = { b = { stiffness = COLUMN.stiffness, damping_ratio = 0.5 } },
        scene = { gravity = { acceleration = { 0, 0, -gravity } }, ground = true, damping = true,
          friction = { static = 1000, kinetic = 1000 } },
        place = function(positions)
          -- about the first mode
          for i, p in ipairs(positions) do
            p[1], p[2], p[3] = pose[i][1] + push * (pose[i][3] / 2) ^ 2, pose[i][2], pose[i][3]
          end
        end }
      local lean = math.abs(run:state()[#pose][1] - pose[#pose][1])
      if share < 1 then
        c:at_most("lean of the top", lean, push)
      else
        c:at_least("lean of the top", lean, 50 * push)
      end
    end }
end

case { name = "a tower of 50 voxels under its own weight", brief = true,
  run = function(c)
    -- starts at about its static pose: a layer's edges and diagonals carry what is above it
    local per_layer, layer_weight = (16 + 12 + 36 / 3) * 1e5, 16 * 0.1 * context.GRAVITY
    local run = c:run { lattice = { 3, 3, 50 }, scene = context.LAND,
      duration = c.full and 20 or 0.5, record = { energy = 20 },
      materials = { b = { stiffness = 1e5, damping_ratio = 0.5 } }, place = function(positions)
        for _, p in ipairs(positions) do
          local layer = p[3] / EDGE
          p[3] = p[3] - layer_weight * (layer * 50 - 0.5 * layer * layer) / per_layer
            - 51 * layer_weight / (16 * GROUND)
        end
      end }
    if c.full then
      c:near("force of the ground", run:ground_force(), run:weight(), { rtol = 0.01 })
    end
    local top = run:state()[16 * 51]
    c:near("height", top[3], 5, { rtol = 0.05 })
    c:near("lean", top[1], 0.3, { atol = 0.01 })
    c:at_most("speed", run:fastest(), 0.1)
  end }

case { name = "a load that crushes a column", run = function(c)
  -- under 100 g it collapses to a heap, or a torn spring is reported; the energy never rises
  local run = c:run { lattice = { 1, 1, 8 }, voxels = "s", duration = 1,
    scene = { gravity = { acceleration = { 0, 0, -981 } }, ground = true, friction = true,
      damping = true }, may_diverge = { "stretch" }, place = function(positions)
        for i, p in ipairs(positions) do p[1] = p[1] + 1e-3 * math.sin(5 * i) end
      end }
  if run.verdict == "holds" then c:at_most("height", select(2, run:extent(3)), 0.8) end
end }

case { row = 17, name = "tip of a cantilever", brief = true, run = function(c)
  local lattice, stiffness, gravity = { 10, 1, 1 }, 1e4, 0.02
  local box = statics.box(lattice, EDGE)
  local function held(mass) return box.sites[mass][1] == 0 end
  local matrix, moved = statics.stiffness(box, stiffness, statics.positions(box, EDGE)), {}
  for i = 1, #box.sites do
    for axis = 1, 3 do
      moved[3 * i - 3 + axis] = axis == 3 and not held(i) and -0.1 * gravity or 0
    end
  end
  statics.hold(matrix, held)
  statics.solve(matrix, moved)
  -- starts at the linear solution: so slow a beam would swing for minutes
  local run = c:run { lattice = lattice, duration = 2, energy = false, center = false,
    materials = { b = { stiffness = stiffness, damping_ratio = 1 } },
    scene = { gravity = { acceleration = { 0, 0, -gravity } }, damping = true,
      anchors = { from = { -0.01, -0.01, -0.01 }, to = { 0.01, 0.11, 0.11 } } },
    place = function(positions)
      for i, p in ipairs(positions) do
        for axis = 1, 3 do p[axis] = p[axis] + moved[3 * i - 3 + axis] end
      end
    end, record = { position = 20 } }
  c:at_most("deflection by statics", moved[3 * 11], -5e-4)
  -- linear up to 4e-5, the square of the strain; fp32 lengths are rounded to 4e-9 m, which ten
  -- voxels in a row magnify to 1e-7 m at the tip
  for _, row in ipairs(run:trace "position") do
    c:near("deflection", row[11][3], moved[3 * 11], { rtol = { double = 1e-4, fp32 = 2e-4 } })
  end
end }
