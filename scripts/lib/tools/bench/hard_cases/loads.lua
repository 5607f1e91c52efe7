--- loads.lua: hard cases of bodies that carry: columns, towers, plates, and loads that crush. SI
--- units.

local statics = require "limax.tools.bench.hard_cases.statics"

local cases = {}

local function case(fields) cases[#cases + 1] = fields end

-- Why XPBD is not asked.
local SOFT = "a long step makes springs soft: it carries less"

local STANDARD_GRAVITY, GROUND, EDGE = 9.81, 1e5, 0.1 -- m/s^2, N/m, m
local LAND = { gravity = true, ground = true, friction = true, damping = true }

-- The largest force, N, that is left on any mass of a full box of one material at rest on the
-- ground, and the weight of one mass. Friction takes what is level at the foot.
local function unbalanced(c, run, lattice, stiffness, gravity, speed)
  local positions, velocities = run:state()
  local box = statics.box(lattice, EDGE)
  local forces, most = statics.forces(box, stiffness, positions), 0
  local mass = run:outcome().mass / #positions
  for i, force in ipairs(forces) do
    local below = math.max(0, -positions[i][3])
    force[3] = force[3] - mass * gravity + GROUND * below
    for axis = 1, 3 do
      if below == 0 or axis == 3 then most = math.max(most, math.abs(force[axis])) end
      c:at_most("speed at rest", math.abs(velocities[i][axis]),
        speed)
    end
  end
  return most, mass * gravity
end

-- ---- buckling ----------------------------------------------------------------------------------

local COLUMN = { lattice = { 1, 1, 20 }, stiffness = 1e4, mass = 0.1 }

-- A column of one voxel across under `gravity`, upright, by Newton's method on heights alone: the
-- pose keeps its two planes of symmetry, so that a spring model of 84 masses is asked for its
-- forces and its stiffness.
local function upright(gravity)
  local box = statics.box(COLUMN.lattice, EDGE)
  local positions = {}
  for i, site in ipairs(box.sites) do
    positions[i] = { EDGE * site[1], EDGE * site[2], EDGE * site[3] }
  end
  local matrix
  for _ = 1, 12 do
    local forces = statics.forces(box, COLUMN.stiffness, positions)
    matrix = statics.stiffness(box, COLUMN.stiffness, positions)
    local right = {}
    for i = 1, #positions do
      local foot = box.sites[i][3] == 0
      forces[i][3] = forces[i][3] - COLUMN.mass * gravity
      if foot then
        forces[i][3] = forces[i][3] - GROUND * positions[i][3]
        matrix[3 * i][3 * i] = matrix[3 * i][3 * i] + GROUND
      end
      for axis = 1, 3 do
        -- friction holds the feet
        right[3 * i - 3 + axis] = foot and axis < 3 and 0 or forces[i][axis]
      end
    end
    statics.hold(matrix, function(mass, axis) return box.sites[mass][3] == 0 and axis < 3 end)
    local tangent = {}
    for i, row in ipairs(matrix) do tangent[i] = { unpack(row) } end
    local negative = statics.solve(tangent, right)
    for i = 1, #positions do
      for axis = 1, 3 do
        positions[i][axis] = positions[i][axis] + right[3 * i - 3 + axis]
      end
    end
    if negative > 0 then return positions, negative end
  end
  return positions, 0
end

-- The gravity at which the upright column's stiffness loses its first positive eigenvalue, m/s^2.
local critical
local function critical_gravity()
  if critical then return critical end
  local unstable = 1
  while select(2, upright(unstable)) == 0 do unstable = 2 * unstable end
  local stable = unstable / 2
  for _ = 1, 6 do
    local middle = 0.5 * (stable + unstable)
    local _, negative = upright(middle)
    if negative > 0 then unstable = middle else stable = middle end
  end
  critical = 0.5 * (stable + unstable)
  return critical
end

for _, share in ipairs { 0.9, 1.1 } do
  case { row = 16, name = ("a column at %g of the load that buckles it"):format(share),
    except = { xpbd = SOFT },
    brief = true, run = function(c)
      local gravity = share * critical_gravity()
      local pose = upright(gravity)
      local push = 1e-4
      local function lean(leaning)
        local run = c:run { lattice = COLUMN.lattice, duration = 12, energy = false,
          materials = { b = { stiffness = COLUMN.stiffness, damping_ratio = 0.5 } },
          scene = { gravity = { acceleration = { 0, 0, -gravity } }, ground = true, damping = true,
            friction = { static = 1000, kinetic = 1000 } },
          place = function(positions)
            for i, p in ipairs(positions) do
              -- as leaning as its height, squared: about the first mode
              p[1], p[2], p[3] = pose[i][1] + leaning * push * (pose[i][3] / 2) ^ 2, pose[i][2],
                pose[i][3]
            end
          end }
        local top = run:state()[#pose]
        return math.abs(top[1] - pose[#pose][1])
      end
      local top = lean(1)
      if share < 1 then
        c:at_most("lean of the top", top, push)
        if c.precision == "double" then
          -- upright, nothing pushes it to a side but rounding
          c:at_most("lean of the top where none was given", lean(0), 1e-9)
        end
      else
        c:at_least("lean of the top", top, 50 * push)
      end
      c:note("the column buckles at %.3g m/s^2", critical_gravity())
    end }
end

-- ---- weights -----------------------------------------------------------------------------------

case { name = "a tower of 50 voxels under its own weight", brief = true,
  except = { xpbd = SOFT }, run = function(c)
  local lattice, stiffness = { 3, 3, 50 }, 1e5
  -- set down at about where it will stand: a layer's edges and diagonals carry what is above it
  local per_layer = (16 + 12 + 36 / 3) * stiffness -- N/m
  local layer_weight = 16 * 0.1 * STANDARD_GRAVITY -- N
  local run = c:run { lattice = lattice, scene = LAND, duration = c.full and 20 or 2,
    materials = { b = { stiffness = stiffness, damping_ratio = 0.5 } }, record = { energy = 20 },
    place = function(positions)
      for _, p in ipairs(positions) do
        local layer = p[3] / EDGE
        p[3] = p[3] - layer_weight * (layer * 50 - 0.5 * layer * layer) / per_layer
          - 51 * layer_weight / (16 * GROUND)
      end
    end }
  -- a mass at 5 m is rounded to 5e-7 m: so many newtons over a stiffness of 10^5 N/m
  local left, weight = unbalanced(c, run, lattice, stiffness, STANDARD_GRAVITY,
    c.full and c:by_precision { double = 1e-6, fp32 = 5e-4, single = 1e-2 } or 0.1)
  c:at_most("unbalanced force over a mass's weight", left / weight,
    c.full and c:by_precision { double = 1e-5, fp32 = 0.5, single = 3 } or 20)
  local top = run:state()[16 * 51]
  c:near("height", top[3], 5, { rtol = 0.05 })
  c:near("lean", top[1], 0.3, { atol = 0.01 })
end }

-- Mean height of the upper face of a box at rest on the ground, where Newton's method on all its
-- equations puts it, m: from `positions`, for it only has to be near. Feet stay where they are.
local function upper_face_by_statics(box, positions, masses, top)
  local right, matrix = {}, statics.stiffness(box, nil, positions)
  for i, force in ipairs(statics.forces(box, nil, positions)) do
    local foot = box.sites[i][3] == 0
    force[3] = force[3] - masses[i] * STANDARD_GRAVITY
    if foot then
      force[3] = force[3] - GROUND * positions[i][3]
      matrix[3 * i][3 * i] = matrix[3 * i][3 * i] + GROUND
    end
    for axis = 1, 3 do right[3 * i - 3 + axis] = foot and axis < 3 and 0 or force[axis] end
  end
  statics.hold(matrix, function(mass, axis) return box.sites[mass][3] == 0 and axis < 3 end)
  statics.solve(matrix, right)
  local height, moved = 0, 0
  for i = #positions - top + 1, #positions do
    height = height + (positions[i][3] + right[3 * i]) / top
    moved = math.max(moved, math.abs(right[3 * i]))
  end
  return height, moved
end

case { row = 32, name = "100 kg on a soft body", brief = true, except = { xpbd = SOFT },
  run = function(c)
  -- five layers of soft tissue, whose upper face carries a plate's mass: 36 sites
  local plate = 100
  local lattice = { 5, 5, 6 }
  local run = c:run { lattice = lattice, scene = { gravity = true, ground = { damping_ratio = 1 },
    friction = { static = 1000, kinetic = 1000 }, damping = true }, duration = 5,
    voxels = function(_, _, z) return z == 6 and "b" or "s" end,
    materials = { s = { stiffness = 5e3, damping_ratio = 2 },
      b = { stiffness = 1e5, mass_per_site = plate / 36 / 1.5, damping_ratio = 2 } },
    record = { energy = 20 } }
  local positions, velocities = run:state()
  local carried = 0
  for i, p in ipairs(positions) do
    carried = carried + GROUND * math.max(0, -p[3])
    for axis = 1, 3 do
      c:at_most("speed at rest", math.abs(velocities[i][axis]),
        -- plain sums lose what moves a place of 0.5 m by less than 3e-8 m in a step of 1e-5 s
        c:by_precision { double = 1e-5, fp32 = 1e-5, single = 5e-3 })
    end
  end
  c:near("force of the ground", carried, STANDARD_GRAVITY * run:outcome().mass,
    { rtol = c:by_precision { double = 1e-6, fp32 = 1e-6, single = 1e-4 } })
  -- the plate's layer is half of the mass of the sites that it shares with the soft ones
  local box = statics.box(lattice, EDGE, { 5e3, 5e3, 5e3, 5e3, 5e3, 1e5 })
  local own, masses = plate / 36 / 1.5, {}
  for i, site in ipairs(box.sites) do
    masses[i] = site[3] == 6 and own or site[3] == 5 and 0.5 * (own + 0.1) or 0.1
  end
  local height, face = 0, 36
  for i = #positions - face + 1, #positions do height = height + positions[i][3] / face end
  local expected, moved = upper_face_by_statics(box, positions, masses, face)
  c:near("compression", 6 * EDGE - height, 6 * EDGE - expected, { rtol = 0.01 })
  c:at_most("way to the static pose", moved, 0.01 * (6 * EDGE - expected))
  c:note("compressed by %.4g m; the static pose is %.2g m away", 6 * EDGE - height, moved)
  c:at_least("height of the plate", positions[#positions][3], 0.3)
end }

case { name = "a load that crushes a column", run = function(c)
  -- a column of soft tissue under 100 g collapses: voxels turn inside out and it ends as a heap, or
  -- a spring is torn and that is reported. The energy never rises.
  local run = c:run { lattice = { 1, 1, 8 }, voxels = "s", duration = 1,
    scene = { gravity = { acceleration = { 0, 0, -981 } }, ground = true, friction = true,
      damping = true }, place = function(positions)
        for i, p in ipairs(positions) do p[1] = p[1] + 1e-3 * math.sin(5 * i) end
      end, may_diverge = { "stretch" } }
  if run.verdict == "holds" then
    local top = -math.huge
    for _, p in ipairs((run:state())) do top = math.max(top, p[3]) end
    c:at_most("height of what is left", top, 0.8)
  end
end }

case { name = "a crushed voxel comes back when the load goes", run = function(c)
  -- pressed to a fifth of its height, then let go
  local run = c:run { lattice = { 2, 2, 2 }, voxels = "s", duration = 3,
    materials = { s = { damping_ratio = 1 } },
    scene = { damping = true }, place = function(positions)
      for _, p in ipairs(positions) do p[3] = 0.2 * p[3] end
    end }
  local low, high = math.huge, -math.huge
  for _, p in ipairs((run:state())) do
    low, high = math.min(low, p[3]), math.max(high, p[3])
  end
  c:near("height", high - low, 0.2, { atol = 1e-3 })
end }

case { row = 17, name = "tip of a cantilever", needs = { "anchors" }, brief = true,
  except = { xpbd = SOFT },
  run = function(c)
    local lattice, stiffness, gravity = { 10, 1, 1 }, 1e4, 0.02
    local box = statics.box(lattice, EDGE)
    local positions = {}
    for i, site in ipairs(box.sites) do
      positions[i] = { EDGE * site[1], EDGE * site[2], EDGE * site[3] }
    end
    local matrix, right = statics.stiffness(box, stiffness, positions), {}
    local function held(mass) return box.sites[mass][1] == 0 end
    for i = 1, #positions do
      for axis = 1, 3 do
        right[3 * i - 3 + axis] = axis == 3 and not held(i) and -0.1 * gravity or 0
      end
    end
    statics.hold(matrix, held)
    statics.solve(matrix, right)
    -- put where the linear solution has it, at rest: what that misses would make it swing, for a
    -- beam as slow as this swings for minutes
    local run = c:run { lattice = lattice, duration = 2, energy = false, center = false,
      materials = { b = { stiffness = stiffness, damping_ratio = 1 } },
      scene = { gravity = { acceleration = { 0, 0, -gravity } }, damping = true,
        anchors = { from = { -0.01, -0.01, -0.01 }, to = { 0.01, 0.11, 0.11 } } },
      place = function(p)
        for i = 1, #p do
          for axis = 1, 3 do p[i][axis] = p[i][axis] + right[3 * i - 3 + axis] end
        end
      end, record = { position = 20 } }
    local deflection = right[3 * 11]
    c:at_most("deflection by statics", deflection, -5e-4)
    -- Small loads: the linear solution up to the square of the strain, 4e-5 here. In fp32 lengths
    -- of 0.1 m are rounded to 4e-9 m, which ten voxels in a row magnify to 1e-7 m at the tip: no
    -- load is both large beside that and small enough to be linear.
    for _, row in ipairs(run:trace "position") do
      c:near("deflection", row[11][3], deflection,
        { rtol = c:by_precision { double = 1e-4, fp32 = 2e-4 } })
    end
  end }

return cases
