--- closed_forms.lua: physics that has a formula, through what a script sees, over devices,
--- precisions and integrators: falling, resting, sliding, springs, books of momentum. SI units.

local limax = require "limax"
local suite = require("limax.test").suite "closed forms"

local G = 9.81 -- m/s^2, the engine's own
local PAPER = limax.engine.materials "paper"

-- A voxel of bone: eight masses of 0.1 kg.
suite:fixture("voxel", { shared = true }, function() return limax.robot { voxels = "b" } end)

-- RK4 is for scenes without contact, and a GPU has it not; XPBD is of first order.
local FREE = { devices = "all", precisions = "all",
  integrators = { "leapfrog", "symplectic_euler", "rk4" } }
local CONTACT = { devices = "all", precisions = { "compensated", "double" },
  integrators = { "leapfrog", "symplectic_euler" } }

suite:test("a body falls g t^2 / 2", FREE, function(t)
  local duration, step = 0.5, 1e-3
  local fallen = -t:fixture("voxel"):simulate(t:with { scene = { gravity = true }, settle = 0,
    duration = duration, time_step = step }):displacement()[3]
  local expected = G * duration ^ 2 / 2
  -- symplectic Euler sums the velocities after each step
  if t.integrator == "symplectic_euler" then expected = expected + G * step * duration / 2 end
  -- plain fp32 rounds each of 500 steps at about a metre; with fp32 forces a spring's sum is not
  -- quite 0
  local allowed = ({ single = 1e-4, compensated = 1e-6, mixed = 1e-7, double = 1e-10 })[t.precision]
  t:near(fallen, expected, { atol = allowed })
end)

suite:test("a thrown body keeps its momentum and its way", FREE, function(t)
  local way = t:fixture("voxel"):simulate(t:with { scene = { damping = true }, settle = 0,
    duration = 0.5, time_step = 1e-3, velocity = { 2, -1, 0.5 } }):displacement()
  t:near(way, { 1, -0.5, 0.25 }, { atol = t.precision == "single" and 1e-4 or 1e-6 })
end)

suite:test("a body at rest presses m g / k into the ground", CONTACT, function(t)
  local robot = t:fixture("voxel"):simulate(t:with { settle = 0, duration = 2, time_step = 1e-4,
    scene = { gravity = true, ground = { stiffness = 2e4 }, damping = true },
    record = { position = 20 } })
  local position = robot:trace "position"
  local last, lowest = position[position:size()], 0
  for mass = 1, position:size(2) do lowest = math.min(lowest, last[mass][3]) end
  -- four of eight masses of 0.1 kg stand on it; what is left of the drop after 2 s is below 1 um
  t:near(lowest, -8 * 0.1 * G / 4 / 2e4, { atol = 1e-6 })
end)

suite:test("a sliding body stops after v^2 / (2 mu g)", CONTACT, function(t)
  local v, mu = 1, 0.5
  local robot = t:fixture("voxel"):simulate(t:with { settle = 0, duration = 1, time_step = 1e-4,
    velocity = { v, 0, 0 }, scene = { gravity = true, ground = true, damping = true,
      friction = { static = mu, kinetic = mu } } })
  -- the tilt of a braking body moves its centre by half a millimetre
  t:near(robot:displacement()[1], v ^ 2 / (2 * mu * G), { rtol = 0.02 })
  t:near(robot:displacement()[2], 0, { atol = 1e-5 })
end)

suite:test("a slope holds below the angle of friction and lets slide above it", CONTACT,
  function(t)
    local function slid(angle)
      local scene = limax.scenes.slope { angle = math.rad(angle), actuation = false,
        friction = { static = 0.5, kinetic = 0.5 } }
      local path = t:fixture("voxel"):simulate(t:with { settle = 0.2, duration = 0.5,
        time_step = 1e-4, scene = scene }):displacement()
      return path[1]
    end
    -- atan 0.5 is 26.6 degrees
    t:near(slid(24), 0, { atol = 1e-4 })
    -- from t = 0, after 0.2 s of sliding: a (0.7^2 - 0.2^2) / 2, a = g (sin - mu cos)
    local angle = math.rad(35)
    local a = G * (math.sin(angle) - 0.5 * math.cos(angle))
    t:near(slid(35), a * (0.7 ^ 2 - 0.2 ^ 2) / 2, { rtol = 0.02 })
  end)

suite:test("muscles alone move no centre of mass", { devices = "all",
  precisions = { "compensated", "double" }, integrators = { "leapfrog", "symplectic_euler" } },
  function(t)
    local robot = limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }
    local moved = robot:simulate(t:with { scene = { damping = true, actuation = true }, settle = 0,
      duration = 1, time_step = 1e-4, record = { energy = 50 } })
    t:near(moved:displacement(), { 0, 0, 0 }, { atol = t.precision == "double" and 1e-9 or 1e-6 })
    t:ok(moved:energy().muscle_work > 0, "the muscles have worked")
  end)

suite:test("a muscle's length follows L0 (1 + a sin(2 pi f t)), slowly driven",
  { devices = "all" }, function(t)
    -- phase weight 0: no phase; half the amplitude's weight: 0.125
    local robot = limax.robot { voxels = "e", weights = { amplitude = 0.5, phase = 0 } }
    local frequency = 0.5 -- Hz: fifty times slower than the voxel's own modes
    local moved = robot:simulate(t:with { settle = 0, duration = 2, time_step = 1e-4,
      precision = "double", scene = { damping = true, actuation = { frequency = frequency } },
      record = { position = 20 } })
    local position = moved:trace "position"
    -- after the ramp of a quarter period
    for sample = 12, position:size() do
      local time = (sample - 1) / position.rate
      local width = position[sample][2][1] - position[sample][1][1]
      local rest = 0.1 * (1 + 0.125 * math.sin(2 * math.pi * frequency * time))
      -- inertia and damping add less than half a percent of the amplitude of 12.5 mm
      t:near(width, rest, { atol = 6e-5 })
    end
  end)

suite:test("every step of the automatic bound is stable", { devices = "all",
  integrators = { "leapfrog", "symplectic_euler" } }, function(t)
  local robot = limax.robot { voxels = "bb\nbb\n\nbb\nbb" }
  local fallen = robot:simulate(t:with { time_step = "auto", settle = 0, duration = 2,
    position = { 0, 0, 0.2 }, scene = { gravity = true, ground = true, damping = true },
    record = { energy = 20 } })
  t:equal(fallen.status, "done")
  -- 2.7 kg from 0.2 m fall with 5.3 J; bone bounces for a while, but never gains
  t:ok(fallen:energy().kinetic < 0.53, fallen:energy().kinetic)
end)

suite:test("the mass of a body is that of its sites", function(t)
  -- two voxels share four of twelve sites
  t:near(limax.robot { voxels = "bb" }.body.mass, 12 * PAPER:get(5).mass_per_site)
  t:near(t:fixture("voxel").body.mass, 0.8)
end)

return suite
