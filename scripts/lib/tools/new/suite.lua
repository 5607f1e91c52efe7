--- NAME.lua: regressions of one's own: what a robot does today, so that tomorrow's change of a
--- kernel, a constant or an idea is seen.
--- Run it with: limax test NAME.lua
--- The first time, and whenever a change is meant: limax test NAME.lua --update-golden

local limax = require "limax"
local suite = require("limax.test").suite "NAME"

-- What several tests begin with, made once for all of them.
suite:fixture("walker", { shared = true }, function()
  return limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }
end)

-- Once on every device that there is, with every precision named: t:with hands them over.
suite:test("falls as a stone does", { devices = "all", precisions = { "compensated", "double" },
  limit = 20 }, function(t)
  local fallen = t:fixture("walker"):simulate(t:with { scene = { gravity = true }, settle = 0,
    duration = 0.5, time_step = 1e-3 })
  t:near(-fallen:displacement()[3], 9.81 * 0.5 ^ 2 / 2, { atol = 1e-5 }) -- m
end)

suite:test("walks as it did", { devices = "all", limit = 20 }, function(t)
  local walked = t:fixture("walker"):simulate(t:with { scene = limax.scenes.land(),
    duration = 1, record = { center_of_mass = 20 } })
  t:golden("walk", { center_of_mass = walked:trace "center_of_mass" },
    { class = "short horizon", why = "before the chaos of contact" })
end)

-- Contact is chaotic: farther on, only the mean over many starts means something.
suite:test("leaves its place in the mean", { tags = "slow" }, function(t)
  t:statistically(function(seed)
    return t:fixture("walker"):simulate { scene = limax.scenes.land(), duration = 2,
      position = { 0, 0, 1e-4 * seed } }:distance()
  end, { seeds = 12, at_least = 0.02 }) -- m
end)

return suite
