--- effects.lua: `limax bench effects`: the time of a step with springs only, with each effect, with
--- all but each, and with all; on a GPU also the registers and instructions of the scene's kernel.

local cases = require "limax.tools.bench.cases"
local choice = require "limax.base.choice"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local terminal = require "limax.base.terminal"

local effects = {}

local ROUNDS = 10
-- enough to fill a large GPU
local ROBOTS = { cpu = 1, cuda = 4224 }
local KERNEL = { "passes", "path", "origin", "registers", "spilled", "instructions" }
local COLUMNS = { "device", "effects", "robots", "seconds_per_step", "relative_to_all",
  "relative_to_springs", unpack(KERNEL) }

local TABLE = { { "effects" },
  { "us/step", function(row) return 1e6 * row.seconds_per_step end, "%.4g" },
  { "of all", "relative_to_all", "%.2f" }, { "of springs", "relative_to_springs", "%.2f" },
  { "instructions" }, { "registers" }, { "spilled" }, { "kernel", "origin" } }

-- A controller takes the place of actuation, which is in "all"; some effects act through it.
local CONTROL = { signal = "a = clock_sine;" }
local OF_CONTROL = { control = {}, damage = { "damage" }, growth = { "growth" } }

-- Named scenes: springs only first, then each effect with those that it needs, all but each effect
-- and those that need it, and all.
local function scenes()
  local infos, names = {}, {}
  for _, info in ipairs(engine.effects()) do
    infos[info.name] = info
    -- every scene has springs
    if info.name ~= "springs" and not OF_CONTROL[info.name] then names[#names + 1] = info.name end
  end
  local function with_needs(name, scene)
    scene[name] = true
    -- any one of them
    local need = infos[name].needs[1]
    return need and with_needs(need, scene) or scene
  end
  local function text_of(is_in)
    local list = {}
    for _, name in ipairs(names) do
      if is_in(name) then list[#list + 1] = name end
    end
    return table.concat(list, ", ")
  end
  local all, list = {}, { { name = "none but springs", scene = {} } }
  for _, name in ipairs(choice.sorted_keys(OF_CONTROL)) do
    local scene = { control = CONTROL }
    for _, effect in ipairs(OF_CONTROL[name]) do scene[effect] = true end
    list[#list + 1] = { name = table.concat({ "control", unpack(OF_CONTROL[name]) }, ", "),
      scene = scene }
  end
  for _, name in ipairs(names) do
    local scene = with_needs(name, {})
    list[#list + 1] = { name = text_of(function(each) return scene[each] end), scene = scene }
    all[name] = true
  end
  for _, left_out in ipairs(names) do
    local scene = {}
    for _, name in ipairs(names) do
      scene[name] = not with_needs(name, {})[left_out] or nil
    end
    list[#list + 1] = { scene = scene,
      name = "all but " .. text_of(function(name) return not scene[name] end) }
  end
  list[#list + 1] = { name = "all", scene = all }
  return list
end

function effects.run(how)
  local materials, device = engine.materials "paper", how.device
  local on_cpu = device.kind == "cpu"
  if on_cpu then device = engine.device("cpu", { threads = 1 }) end
  local about = device:describe()
  local on = about.gpus and about.gpus[1].name or about.cpu
  local robots, list = ROBOTS[device.kind], scenes()
  how.say(("%s; full 5x5x5 voxels, %d robot%s; leapfrog, compensated; time step %g s"):format(on,
    robots, robots == 1 and "" or "s", cases.TIME_STEP))

  local rows, timed = {}, {}
  for i, scene in ipairs(list) do
    local case = cases.endless(materials, { lattice = { 5, 5, 5 }, count = robots,
      scene = scene.scene, integrator = "leapfrog", precision = "compensated", device = device,
      seconds = how.seconds / 5 })
    if not (case.run() > 0) then
      failure.raise(1, scene.name .. ": no step was done: nothing is timed")
    end
    host.raise_if_interrupted()
    timed[i], rows[i] = case, { device = on, effects = scene.name, robots = robots }
    for _, name in ipairs(KERNEL) do rows[i][name] = case.facts[name] end
  end
  -- one thread: processor time does not contain a busy machine's other work
  for i, rate in ipairs(cases.best_rates(timed, ROUNDS, on_cpu and os.clock or nil)) do
    rows[i].seconds_per_step = timed[i].springs * robots / rate
    timed[i].free()
  end
  for _, row in ipairs(rows) do
    row.relative_to_all = row.seconds_per_step / rows[#rows].seconds_per_step
    row.relative_to_springs = row.seconds_per_step / rows[1].seconds_per_step
  end
  -- a CPU has no kernel
  local columns = on_cpu and { unpack(TABLE, 1, 4) } or TABLE
  how.say("\n" .. terminal.rows(columns, rows, terminal.style {}))
  return { columns = COLUMNS, rows = rows }
end

return effects
