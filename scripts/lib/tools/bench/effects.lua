--- effects.lua: `limax bench effects`: the time of a step with springs only, with each effect, with
--- all but each, and with all; on a GPU also the registers and instructions of the scene's kernel.

local cases = require "limax.tools.bench.cases"
local engine = require "limax.engine"
local host = require "limax.host"
local instructions = require "limax.tools.bench.instructions"
local timing = require "limax.tools.bench.timing"

local effects = {}

local ROUNDS = 10
-- enough to fill a large GPU
local ROBOTS = { cpu = 1, cuda = 4224 }
-- `instructions` are of the kernel, or of a step on a CPU where they are counted
local KERNEL = { "path", "origin", "registers", "spilled", "instructions" }
local COLUMNS = { "device", "effects", "robots", "seconds_per_step", "relative_to_all",
  "relative_to_springs", "passes", unpack(KERNEL) }

-- A scene of the named effects and of those that they need.
local function with_needs(infos, names)
  local scene = {}
  local function add(name)
    scene[name] = true
    -- any one of them
    local need = infos[name].needs[1]
    if need then add(need) end
  end
  for _, name in ipairs(names) do add(name) end
  return scene
end

-- All effects except one and those that need it.
local function without(infos, names, left_out)
  local scene = {}
  for _, name in ipairs(names) do
    local own = with_needs(infos, { name })
    if not own[left_out] then scene[name] = true end
  end
  return scene
end

local function text_of(names, scene)
  local list = {}
  for _, name in ipairs(names) do
    if scene[name] then list[#list + 1] = name end
  end
  return table.concat(list, ", ")
end

-- Named scenes: springs only first, all last.
local function scenes()
  local infos, names = {}, {}
  for _, info in ipairs(engine.effects()) do
    infos[info.name] = info
    -- every scene has springs
    if info.name ~= "springs" then names[#names + 1] = info.name end
  end
  local all = with_needs(infos, names)
  local list = { { name = "none but springs", scene = {} } }
  for _, name in ipairs(names) do
    local scene = with_needs(infos, { name })
    list[#list + 1] = { name = text_of(names, scene), scene = scene }
  end
  for _, name in ipairs(names) do
    local scene, gone = without(infos, names, name), {}
    for _, other in ipairs(names) do gone[other] = not scene[other] end
    list[#list + 1] = { name = "all but " .. text_of(names, gone), scene = scene }
  end
  list[#list + 1] = { name = "all", scene = all }
  return list
end

local function count(rows, list, say)
  if not instructions.available() then
    say "instructions are not counted: valgrind is not installed"
    return
  end
  say "counting instructions takes minutes; they are of the passes for x86-64-v3"
  for i, scene in ipairs(list) do
    host.raise_if_interrupted()
    rows[i].instructions = math.floor(instructions.per_step(scene.scene) + 0.5)
  end
end

function effects.run(how)
  local materials = engine.materials "paper"
  local device = how.device
  if device.kind == "cpu" then device = engine.device("cpu", { threads = 1 }) end
  local about = device:describe()
  local on = about.gpus and about.gpus[1].name or about.cpu
  local robots = ROBOTS[device.kind]
  how.say(("%s; full 5x5x5 voxels, %d robot%s; leapfrog, compensated; time step %g s"):format(on,
    robots, robots == 1 and "" or "s", cases.TIME_STEP))

  local rows, list = {}, {}
  for i, scene in ipairs(scenes()) do
    local case = cases.endless(materials, { lattice = { 5, 5, 5 }, count = robots,
      scene = scene.scene, integrator = "leapfrog", precision = "compensated", device = device,
      seconds = how.seconds / 5 })
    if not (case.run() > 0) then error(scene.name .. ": no step was done: nothing is timed", 0) end
    host.raise_if_interrupted()
    list[i] = case
    rows[i] = { device = on, effects = scene.name, robots = robots }
    for _, name in ipairs { "passes", unpack(KERNEL) } do rows[i][name] = case.facts[name] end
  end
  -- one thread: processor time does not contain a busy machine's other work
  local on_cpu = device.kind == "cpu"
  local rates = timing.best_rates(list, ROUNDS, on_cpu and os.clock or nil)
  for i, case in ipairs(list) do
    rows[i].seconds_per_step = case.springs * robots / rates[i]
    case.free()
  end

  if on_cpu and how.full then count(rows, scenes(), how.say) end

  how.say ""
  how.say(("%-32s %10s %7s %11s%s"):format("effects", "us/step", "of all", "of springs",
    on_cpu and (rows[1].instructions and "   instructions/step  of springs" or "")
      or "   registers  spilled  instructions  kernel"))
  local springs, all = rows[1].seconds_per_step, rows[#rows].seconds_per_step
  for _, row in ipairs(rows) do
    row.relative_to_all = row.seconds_per_step / all
    row.relative_to_springs = row.seconds_per_step / springs
    local kernel = row.registers and ("  %10d %8d %13d  %s"):format(row.registers, row.spilled,
      row.instructions, row.origin)
      or row.instructions and ("  %18d %11.2f"):format(row.instructions,
        row.instructions / rows[1].instructions) or ""
    how.say(("%-32s %10.4g %7.2f %11.2f%s"):format(row.effects, 1e6 * row.seconds_per_step,
      row.relative_to_all, row.relative_to_springs, kernel))
  end
  return { columns = COLUMNS, rows = rows }
end

return effects
