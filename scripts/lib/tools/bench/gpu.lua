--- gpu.lua: `limax bench throughput` on a GPU by population, lattice and precision, with the kernel
--- of each row. Last states are compared with the CPU and with stored hashes before anything is
--- timed.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local agreement = require "limax.tools.bench.agreement"
local bodies = require "limax.tools.bench.bodies"
local cases = require "limax.tools.bench.cases"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local object = require "limax.engine.object"
local simulations = require "limax.engine.simulation"
local terminal = require "limax.base.terminal"
local timing = require "limax.tools.bench.timing"

-- engine/bench/reconstruction.h
ffi.cdef [[
limax_status limax_bench_reconstruction(limax_device *, const limax_population *,
  const limax_materials *, const limax_scene *, const limax_simulation_options *, int64_t steps,
  double *seconds, double center[3]);
]]

local gpu = {}

local ROUNDS = 2
-- the paper's figure for its kernel (arXiv 2405.00698), springs per second
local PAPER, PAPER_GPU = 7.89e9, "RTX 3090"
local PRECISIONS = { "single", "compensated", "mixed", "double" }
-- 132 is one robot for each multiprocessor of an H200
local POPULATIONS = { 1, 30, 132, 264, 1056, 4224, 16384 }
-- voxels along each axis, and robots that fill a large GPU
local LATTICES = { { 3, 16384 }, { 5, 4224 }, { 8, 1056 }, { 10, 528 }, { 20, 66 }, { 50, 1 } }
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

-- What is timed: each axis with the default precision, or every combination.
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

local function set_rate(row, rate)
  row.springs_per_second = rate
  row.robot_seconds_per_second = rate / row.springs * cases.TIME_STEP
  row.seconds_per_step = row.springs * row.robots / rate
  return row
end

local function measured(materials, entry, device, seconds)
  local case = cases.endless(materials, { lattice = { entry.edge, entry.edge, entry.edge },
    count = entry.robots, scene = entry.scene, integrator = "leapfrog",
    precision = entry.precision, device = device, seconds = seconds })
  local rate = timing.best_rates({ case }, ROUNDS)[1]
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
  return set_rate(row, rate)
end

local function handle(value) return object.handle("reconstruction", value, getmetatable(value)) end

-- A reconstruction of the scheme that the paper sketches, on the same bodies in the same run. It
-- ends where symplectic Euler in single precision does, or it is not timed.
local function reconstruction_row(materials, device, model)
  local robots, steps = 2112, 2000
  local population = bodies.population(materials, { 5, 5, 5 }, robots)
  local scene = engine.scene(bodies.ALL)
  local options = { integrator = "symplectic_euler", precision = "single", settle = 0,
    time_step = cases.TIME_STEP, duration = steps * cases.TIME_STEP }
  local seconds, center = ffi.new "double[1]", ffi.new "double[3]"
  abi.check(abi.C.limax_bench_reconstruction(handle(device), handle(population), handle(materials),
    handle(scene), simulations.options_of(options), steps, seconds, center), "reconstruction")
  local simulation = engine.simulation(population, materials, scene, options, device)
  simulation:run()
  local outcome, allowed = simulation:outcome(1), agreement.tolerance("single", bodies.ALL)
  for axis = 1, 3 do
    local off = math.abs(center[axis - 1] - outcome.center_end[axis])
    if not (off <= allowed) then
      failure.raise(1, ("the reconstruction ends %.3g m from a simulation, %.3g m are allowed: "
        .. "it is not timed"):format(off, allowed))
    end
  end
  local row = { device = model, lattice = "5x5x5", robots = robots, masses = outcome.masses,
    springs = outcome.springs, integrator = "symplectic_euler", precision = "single",
    effects = "all", path = "reconstruction" }
  simulation:free()
  population:free()
  return set_rate(row, row.springs * robots * steps / seconds[0])
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
  local found, worst =
    agreement.check(materials, device, { { 5, 5, 5 }, { 8, 8, 8 } }, PRECISIONS)
  how.say(("checked: after %g s every precision is where the CPU is; %.2g of what is allowed at "
    .. "most"):format(agreement.SETTLE + agreement.DURATION, worst))
  if how.store then
    how.say("stored: " .. agreement.store_hashes(model, found))
  else
    how.say("checked: " .. agreement.compare_hashes(model, found))
  end
  local rows, best = {}, 0
  for _, entry in ipairs(plan(how.full)) do
    local row = row_of(materials, entry, device, model, how.seconds)
    rows[#rows + 1] = row
    if row.effects == "all" then best = math.max(best, row.springs_per_second or 0) end
  end
  how.say("\n" .. terminal.rows(TABLE, rows, terminal.style {}))
  how.say "(registers of a thread; spilled: bytes of a thread; blocks of a multiprocessor)"
  local plain = reconstruction_row(materials, device, model)
  rows[#rows + 1] = plain
  how.say(("a reconstruction of the paper's scheme (a thread per spring, then per mass; "
    .. "shared-memory float atomics are our assumption), %d robots, symplectic Euler, single: "
    .. "%.3g springs/s"):format(plain.robots, plain.springs_per_second))
  how.say(("the fastest row of all effects above is %.1f times that; the paper's own figure is "
    .. "%.3g springs/s, on an %s: %.1f times that"):format(best / plain.springs_per_second, PAPER,
    PAPER_GPU, best / PAPER))
  return { columns = { unpack(COLUMNS) }, rows = rows, hashes = found }
end

return gpu
