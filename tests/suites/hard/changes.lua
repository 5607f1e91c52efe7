--- changes.lua: hard cases of worlds and bodies that change: patches of friction, contacts that
--- move, kicks, damage and growth. SI units.

local context = require "limax.tools.bench.hard_cases.context"
local limax = require "limax"
local case = require("limax.tools.bench.hard_cases").suite "changes"

local MU = 0.5

-- A flat, well damped sheet.
local function sheet(scene, fields)
  local spec = { lattice = { 4, 4, 1 }, materials = { b = { damping_ratio = 1 } },
    scene = { gravity = true, damping = true, friction = { static = MU, kinetic = MU } } }
  for name, value in pairs(scene) do spec.scene[name] = value end
  for name, value in pairs(fields) do spec[name] = value end
  return spec
end

case { name = "a patch everywhere is another friction", run = function(c)
  local function path(scene)
    scene.ground = true
    return c:run(sheet(scene, { velocity = { 1, 0.2, 0 } })):state()
  end
  local half = { static = MU / 2, kinetic = MU / 2 }
  c:same_bits("the state", path { patches = { from = { -9, -9, -9 }, factor = 0.5 } },
    path { friction = half })
  c:same_bits("the state with two that overlap",
    path { patches = { { from = { -9, -9, -9 }, factor = 0.25 }, { from = { -8, -8, -8 },
      factor = 2 } } }, path { friction = half })
end }

case { name = "a sheet slides on over ice", run = function(c)
  local run = c:run(sheet({ ground = true, patches = { from = { 0.6, -9, -9 }, factor = 0 } },
    { velocity = { 3, 0, 0 }, duration = 1, record = { center_of_mass = 100 } }))
  local path = run:trace "center_of_mass"
  local function speed(k) return (path[k + 1][1] - path[k - 1][1]) * 50 end
  c:at_most("speed on the ice (m/s)", speed(60), 2.9)
  c:near("speed on the ice (m/s)", speed(100), speed(60), { rtol = 1e-3 })
end }

-- A slab below the sheet.
local function slab(velocity, turns)
  return { moving_boxes = { from = { -3, -3, -0.5 }, to = { 3, 3, 0 }, velocity = velocity,
    turns = turns } }
end

case { name = "a slab that moves carries a sheet, and one that shuttles brings it back",
  run = function(c)
    local record = { center_of_mass = 100 }
    local run = c:run(sheet(slab { 0.5, 0, 0 }, { duration = 1, record = record }))
    -- it slips until it is as fast as the slab
    c:near("way (m)", run:moved(1), 0.5 - 0.5 ^ 2 / (2 * MU * context.GRAVITY), { atol = 2e-3 })
    run = c:run(sheet(slab({ 0, 0, 0.2 }, 0.5), { duration = 1, record = record }))
    local path = run:trace "center_of_mass"
    c:near("rise (m)", path[51][3] - path[1][3], 0.1, { atol = 2e-3 })
    c:near("rise after the way back (m)", run:moved(3), 0, { atol = 2e-3 })
  end }

-- The largest error of the energy balance of a run, of the largest change of energy.
local function balance_error(run)
  local trace, worst, most = run:trace "ledger", 0, 0
  local function sum(row, first, last)
    local total = 0
    for k = first, last do total = total + row[k] end
    return total
  end
  for _, row in ipairs(trace) do
    local change = sum(row, 1, 4) - sum(trace[1], 1, 4)
    worst = math.max(worst, math.abs(change - sum(row, 5, 9)))
    most = math.max(most, math.abs(change))
  end
  return worst / most
end

case { name = "the energy balance closes on a slab that moves", cpu = true, run = function(c)
  local run = c:run(sheet(slab { 0.5, 0, 0.2 }, { duration = 1, record = { ledger = 100 } }))
  c:at_most("balance error over the change of energy", balance_error(run), 0.02)
end }

local MAY = { "nonfinite", "speed", "stretch" }

