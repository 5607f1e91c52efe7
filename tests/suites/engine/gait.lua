--- gait.lua: the length of a driven muscle, and a walker whose gait was measured: a slab whose
--- lower muscles swell in a wave from back to front, which moves it the other way, as the foot of a
--- snail does. SI units.

local limax = require "limax"
local suite = require("limax.test").suite "gait"

-- Measured at 1 Hz: 0.43 to 0.47 m in 5 s under leapfrog, symplectic Euler and XPBD, the same to a
-- millimetre for starts a tenth of a millimetre apart: at slow waves contact is not chaotic. At 2
-- Hz it is 0.76 to 1.0 m.
suite:fixture("walker", { shared = true }, function()
  return limax.robot { voxels = "eeeee\neeeee\n\nsssss\nsssss",
    weights = { phase = function(x) return (x - 1) / 4 end } }
end)

local DRIVE = { frequency = 1 } -- Hz

local function five_seconds(t, options)
  options.scene = options.scene or limax.scenes.land { actuation = DRIVE }
  options.settle, options.duration, options.time_step = 0.5, 5, "auto"
  return t:fixture("walker"):simulate(t:with(options))
end

local METHODS = { "leapfrog", "symplectic_euler", "xpbd" }

suite:test("the first half second is the recorded one", { devices = "all",
  integrators = { "leapfrog", "symplectic_euler" }, precisions = { "compensated", "double" } },
  function(t)
    local walked = t:fixture("walker"):simulate(t:with {
      scene = limax.scenes.land { actuation = DRIVE }, settle = 0.2, duration = 0.5,
      time_step = 5e-5, record = { center_of_mass = 20 } })
    t:golden("half_second", { center_of_mass = walked:trace "center_of_mass" },
      { class = "short horizon", why = "before the chaos of contact pulls the methods apart" })
  end)

suite:test("it walks against its wave under every integrator", { devices = "all",
  integrators = METHODS }, function(t)
  local walked = five_seconds(t, { record = { center_of_mass = 50, contact = 50 } })
  t:equal(walked.status, "done")
  local way = walked:displacement()
  t:note(("%.3f m along x, %.3f m along y"):format(way[1], way[2]))
  -- twice the measured range: another integrator, another device
  t:near(way[1], -0.455, { rtol = 0.1 })
  t:ok(math.abs(way[2]) < 0.1 * math.abs(way[1]), way[2])
  -- it lifts some feet and stands on others
  local touching, least, most = walked:trace "contact", 1, 0
  for sample = 1, touching:size() do
    least = math.min(least, touching[sample][1])
    most = math.max(most, touching[sample][1])
  end
  t:ok(most > least + 0.05, most - least)
  -- it moves in both halves of the time
  local path = walked:trace "center_of_mass"
  local middle = path[math.ceil(path:size() / 2)][1] - path[1][1]
  t:ok(middle / way[1] > 0.25 and middle / way[1] < 0.75, middle / way[1])
end)

suite:test("the gait needs the wave, the muscles and friction", { devices = "all" },
  function(t)
    local function way(options) return math.abs(five_seconds(t, options):displacement()[1]) end
    local walks = way {}
    t:ok(way { scene = limax.scenes.land { actuation = false } } < 0.02 * walks, "no muscles")
    local ice = limax.scenes.land { actuation = DRIVE, friction = false }
    t:ok(way { scene = ice } < 0.2 * walks, "on ice")
    -- with all muscles in phase it only bounces
    local in_step = limax.robot { voxels = "eeeee\neeeee\n\nsssss\nsssss",
      weights = { phase = 0 } }
    local bounced = in_step:simulate(t:with { scene = limax.scenes.land { actuation = DRIVE },
      settle = 0.5, duration = 5, time_step = "auto" })
    t:ok(math.abs(bounced:displacement()[1]) < 0.3 * walks, bounced:displacement()[1])
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

return suite
