--- gait.lua: the length of a driven muscle, and a walker whose gait was measured: a slab whose
--- lower muscles swell in a wave from back to front, which moves it the other way, as the foot of a
--- snail does. SI units.

local limax = require "limax"
local suite = require("limax.test").suite "gait"

-- Measured at 1 Hz: 0.43 to 0.47 m in 5 s under leapfrog and symplectic Euler, the same to a
-- millimetre for starts a tenth of a millimetre apart: at slow waves contact is not chaotic. At 2
-- Hz it is 0.76 to 1.0 m.
suite:fixture("walker", { shared = true }, function()
  return limax.robot { voxels = "eeeee\neeeee\n\nsssss\nsssss",
    weights = { phase = function(x) return (x - 1) / 4 end } }
end)

local SCENE = limax.scenes.land { actuation = { frequency = 1 } } -- Hz
local METHODS = { "leapfrog", "symplectic_euler" }

suite:test("the first half second is the recorded one", { devices = "all",
  integrators = METHODS, precisions = { "compensated", "double" } }, function(t)
  local walked = t:fixture("walker"):simulate(t:with { scene = SCENE, settle = 0.2,
    duration = 0.5, time_step = 5e-5, record = { center_of_mass = 20 } })
  t:golden("half_second", { center_of_mass = walked:trace "center_of_mass" },
    { class = "short horizon", why = "before the chaos of contact pulls the methods apart" })
end)

suite:test("it walks against its wave under every integrator", { devices = "all",
  integrators = METHODS }, function(t)
  local walked = t:fixture("walker"):simulate(t:with { scene = SCENE, settle = 0.5, duration = 5,
    time_step = "auto", record = { center_of_mass = 50, contact = 50 } })
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
