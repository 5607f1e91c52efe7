--- physics.lua: the engine against tests/support/physics.lua, a program written from
--- engine/PHYSICS.md: every mass at every sample. SI units.

local limax = require "limax"
local control = require "support.physics.control"
local physics = require "support.physics"

local suite = require("limax.test").suite "the model on one page"

-- The paper's materials, all of which weigh the same, and others that do not.
local MATERIALS = require("limax.engine").materials("paper"):table()
for k = 2, 5 do
  local material = MATERIALS.materials[k]
  material.mass_per_site, material.damping_ratio = 0.03 * k, 0.04 * k -- kg, 1
end

local function scattered(x, y, z) return (0.13 * x + 0.31 * y + 0.47 * z) % 1 end

-- Rows of voxels with a wave of phases; one with holes and all materials; legs that clap together.
local SLUG = { voxels = "eeee\nsses\n\nssss\neeee",
  weights = { phase = function(x) return x / 4 end } }
local HOLES = { materials = MATERIALS, voxels = "ec.s\n.bce\n\n.s.b\nec..\n\n..c.\n.e..",
  weights = { stiffness = scattered, amplitude = scattered, phase = scattered } }
local HAIRPIN = { voxels = "bbbb\n\ne..e\n\nc..c\n\ns..s", weights = { phase = scattered } }
local SLAB = { voxels = "bbb\nbbb" }

local land, slope = limax.scenes.land, limax.scenes.slope

-- A controller as its text, and as a function for the reference.
local REFLEX = { signal = "s[0] = 0.8 * s[0] + 0.2 * contact; say[1] = s[0] - 0.1 * strain.z;"
  .. " a = tanh(strain.x - 0.5 * load) + s[0] * clock_sine - 0.02 * strain_rate;"
  .. " a += heard[6] - heard[9];",
  reference = function(sees, memory)
    memory.level = 0.8 * (memory.level or 0) + 0.2 * sees.contact
    return math.tanh(sees.strain[1] - 0.5 * sees.load) + memory.level * sees.clock_sine
      - 0.02 * sees.strain_rate + sees.heard(2, 1) - sees.heard(2, 4),
      { 0, memory.level - 0.1 * sees.strain[3] }
  end }
local NETWORK = { signal = "real y[2] = perceptron(3, g[4], strain, strain_rate, load, contact,"
  .. " activation, phase, t); say[0] = y[1]; a = y[0] + heard[1] + heard[5];",
  reference = function(sees, _, g)
    local strain = sees.strain
    local y = control.perceptron(g, 4, 3, 2, { strain[1], strain[2], strain[3], sees.strain_rate,
      sees.load, sees.contact, sees.activation, sees.phase, sees.t })
    return y[1] + sees.heard(1, 2) + sees.heard(1, 6), { y[2] }
  end }
local GENES = {}
for k = 1, 45 do GENES[k] = math.floor(1000 * math.sin(7 * k)) / 4096 end

-- HOLES with these genes, and a scene with this controller.
local THINKER = { materials = MATERIALS, voxels = HOLES.voxels, weights = HOLES.weights,
  control = GENES }
local function controlled(controller, fields)
  local scene = land { control = { signal = controller.signal } }
  scene.actuation = nil
  for name, value in pairs(fields) do scene.control[name] = value end
  return scene
end

