--- effects_cost.lua: a scene pays only for its effects, counted in instructions.

local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"

local suite = require("limax.test").suite "effects cost"

-- So many that the 5e4 instructions of the call itself are less than 0.5 %.
local STEPS = 640

-- Instructions of one step of a full body of 5x5x5 voxels, counted by valgrind, whatever else runs
-- on the machine. Valgrind does not support AVX-512: it counts the passes for x86-64-v3.
local function instructions_of(scene)
  local output = process.output(table.concat({ "valgrind --tool=callgrind",
    "--callgrind-out-file=/dev/null --toggle-collect='limax_simulation_advance*'",
    process.quote(host.executable),
    process.quote(host.home .. "/tests/support/counted_steps.lua"), STEPS,
    process.quote(host.json.encode(scene)), "2>&1" }, " "))
  local count = tonumber(output:match "Collected : (%d+)")
  if not count or count == 0 then error("callgrind counted nothing:\n" .. output, 0) end
  return count / STEPS
end

suite:test("an effect costs its own instructions, and nothing if it is absent",
  { tags = { "cost" } }, function(t)
    if os.execute "command -v valgrind >/dev/null 2>&1" ~= 0 then
      t:skip "valgrind is not installed"
    end
    local cost = {}
    for _, effects in ipairs { "", "gravity", "ground", "gravity,ground",
      "gravity,ground,damping,actuation" } do
      local scene = {}
      for name in effects:gmatch "[^,]+" do scene[name] = true end
      cost[effects] = instructions_of(scene)
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
