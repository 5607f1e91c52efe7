--- gpu.lua: `limax bench throughput` on a GPU by population, lattice and precision, with the kernel
--- of each row. Last states are compared with the CPU before anything is timed.

local agreement = require "limax.tools.bench.agreement"
local bodies = require "limax.tools.bench.bodies"
local cases = require "limax.tools.bench.cases"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local terminal = require "limax.base.terminal"

local gpu = {}

local ROUNDS = 2
local PRECISIONS = { "single", "compensated", "double" }
-- 132 is one robot for each multiprocessor of an H200
local POPULATIONS = { 1, 30, 132, 264, 1056, 4224, 16384 }
-- voxels along each axis, and robots that fill a large GPU
local LATTICES = { { 3, 16384 }, { 5, 4224 }, { 8, 1056 }, { 10, 528 }, { 14, 44 }, { 20, 66 },
  { 30, 16 }, { 50, 1 } }
local KERNEL = { "path", "origin", "architecture", "threads", "registers", "spilled",
  "shared_bytes", "blocks_of_multiprocessor", "instructions" }

local COLUMNS = { "device", "lattice", "robots", "masses", "springs", "integrator", "precision",
  "effects", "springs_per_second", "robot_seconds_per_second", "seconds_per_step", "failed",
  unpack(KERNEL) }

local TABLE = { { "lattice" }, { "robots", "robots", "%d" }, { "precision" }, { "effects" },
  { "springs/s", "springs_per_second", "%.3g" },
  { "robot-s/s", "robot_seconds_per_second", "%.3g" },
  { "us/step", function(row) return row.seconds_per_step and 1e6 * row.seconds_per_step end,
    "%.3g" },
  { "path" }, { "registers" }, { "spilled" }, { "instructions" },
  { "blocks", "blocks_of_multiprocessor" },
  { "kernel", function(row) return row.origin or row.failed end } }

-- Plans the measurements: each axis with the default precision, or every combination.
local function plan(full)
  local list, taken = {}, {}
  local function add(edge, robots, precision, effects, scene)
    local name = ("%d %d %s %s"):format(edge, robots, precision, effects)
    if taken[name] then return end
    taken[name] = true
    list[#list + 1] = { edge = edge, robots = robots, precision = precision, effects = effects,
      scene = scene }
  end
  for _, precision in ipairs(full and PRECISIONS or { "compensated" }) do
    for _, robots in ipairs(POPULATIONS) do add(5, robots, precision, "all", bodies.ALL) end
    for _, entry in ipairs(LATTICES) do add(entry[1], entry[2], precision, "all", bodies.ALL) end
  end
  for _, precision in ipairs(PRECISIONS) do add(5, 4224, precision, "all", bodies.ALL) end
  for _, precision in ipairs(full and PRECISIONS or { "single" }) do
    add(5, 4224, precision, "gravity", { gravity = true })
  end
  return list
end

local function measured(materials, entry, device, seconds)
  local case = cases.endless(materials, { lattice = { entry.edge, entry.edge, entry.edge },
    count = entry.robots, scene = entry.scene, integrator = "leapfrog",
    precision = entry.precision, device = device, seconds = seconds })
  local rate = cases.best_rates({ case }, ROUNDS)[1]
  case.free()
  return case, rate
end

-- One row, which reports if the GPU does not have enough memory.
local function row_of(materials, entry, device, model, seconds)
  local row = { device = model, lattice = ("%dx%dx%d"):format(entry.edge, entry.edge, entry.edge),
    robots = entry.robots, integrator = "leapfrog", precision = entry.precision,
    effects = entry.effects }
  local fine, case, rate = failure.attempt(measured, materials, entry, device, seconds)
  if not fine then
    if failure.of_machine(case) ~= "memory" then error(case, 0) end
    row.failed = failure.bare(case)
    return row
  end
  row.masses, row.springs = case.masses, case.springs
  for _, name in ipairs(KERNEL) do row[name] = case.facts[name] end
  row.springs_per_second = rate
  row.robot_seconds_per_second = rate / row.springs * cases.TIME_STEP
  row.seconds_per_step = row.springs * row.robots / rate
  return row
end

--- Measures a GPU.
---@param how table with a device of kind "cuda"
function gpu.run(how)
  local materials, device = engine.materials "paper", how.device
  local about = device:describe()
  local model = about.gpus[1].name
  how.say(("%d x %s, %s, %s; full voxels; leapfrog; time step %g s"):format(#about.gpus, model,
    about.cuda, about.nvrtc:match "^%d" and "NVRTC " .. about.nvrtc or "no NVRTC",
    cases.TIME_STEP))
  local worst = agreement.check(materials, device, { { 5, 5, 5 }, { 8, 8, 8 } }, PRECISIONS)
  how.say(("checked: after %g s every precision is where the CPU is; %.2g of what is allowed at "
    .. "most"):format(agreement.SETTLE + agreement.DURATION, worst))
  local rows = {}
  for k, entry in ipairs(plan(how.full)) do
    rows[k] = row_of(materials, entry, device, model, how.seconds)
  end
  how.say("\n" .. terminal.rows(TABLE, rows, terminal.style {}))
  how.say "(registers of a thread; spilled: bytes of a thread; blocks of a multiprocessor)"
  return { columns = { unpack(COLUMNS) }, rows = rows }
end

return gpu
