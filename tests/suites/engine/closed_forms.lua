--- closed_forms.lua: formulas of physics through `limax.robot`, over devices, precisions and
--- integrators. The hard cases test more of them on engine objects. SI units.

local limax = require "limax"
local suite = require("limax.test").suite "closed forms"

local G = 9.81 -- m/s^2

-- A voxel of bone: eight masses of 0.1 kg.
suite:fixture("voxel", { shared = true }, function() return limax.robot { voxels = "b" } end)

-- RK4 is for scenes without contact on the CPU; XPBD is of first order.
local FREE = { devices = "all", precisions = "all",
  integrators = { "leapfrog", "symplectic_euler", "rk4" } }
local CONTACT = { devices = "all", precisions = { "compensated", "double" },
  integrators = { "leapfrog", "symplectic_euler" } }

suite:test("a thrown body falls g t^2 / 2", FREE, function(t)
  local duration, step = 0.5, 1e-3
  local moved = t:fixture("voxel"):simulate(t:with { scene = { gravity = true }, settle = 0,
    duration = duration, time_step = step, velocity = { 2, -1, 0 } }):displacement()
  local fallen = G * duration ^ 2 / 2
  -- symplectic Euler sums the velocities after each step
  if t.integrator == "symplectic_euler" then fallen = fallen + G * step * duration / 2 end
  -- plain fp32 rounds each of 500 steps at about 1 m
  t:near(moved, { 1, -0.5, -fallen }, { atol = ({ single = 2e-4, compensated = 1e-6, mixed = 1e-6,
    double = 1e-10 })[t.precision] })
end)

suite:test("a sliding body stops after v^2 / (2 mu g)", CONTACT, function(t)
  local v, mu = 1, 0.5
  local robot = t:fixture("voxel"):simulate(t:with { settle = 0, duration = 0.5, time_step = 1e-4,
    velocity = { v, 0, 0 }, scene = { gravity = true, ground = true, damping = true,
      friction = { static = mu, kinetic = mu } } })
  -- a braking body tilts, which moves its centre by half a millimetre
  t:near(robot:displacement()[1], v ^ 2 / (2 * mu * G), { rtol = 0.02 })
  t:near(robot:displacement()[2], 0, { atol = 1e-5 })
end)

suite:test("a slope holds below the angle of friction, and a body slides above it", CONTACT,
  function(t)
    local function slid(degrees)
      local scene = limax.scenes.slope { angle = math.rad(degrees), actuation = false,
        friction = { static = 0.5, kinetic = 0.5 } }
      return t:fixture("voxel"):simulate(t:with { settle = 0.2, duration = 0.5, time_step = 1e-4,
        scene = scene }):displacement()[1]
    end
    -- atan 0.5 is 26.6 degrees
    t:near(slid(24), 0, { atol = 1e-4 })
    -- from t = 0, after 0.2 s of sliding: a (0.7^2 - 0.2^2) / 2, a = g (sin - mu cos)
    local a = G * (math.sin(math.rad(35)) - 0.5 * math.cos(math.rad(35)))
    t:near(slid(35), a * (0.7 ^ 2 - 0.2 ^ 2) / 2, { rtol = 0.02 })
  end)

suite:test("a slowly driven muscle's length follows L0 (1 + a sin(2 pi f t))",
  { devices = "all" }, function(t)
    -- half of the amplitude 0.25, without a phase
    local robot = limax.robot { voxels = "e", weights = { amplitude = 0.5, phase = 0 } }
    local frequency = 0.5 -- Hz: fifty times slower than the voxel's own modes
    local moved = robot:simulate(t:with { settle = 0, duration = 2, time_step = 1e-4,
      precision = "double", scene = { damping = true, actuation = { frequency = frequency } },
      record = { position = 20, energy = 50 } })
    local position = moved:trace "position"
    -- after the ramp of a quarter period
    for sample = 12, position:size() do
      local time = (sample - 1) / position.rate
      local width = position[sample][2][1] - position[sample][1][1]
      local rest = 0.1 * (1 + 0.125 * math.sin(2 * math.pi * frequency * time))
      -- inertia and damping add less than half a per cent of the amplitude of 12.5 mm
      t:near(width, rest, { atol = 6e-5 })
    end
    t:ok(moved:energy().muscle_work > 0)
  end)

suite:test("the mass of a body is that of its sites", function(t)
  -- two voxels share four of twelve sites
  t:near(limax.robot { voxels = "bb" }.body.mass,
    12 * limax.engine.materials("paper"):get(5).mass_per_site)
  t:near(t:fixture("voxel").body.mass, 0.8)
end)

return suite
