--- effects_cost.lua: a scene pays only for its effects, counted in instructions.

local limax = require "limax"
local instructions = require "support.instructions"
local suite = require("limax.test").suite "effects cost"

suite:test("an effect costs its own instructions, and nothing if it is absent",
  { tags = { "cost" } }, function(t)
    if not instructions.available() then t:skip "valgrind is not installed" end
    local cost = {}
    for _, effects in ipairs { "", "gravity", "ground", "gravity,ground",
      "gravity,ground,damping,actuation" } do
      local scene = {}
      for name in effects:gmatch "[^,]+" do scene[name] = true end
      cost[effects] = instructions.per_step(scene)
    end
    local springs = cost[""]
    for effects, each in pairs(cost) do
      t:note(("%s: %.0f instructions a step, %.1f %% more than springs"):format(effects, each,
        100 * (each / springs - 1)))
      t:ok(effects == "" or each > 1.005 * springs, effects .. " cost next to nothing")
    end
    -- the costs add up
    t:near(cost["gravity,ground"] - springs, cost.gravity + cost.ground - 2 * springs,
      { atol = 0.01 * springs })
    t:ok(springs < 0.75 * cost["gravity,ground,damping,actuation"],
      "springs without effects must cost well under all effects")
  end)

suite:test("the order of a scene's effects changes no bit", function(t)
  local ends = {}
  for i, names in ipairs { { "gravity", "ground", "friction", "damping", "actuation" },
    { "actuation", "damping", "friction", "ground", "gravity" } } do
    local scene = {}
    for _, name in ipairs(names) do scene[name] = true end
    ends[i] = limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }
      :simulate { scene = scene, duration = 0.5 }:displacement()
  end
  t:same_bits(ends[1], ends[2])
end)