case { name = "a box and a ball move through a body", run = function(c)
  for _, speed in ipairs { 1, 20, 100 } do
    c:run { lattice = { 3, 3, 3 }, duration = 0.5, may_diverge = MAY, energy = false,
      scene = { gravity = true, ground = true, friction = true, damping = true,
        moving_boxes = { from = { -0.3, 0.05, 0.05 }, to = { -0.1, 0.15, 0.15 },
          velocity = { speed, 0, 0 } },
        moving_spheres = { center = { 0.15, 0.15, 0.6 }, radius = 0.1,
          velocity = { 0, 0, -speed }, turns = 0.1 } } }
  end
end }

case { name = "a body between jaws that close", run = function(c)
  c:run { lattice = { 3, 3, 3 }, duration = 0.4, may_diverge = MAY, energy = false,
    scene = { gravity = true, ground = true, friction = true, damping = true,
      moving_boxes = {
        { from = { -0.5, -1, 0 }, to = { -0.1, 1, 1 }, velocity = { 0.5, 0, 0 } },
        { from = { 0.4, -1, 0 }, to = { 0.9, 1, 1 }, velocity = { -0.5, 0, 0 } } } } }
end }

case { name = "a kick changes the momentum by as much, up to 1e4 N s", smooth = true,
  run = function(c)
    for _, impulse in ipairs { 1, 1e4 } do
      local mass = c:prepare({ lattice = { 2, 2, 2 } }):outcome().mass
      local speed = impulse / mass
      local run = c:run { lattice = { 2, 2, 2 }, duration = 0.2, energy = false, center = false,
        max_speed = 1e6, scene = { damping = true,
          kick = limax.scenes.kick { time = 0.1, velocity = { 0, speed, 0 }, lasts = 0.01 } } }
      local _, velocities = run:state()
      for _, v in ipairs(velocities) do
        c:near("speed (m/s)", v[2], speed, { rtol = 0.05 })
      end
    end
  end }

case { name = "terrain of noise at the edge of a voxel", run = function(c)
  local scene = limax.scenes.rough { spacing = 0.1, size = 4, roughness = 0.5, actuation = false }
  c:run { lattice = { 3, 3, 3 }, duration = 1, may_diverge = MAY, scene = scene,
    position = { 0, 0, 0.1 } }
end }

-- A bar of muscles under a controller that stretches it by `activation`.
local function bar(scene, fields)
  local spec = { lattice = { 3, 1, 1 }, voxels = "e", duration = 2, settle = 0.2,
    materials = { e = { damping_ratio = 1 } },
    scene = { damping = true, control = { signal = "a = 1;", rate = 50 } } }
  for name, value in pairs(scene) do spec.scene[name] = value end
  for name, value in pairs(fields or {}) do spec[name] = value end
  return spec
end
local function length_of(run)
  local low, high = run:extent(1)
  return high - low
end

case { name = "damage of everything leaves a body at rest", run = function(c)
  local whole = length_of(c:run(bar {}))
  c:at_least("the whole bar (m)", whole, 0.31)
  c:near("the dead bar (m)",
    length_of(c:run(bar { damage = { time = 0, from = { -1, -1, -1 } } })), 0.3, { atol = 1e-5 })
  c:near("a third dies later (m)",
    length_of(c:run(bar { damage = { { time = 1, from = { 0.5, -1, -1 } } } })),
    0.3 + (whole - 0.3) * 2 / 3, { atol = 5e-3 })
  c:near("not yet dead (m)",
    length_of(c:run(bar { damage = { { time = 5, from = { -1, -1, -1 } } } })), whole,
    { atol = 1e-9 })
end }

