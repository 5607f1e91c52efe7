--- block.lua: the rigid block in scripts: measures, traces and errors. SI units.

local engine = require "limax.engine"
local limax = require "limax"

local suite = require("limax.test").suite "block"

local VOXELS = "bbb\nbbb\n\nbbb\nbbb" -- 3 x 2 x 2 voxels of bone

suite:test("a body that runs into a block pushes it along", { devices = "all" }, function(t)
  local robot = limax.robot { voxels = VOXELS }:simulate { record = { block = 50 }, settle = 0,
    duration = 1, velocity = { 3, 0, 0 }, device = t.device, scene = { gravity = true,
      ground = true, friction = true, damping = true,
      block = { position = { 0.32, -0.05, 0 }, size = { 0.3, 0.3, 0.2 } } } }
  t:equal(robot.status, "done")
  local block, path = robot:block(), robot:trace "block"
  t:ok(block.displacement[1] > 0.05, "it should be pushed along x")
  t:near(block.distance, math.sqrt(block.displacement[1] ^ 2 + block.displacement[2] ^ 2))
  t:ok(block.tilt < 1e-3, "it should stand upright")
  t:equal(path:size(), 51)
  t:equal(path.unit, "m, m, m, 1, 1, 1, 1")
  local first, last = path[1], path[51]
  for axis = 1, 3 do
    t:same_bits(last[axis], block.position[axis])
    t:same_bits(last[axis] - first[axis], block.displacement[axis])
  end
  t:near(last[4] ^ 2 + last[5] ^ 2 + last[6] ^ 2 + last[7] ^ 2, 1, { rtol = 1e-12 })
  t:near(first[1], 0.32 + 0.15)
  local later = robot:block { from = "middle" }
  t:near(later.displacement[1], last[1] - path[26][1])
  t:near(limax.fitness.carry(robot), 2 * later.distance)
  t:near(limax.fitness.carry(robot, { axis = "x" }), 2 * later.displacement[1])
end)

suite:test("the state of a block can be read while it moves", { devices = "all" }, function(t)
  local materials = engine.materials "paper"
  local population = engine.population { lattice = { 1, 1, 1 }, count = 1 }
  population:set_body(1, { 4 })
  population:check(materials, { require_muscle = false })
  local simulation = engine.simulation(population, materials, engine.scene { block = {
    velocity = { 1, 2, 3 }, spin = { 0, 0, 4 }, position = { 5, 0, 0 }, size = { 1, 1, 1 } } },
    { time_step = 1e-3 }, t.device)
  t:equal(simulation:block(1).position, { 5.5, 0.5, 0.5 })
  t:equal(simulation:block(1).orientation, { 1, 0, 0, 0 })
  simulation:advance(1, 100)
  local now = simulation:block(1)
  t:near(now.position, { 5.6, 0.7, 0.8 }, { rtol = 1e-12 })
  t:near(now.orientation, { math.cos(0.2), 0, 0, math.sin(0.2) }, { rtol = 1e-12, atol = 1e-12 })
  t:near(now.angular_velocity, { 0, 0, 4 }, { rtol = 1e-12, atol = 1e-12 })
end)

suite:test("one block in a list is one block, and of several the first is read", function(t)
  local function run(block)
    return limax.robot { voxels = VOXELS }:simulate { record = { block = 50 }, settle = 0,
      duration = 0.2, velocity = { 3, 0, 0 }, device = "cpu",
      scene = limax.scenes.land { block = block } }
  end
  local near = { position = { 0.32, -0.05, 0 } }
  local far = { position = { 2, 0, 0 }, size = { 0.2, 0.2, 0.1 }, mass = 3 }
  local one, listed, both = run(near), run { near }, run { near, far }
  t:equal(listed:trace("block").shape, { 11, 7 })
  t:same_bits(listed:trace("block"):table(), one:trace("block"):table())
  t:equal(listed.context.scene.block, one.context.scene.block)
  t:equal(both:trace("block").shape, { 11, 2, 7 })
  t:same_bits(both:trace("block")[11][1][1], both:block().position[1])
  t:near(both:trace("block")[1][2]:table(), { 2.1, 0.1, 0.05, 1, 0, 0, 0 }, { atol = 1e-3 })
  -- the order counts, though that of other effects does not
  t:near(run({ far, near }):block().position[1], 2.1, { atol = 1e-3 })
  local simulation = both.context.simulation
  t:same_bits(simulation:block(1, 2).position[1], both:trace("block")[11][2][1])
  t:raises("there is no block 3: the scene has 2 blocks", function() simulation:block(1, 3) end)
  t:raises("scene.block[2].mass", function() run { near, { mass = -1 } } end)
end)

suite:test("errors name what a block does not support", function(t)
  local plain = limax.robot { voxels = VOXELS }:simulate { duration = 0.1, device = "cpu" }
  t:raises("scene.block: robot 1 has none in its scene", function() plain:block() end)
  t:raises("record.block needs the effect 'block'", function()
    limax.robot { voxels = VOXELS }:simulate { duration = 0.1, record = { block = 50 } }
  end)
end)
