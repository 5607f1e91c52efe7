--- effects_cost.lua: a scene pays only for the effects it names, counted in instructions, which no
--- other process disturbs.

local suite = require("limax.test").suite "effects cost"
local host = require "limax.host"

-- Runs one full 5x5x5 body for so many steps in a scene.
local PROGRAM = [[
local engine = require "limax.engine"
local steps, names = tonumber(arg[1]), arg[2] or ""
local scene = {}
for name in names:gmatch "[^,]+" do scene[name] = true end
local materials = engine.materials "paper"
local bodies = engine.population { lattice = { 5, 5, 5 }, count = 1 }
local voxels = {}
for i = 1, 125 do voxels[i] = 1 + i % 4 end
bodies:set_body(1, voxels)
bodies:check(materials)
local simulation = engine.simulation(bodies, materials, engine.scene(scene),
  { duration = 100, time_step = 1e-4, settle = 0 }, engine.device("cpu", { threads = 1 }))
simulation:advance(1, steps)
]]

local function instructions(program, steps, effects)
  local command = ("valgrind --tool=callgrind --callgrind-out-file=/dev/null "
    .. '"%s" "%s" %d "%s" 2>&1'):format(host.executable, program, steps, effects)
  local pipe = assert(io.popen(command))
  local output = pipe:read "*a"
  pipe:close()
  local count = output:match "Collected : (%d+)"
  return tonumber(count) or error("callgrind counted nothing:\n" .. output)
end

-- Instructions of one step: start-up drops out of the difference of two runs. It varies by some
-- 1e5 from run to run (addresses decide the order of hash tables), so the runs differ by many
-- steps.
local function per_step(program, effects)
  return (instructions(program, 4160, effects) - instructions(program, 320, effects)) / 3840
end

suite:test("an effect costs its own instructions and nothing where it is absent",
  { limit = 300, tags = { "cost" } }, function(t)
    if os.execute "command -v valgrind >/dev/null 2>&1" ~= 0 then
      t:skip "valgrind is not installed"
    end
    local program = t:folder() .. "/steps.lua"
    t:ok(host.file.write_atomic(program, PROGRAM))

    local cost = {}
    for _, effects in ipairs { "", "gravity", "ground", "damping", "actuation", "gravity,ground",
      "ground,friction", "gravity,ground,friction,damping,actuation" } do
      cost[effects] = per_step(program, effects)
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