case { name = "growth changes the rest length by its strain", run = function(c)
  local function grown(growth)
    return length_of(c:run(bar({ growth = growth,
      control = { signal = "a = 0;", rate = 50 } })))
  end
  local material = c:materials():index "e" - 1
  for _, strain in ipairs { 0.3, -0.3 } do
    c:near("length (m)",
      grown { material = material, strain = strain, duration = 1 }, 0.3 * (1 + strain),
      { atol = 1e-4 })
  end
  c:near("half way (m)", grown { material = material, strain = 0.3, duration = 4 },
    0.3 * 1.15, { atol = 5e-3 })
  c:near("of another material (m)", grown { material = material + 1, strain = 0.3 }, 0.3,
    { atol = 1e-5 })
  c:near("two at once (m)", grown { { material = material, strain = 0.2, duration = 1 },
    { material = material, strain = 0.1, duration = 0.5 } }, 0.3 * 1.3, { atol = 1e-4 })
end }

-- A small body far away and a block with a scene around it; where the block's centre is at the end,
-- and its speed.
local function block_in(c, block, scene, fields)
  local spec = { lattice = { 1, 1, 1 }, position = { -5, 0, 0 }, duration = 2, energy = false,
    may_diverge = MAY, scene = { gravity = true, ground = true, damping = true, friction = true,
      edges = true, block = block } }
  for name, value in pairs(scene) do spec.scene[name] = value end
  for name, value in pairs(fields or {}) do spec[name] = value end
  spec.record = { block = 50 }
  local path = c:run(spec):trace "block"
  local last, before = path[#path], path[#path - 5]
  local speed = 0
  for axis = 1, 3 do speed = math.max(speed, math.abs(last[axis] - before[axis]) * 10) end
  return last, speed
end

-- A block with its centre there in the world.
local function at(x, y, z, size, fields)
  local block = { size = size, mass = 2, damping_ratio = 1,
    position = { x + 5 - size[1] / 2, y - size[2] / 2, z - size[3] / 2 } }
  for name, value in pairs(fields or {}) do block[name] = value end
  return block
end

case { name = "a beam lies on two posts, and without its edges falls through", run = function(c)
  local posts = { boxes = {
    { from = { -0.5, -0.5, 0 }, to = { -0.4, 0.5, 0.3 }, damping_ratio = 1 },
    { from = { 0.4, -0.02, 0 }, to = { 0.5, 0.02, 0.3 }, damping_ratio = 1 } } }
  local beam = at(0, 0, 0.36, { 1.6, 0.1, 0.1 })
  local place, speed = block_in(c, beam, posts)
  c:near("height (m)", place[3], 0.35, { atol = 2e-3 })
  c:at_most("speed (m/s)", speed, 1e-3)
  posts.edges = false
  c:at_most("height without edges (m)", block_in(c, beam, posts)[3], 0.1)
end }

case { name = "a block lies on a ball and on a ridge", run = function(c)
  local place = block_in(c, at(0, 0, 0.46, { 0.4, 0.4, 0.1 }),
    { spheres = { center = { 0, 0, 0.2 }, radius = 0.2, damping_ratio = 1 } }, { duration = 0.5 })
  c:near("height on the ball (m)", place[3], 0.45, { atol = 5e-3 })
  local heights = {}
  for i = 1, 21 do
    heights[i] = {}
    for j = 1, 21 do heights[i][j] = j == 11 and 0.2 or 0 end
  end
  local ridge = { ground = false, terrain = { spacing = 0.1, origin = { -1, -1, 0 },
    heights = heights, damping_ratio = 1 } }
  place = block_in(c, at(0, 0, 0.26, { 0.3, 0.5, 0.1 }), ridge, { duration = 0.5,
    position = { -5, 0, 0.3 } })
  c:at_least("height on the ridge (m)", place[3], 0.2)
  ridge.terrain.spacing = 0.01
  c:raises("scene.edges: the block meets more than 128 places", function()
    block_in(c, at(0, 0, 0.26, { 0.3, 0.5, 0.1 }), ridge)
  end)
end }

case { name = "a block is wedged between two boxes", brief = true, run = function(c)
  for _, gap in ipairs { 0.3, 0.2 } do
    local place = block_in(c, at(0, 0, 0.15, { 0.3, 0.3, 0.3 }, { spin = { 0, 0, 1 } }), { boxes = {
      { from = { -1, -0.1, 0 }, to = { -gap / 2, 0.1, 0.5 }, damping_ratio = 1 },
      { from = { gap / 2, -0.5, 0 }, to = { 1, 0.5, 0.2 }, damping_ratio = 1 } } },
      { duration = 0.5 })
    for axis = 1, 3 do c:at_most("way (m)", math.abs(place[axis]), 10) end
  end
end }

-- The same for several blocks: the run, and the largest speed of a block at the end.
local function blocks_in(c, blocks, fields)
  local spec = { lattice = { 1, 1, 1 }, position = { -5, 0, 0 }, duration = 3, energy = false,
    scene = { gravity = true, ground = true, damping = true, friction = true, block = blocks } }
  fields = fields or {}
  for name, value in pairs(fields.scene or {}) do spec.scene[name] = value end
  fields.scene = spec.scene
  for name, value in pairs(fields) do spec[name] = value end
  local run, speed = c:run(spec), 0
  for b = 1, #blocks do
    for _, v in ipairs(run.simulation:block(1, b).velocity) do
      speed = math.max(speed, math.abs(v))
    end
  end
  return run, speed
end

case { name = "four blocks stand on each other", run = function(c)
  local size, k, mass = { 0.3, 0.3, 0.3 }, 1e4, 2
  -- m, to one side and to the other: flush, and with corners beside each other
  for _, aside in ipairs { 0, 0.02 } do
    local blocks = {}
    for b = 1, 4 do
      local to = (b % 2 - 0.5) * aside
      blocks[b] = at(to, to, 0.3 * b - 0.15, size, { mass = mass })
    end
    local run, speed = blocks_in(c, blocks, { time_step = 1e-4 })
    c:at_most("speed (m/s)", speed, 1e-3)
    for b = 1, 4 do
      local block, to = run.simulation:block(1, b), (b % 2 - 0.5) * aside
      c:near("x (m)", block.position[1], to, { atol = 2e-3 })
      c:near("y (m)", block.position[2], to, { atol = 2e-3 })
      -- four places carry it, eight where each has the corners of the other
      c:near("height (m)", block.position[3], 0.3 * b - 0.15,
        { atol = 4 * mass * context.GRAVITY * b / (4 * k) })
      c:at_least("upright", block.orientation[1], 1 - 1e-5)
    end
  end
end }

case { name = "blocks that collide and tumble keep the energy balance", cpu = true,
  run = function(c)
    local function block(x, y, fields) return at(x, y, 1, { 0.3, 0.2, 0.4 }, fields) end
    local run = blocks_in(c, { block(-0.3, 0, { velocity = { 1, 0, 0 }, spin = { 0, 1, 2 } }),
      block(0.2, 0.1, { mass = 1, spin = { 1, 0, 0 }, damping_ratio = 0.1 }),
      block(0.6, -0.1, { stiffness = 2e4, velocity = { -1, 0, 0.1 } }) },
      { duration = 1, time_step = 2e-5, record = { ledger = 1000 },
        scene = { gravity = false, ground = false, friction = false } })
    c:at_most("balance error over the change of energy", balance_error(run), 0.03)
  end }

case { name = "a body moves over a block that is wedged between two", brief = true,
  run = function(c)
    -- on the ground, the first pressed by 1 mm on each side
    local function block(x, size, mass)
      return at(x - 5, 0.1, -0.5 * size[3], size, { mass = mass })
    end
    local run = blocks_in(c, { block(0.4, { 0.202, 0.3, 0.1 }, 1), block(0, { 0.6, 0.5, 0.3 }, 20),
      block(0.8, { 0.6, 0.5, 0.3 }, 20) }, { lattice = { 3, 2, 1 }, voxels = "e",
      velocity = { 2.5, 0, 0 }, duration = 1, scene = { ground = { height = -0.3 },
        actuation = { frequency = 3 } } })
    local low, high = run:extent(1)
    c:at_least("way (m)", low + 5, 0.2)
    c:at_most("way (m)", high + 5, 1.1)
    c:near("height of the block (m)", run.simulation:block(1, 1).position[3], -0.05,
      { atol = 5e-3 })
  end }
