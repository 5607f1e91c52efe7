--- NAME.lua: regression tests of a robot.
--- Run it with: limax test NAME.lua
--- The first time, and after an intended change: limax test NAME.lua --update-golden

local limax = require "limax"
local suite = require("limax.test").suite "NAME"

-- Shared by the tests, and made once.
suite:fixture("walker", { shared = true }, function()
  return limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }
end)

-- Runs on every device with each of these precisions, which t:with adds to the options.
suite:test("falls freely", { devices = "all", precisions = { "compensated", "double" },
  limit = 20 }, function(t)
  local fallen = t:fixture("walker"):simulate(t:with { scene = { gravity = true }, settle = 0,
    duration = 0.5, time_step = 1e-3 })
  t:near(-fallen:displacement()[3], 9.81 * 0.5 ^ 2 / 2, { atol = 1e-5 }) -- m
end)

suite:test("walks as before", { devices = "all", limit = 20 }, function(t)
  local walked = t:fixture("walker"):simulate(t:with { scene = limax.scenes.land(),
    duration = 1, record = { center_of_mass = 20 } })
  t:golden("walk", { center_of_mass = walked:trace "center_of_mass" },
    { class = "short horizon", why = "contact is chaotic later" })
end)

-- Contact is chaotic: over longer times only the mean over many starts is meaningful.
suite:test("moves away on average", { tags = "slow" }, function(t)
  t:statistically(function(seed)
    return t:fixture("walker"):simulate { scene = limax.scenes.land(), duration = 2,
      position = { 0, 0, 1e-4 * seed } }:distance()
  end, { seeds = 12, at_least = 0.02 }) -- m
end)

return suite
