--- throughput.lua: `limax bench throughput`: springs per second. On the CPU of full 5x5x5 bodies:
--- each integrator and precision with all effects, then by threads; on a GPU see gpu.lua. Then the
--- cost of whole runs.

local bodies = require "limax.tools.bench.bodies"
local cases = require "limax.tools.bench.cases"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local ffi = require "ffi"
local gpu = require "limax.tools.bench.gpu"
local host = require "limax.host"
local shell = require "limax.base.shell"
local terminal = require "limax.base.terminal"
local timing = require "limax.tools.bench.timing"

local throughput = {}

local PRECISIONS = { "single", "compensated", "mixed", "double" }
local FIVE = { 5, 5, 5 }
local ROUNDS = 5

--- What every bench returns; those that only some set are in their files.
---@class limax.bench_result
---@field columns string[]
---@field rows table[]

-- ---- whole runs ---------------------------------------------------------------------------------

ffi.cdef [[
struct limax_bench_rusage { long times[4]; long max_resident; long others[13]; };
int getrusage(int who, struct limax_bench_rusage *usage);
]]
local CHILDREN = -1 -- RUSAGE_CHILDREN

-- Wall time of a `limax run`, s, and the largest resident memory of any child so far, bytes.
local function run_command(words)
  local quoted = {}
  for i, word in ipairs { host.executable, "run", unpack(words) } do
    quoted[i] = shell.quoted(word)
  end
  local folder, message = host.file.temporary()
  if not folder then failure.raise(1, message) end
  local began = host.clock()
  local pipe = assert(io.popen(('%s --out %s/run -q 2>&1; echo "status $?"'):format(
    table.concat(quoted, " "), shell.quoted(folder))))
  local text = pipe:read "*a"
  pipe:close()
  local seconds = host.clock() - began
  host.file.remove_temporary(folder)
  host.raise_if_interrupted()
  if not text:find "status 0\n$" then failure.raise(1, "limax run failed: " .. text) end
  local usage = ffi.new "struct limax_bench_rusage"
  ffi.C.getrusage(CHILDREN, usage)
  return seconds, 1024 * tonumber(usage.max_resident)
end

-- The seconds of a generation of `limax run walk.lua`, and the memory of a large population.
local function whole_runs(how, rows)
  local runs = { { generations = 2, robots = 30 } }
  if how.full then runs[2] = { generations = 1, robots = 1000 } end
  how.say ""
  for _, row in ipairs(runs) do
    local seconds, peak = run_command { host.home .. "/scripts/experiments/walk.lua",
      "--device", how.device.kind, "--threads", tostring(how.device.threads),
      "--set", "generations=" .. row.generations, "--set", "population=" .. row.robots,
      "--set", "lattice=[5,5,5]" }
    row.effects, row.threads = "limax run walk.lua", how.device.threads
    row.seconds_per_generation, row.peak_bytes = seconds / row.generations, peak
    rows[#rows + 1] = row
    how.say(("limax run walk.lua, %d robots, generations %d: %.3g s each, %.0f MB at most"):format(
      row.robots, row.generations, row.seconds_per_generation, peak / 1e6))
  end
end

-- ---- the CPU ------------------------------------------------------------------------------------

-- The outcome of a run that ends before chaos.
local function short_run(materials, integrator, precision, device)
  local population = bodies.population(materials, FIVE, 1)
  local simulation = engine.simulation(population, materials, engine.scene(bodies.ALL), {
    integrator = integrator, precision = precision, time_step = cases.TIME_STEP, duration = 0.1,
    settle = 0, record = { center_of_mass = 50 } }, device)
  simulation:run()
  local outcome = simulation:outcome(1)
  simulation:free()
  population:free()
  return outcome
end

-- Raises if a precision or an integrator ends too far from leapfrog in double.
local function check(materials, device)
  local reference = short_run(materials, "leapfrog", "double", device)
  assert(reference.status == "done" and reference.springs == 1940 and reference.masses == 216)
  for _, integrator in ipairs { "leapfrog", "symplectic_euler" } do
    for _, precision in ipairs(PRECISIONS) do
      local outcome = short_run(materials, integrator, precision, device)
      -- m: symplectic Euler is of first order, fp32 resolves 6e-8 m at a metre
      local tolerance = integrator == "leapfrog" and 2e-6 or 2e-4
      for axis = 1, 3 do
        local off = math.abs(outcome.center_end[axis] - reference.center_end[axis])
        if outcome.status ~= "done" or not (off < tolerance) then
          failure.raise(1, ("%s %s ends %.3g m from leapfrog double after 0.1 s; %.3g m are "
            .. "allowed: nothing is timed"):format(integrator, precision, off, tolerance))
        end
      end
    end
  end
end

local TABLE = { { "integrator" }, { "precision" }, { "effects" }, { "threads" }, { "robots" },
  { "springs/s", "springs_per_second", "%.3g" }, { "relative", "relative_to_default", "%.2f" } }

local function on_cpu(how)
  local materials, one = engine.materials "paper", engine.device("cpu", { threads = 1 })
  local about = one:describe()
  how.say(("%s, %s passes; full 5x5x5 voxels: 216 masses, 1940 springs; time step %g s"):format(
    about.cpu, about.isa, cases.TIME_STEP))
  check(materials, one)
  how.say "checked: every precision and integrator ends where leapfrog double does"

  local rows, list, default, plain = {}, {}, nil, {}
  local function add(integrator, precision, device, robots)
    rows[#rows + 1] = { integrator = integrator, precision = precision, effects = "all",
      threads = device.threads, robots = robots }
    list[#list + 1] = cases.endless(materials, { lattice = FIVE, count = robots,
      scene = bodies.ALL, integrator = integrator, precision = precision, device = device,
      seconds = how.seconds })
    return rows[#rows]
  end
  for _, precision in ipairs(PRECISIONS) do
    plain[precision] = add("symplectic_euler", precision, one, 1)
  end
  for _, precision in ipairs(PRECISIONS) do
    local row = add("leapfrog", precision, one, 1)
    if precision == "compensated" then default = row end
  end
  -- the same work for one thread and for all, with enough robots that no thread waits
  local robots = 8 * how.device.threads
  local on_one = add("leapfrog", "compensated", one, robots)
  local on_all = add("leapfrog", "compensated", how.device, robots)

  for i, rate in ipairs(timing.best_rates(list, ROUNDS)) do
    rows[i].springs_per_second = rate
    list[i].free()
  end
  local function ratio(row, other) return row.springs_per_second / other.springs_per_second end
  for _, row in ipairs(rows) do row.relative_to_default = ratio(row, default) end
  how.say("\n" .. terminal.rows(TABLE, rows, terminal.style {}) .. "\n")
  how.say(("of symplectic Euler single: the default (leapfrog, compensated) %.2f, mixed %.2f, "
    .. "double %.2f"):format(ratio(default, plain.single), ratio(plain.mixed, plain.single),
    ratio(plain.double, plain.single)))
  how.say(("%d threads against one, %d robots each: %.2f"):format(how.device.threads, robots,
    ratio(on_all, on_one)))
  return { rows = rows, columns = { "integrator", "precision", "effects", "threads", "robots",
    "springs_per_second", "relative_to_default" } }
end

function throughput.run(how)
  local result = how.device.kind == "cuda" and gpu.run(how) or on_cpu(how)
  whole_runs(how, result.rows)
  for _, column in ipairs { "generations", "seconds_per_generation", "peak_bytes" } do
    result.columns[#result.columns + 1] = column
  end
  return result
end

return throughput