-- The displacement of the centre of mass shows that a case does what its name states.
local CASES = {
  { "a body with holes is thrown and bounces", HOLES, moves = { 0.1, 0.3 },
    scene = { gravity = true, ground = { damping_ratio = 0.3 }, damping = true, actuation = true },
    position = { 3, -2, 0.1 }, velocity = { 0.4, 0.1, -1 }, settle = 0 },
  { "a body walks", SLUG, moves = { 0.02, 1 }, duration = 1,
    scene = land { actuation = { frequency = 4 } } },
  { "a body walks as in the paper", HOLES, integrator = "symplectic_euler", sharing = "sum",
    scene = land { friction = { static = 0.6, kinetic = 1 }, actuation = { ramp = 0 } } },
  { "a body sticks on a slope", SLAB, scene = slope { angle = 0.45 }, settle = 0.3,
    moves = { 0, 1e-3 } },
  { "a body slips on a slope", SLAB, scene = slope { angle = 0.9, direction = 1 },
    moves = { 0.3, 1 } },
  { "a body slips down a plane that is tilted about both axes", SLAB, moves = { 0.3, 2 },
    scene = { gravity = true, planes = { normal = { 2, 1, 3 } }, damping = true,
      friction = { static = 0.3, kinetic = 0.3 } } },
  { "obstacles of every kind", HOLES, velocity = { 1.5, 0.2, 0 }, moves = { 0.02, 1 },
    scene = { gravity = true, damping = true, friction = true, actuation = { frequency = 3 },
      terrain = { spacing = 0.3, origin = { -0.5, -0.4, 0 },
        heights = { { 0, 0, -0.1 }, { 0.05, -0.1, 0 }, { 0, 0.02, 0 }, { 0, 0, 0 } } },
      planes = { { normal = { -1, 0, 0.2 }, offset = -0.6 }, { normal = { 0, 3, 0 }, offset = 0 } },
      spheres = { { center = { 0.5, 0.1, 0 }, radius = 0.15 }, { center = { -0.1, 0.1, 0 } } },
      boxes = { from = { 0.3, -1, 0 }, to = { 0.45, 1, 0.1 } } } },
  { "parts of a body touch", HAIRPIN, scene = land { self_collision = { reach = 1.5 } } },
  { "wind", SLUG, moves = { 0.01, 1 },
    scene = land { wind = { velocity = { -3, 2, 0.5 }, drag = 0.1 }, friction = { kinetic = 0.1,
      static = 0.1 } } },
  { "a swimmer with holes in a current", HOLES, moves = { 0.05, 1 },
    scene = limax.scenes.water { drag = { density = 800, current = { 0.3, 0, 0.1 } } } },
  { "a body is thrown into water at 100 m/s", HOLES, velocity = { 60, -50, 60 },
    scene = limax.scenes.water() },
  { "a reflex walks", SLUG, scene = controlled(REFLEX, { rate = 50, frequency = 3 }),
    signal = REFLEX.reference, moves = { 1e-3, 1 } },
  { "a network holds its activations, which change slowly", THINKER, moves = { 1e-3, 1 },
    scene = controlled(NETWORK, { rate = 100, hold = 1, change = 0.3 }), sharing = "sum",
    signal = NETWORK.reference, integrator = "symplectic_euler" },
  { "RK4 with a network", THINKER, integrator = "rk4", signal = NETWORK.reference,
    scene = { gravity = true, damping = true,
      control = { rate = 50, signal = NETWORK.signal } } },
  { "RK4 of a body that hangs in the wind", SLUG, integrator = "rk4", time_step = 5e-4,
    scene = limax.scenes.air { anchors = { from = { 0.15, -1, -1 }, to = { 0.25, 1, 1 } },
      wind = { velocity = { 5, 0, 0 }, drag = 0.2 } } },
  { "a body pushes a block over an edge", SLAB, velocity = { 3, 0, 0 }, moves = { 0.1, 1 },
    scene = { gravity = true, ground = true, friction = true, damping = true,
      boxes = { from = { 0.8, -1, 0 }, to = { 1, 1, 0.1 } },
      block = { position = { 0.32, -0.05, 0 }, size = { 0.3, 0.25, 0.2 }, spin = { 1, 2, 3 } } } },
}

-- The centre of mass of a sample.
local function center(sample, masses)
  local sum, total = { 0, 0, 0 }, 0
  for i, mass in ipairs(masses) do
    for axis = 1, 3 do sum[axis] = sum[axis] + mass.m * sample.x[i][axis] end
    total = total + mass.m
  end
  return { sum[1] / total, sum[2] / total, sum[3] / total }
end

for _, case in ipairs(CASES) do
  suite:test(case[1], function(t)
    local robot, record = limax.robot(case[2]), { position = 20, velocity = 20 }
    if case.scene.block then record.block = 20 end
    local done = robot:simulate { device = "cpu", precision = "double", record = record,
      scene = case.scene, time_step = case.time_step or 2e-4, duration = case.duration or 0.4,
      settle = case.settle or 0.1, integrator = case.integrator, sharing = case.sharing,
      position = case.position, velocity = case.velocity }
    t:equal(done.status, "done")
    local context = done.context
    local samples, masses = physics.run(robot:table(), context.scene, context.options,
      case.signal)
    local places, velocities = done:trace("position"):table(), done:trace("velocity"):table()
    t:equal(#samples, #places)
    for k, sample in ipairs(samples) do
      t:near(sample.x, places[k], { atol = 1e-10 })
      -- a controller's drive is rounded to fp32, where the last bit may differ
      t:near(sample.v, velocities[k], { atol = case.signal and 1e-7 or 1e-8 })
      if record.block then
        t:near(sample.block, done:trace("block")[k]:table(), { atol = 1e-10 })
      end
    end
    -- the measures
    for from, k in pairs { start = 1, middle = (#samples + 1) / 2 } do
      local first, last = center(samples[k], masses), center(samples[#samples], masses)
      local moved = { last[1] - first[1], last[2] - first[2], last[3] - first[3] }
      t:near(done:displacement { from = from }, moved, { atol = 1e-10 })
    end
    if case.moves then
      t:ok(done:distance() >= case.moves[1] and done:distance() <= case.moves[2], done:distance())
    end
  end)
end
