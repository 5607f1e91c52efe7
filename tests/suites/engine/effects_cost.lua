--- effects_cost.lua: a scene pays only for the effects it names, counted in instructions, which no
--- other process disturbs.

local suite = require("limax.test").suite "effects cost"
local instructions = require "limax.tools.bench.instructions"

suite:test("an effect costs its own instructions and nothing where it is absent",
  { limit = 1800, tags = { "cost" } }, function(t)
    if not instructions.available() then t:skip "valgrind is not installed" end
    local cost = {}
    for _, effects in ipairs { "", "gravity", "ground", "damping", "actuation", "gravity,ground",
      "ground,friction", "gravity,ground,friction,damping,actuation" } do
      local scene = {}
      for name in effects:gmatch "[^,]+" do scene[name] = true end
      cost[effects] = instructions.per_step(scene)
    end
    local springs, all = cost[""], cost["gravity,ground,friction,damping,actuation"]
    local own = {
      gravity = cost.gravity - springs, ground = cost.ground - springs,
      damping = cost.damping - springs, actuation = cost.actuation - springs,
      friction = cost["ground,friction"] - cost.ground,
    }
    for _, effect in ipairs { "gravity", "ground", "friction", "damping", "actuation" } do
      t:note(("%-9s %6.0f instructions a step, %4.1f %% of the springs' %.0f"):format(effect,
        own[effect], 100 * own[effect] / springs, springs))
      -- present: it does something
      t:ok(own[effect] > 0.005 * springs, effect .. " costs next to nothing: is it there?")
    end
    -- what each adds does not depend on the others, so nothing of an absent one is left: to 1 % of
    -- a step
    t:near(cost["gravity,ground"] - springs, own.gravity + own.ground,
      { atol = 0.01 * springs })
    local sum = own.gravity + own.ground + own.friction + own.damping + own.actuation
    -- damping and actuation share a loop, whose registers run out when both are there
    t:near(all - springs, sum, { atol = 0.08 * springs })
    t:note(("springs alone cost %.2f of all effects together"):format(springs / all))
    t:ok(springs < 0.75 * all, "springs alone must cost well under a scene with every effect")
  end)

suite:test("the order in which a scene lists its effects changes no bit", function(t)
  local limax = require "limax"
  local ends = {}
  for i, names in ipairs { { "gravity", "ground", "friction", "damping", "actuation" },
    { "actuation", "damping", "friction", "ground", "gravity" } } do
    local scene = {}
    for _, name in ipairs(names) do scene[name] = true end
    local robot = limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }
      :simulate { scene = scene, duration = 0.5 }
    ends[i] = robot:displacement()
  end
  t:same_bits(ends[1], ends[2])
end)

return suite
