--- throughput.lua: `limax bench throughput`: springs per second. On the CPU of full 5x5x5 bodies:
--- each integrator and precision with all effects, then by threads; on a GPU see gpu.lua.

local bodies = require "limax.tools.bench.bodies"
local cases = require "limax.tools.bench.cases"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local gpu = require "limax.tools.bench.gpu"
local terminal = require "limax.base.terminal"

local throughput = {}

local PRECISIONS = { "single", "compensated", "double" }
local FIVE = { 5, 5, 5 }
local ROUNDS = 5

--- The result of every bench; fields that only some set are in their files.
---@class limax.bench_result
---@field columns string[]
---@field rows table[]

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

  for i, rate in ipairs(cases.best_rates(list, ROUNDS)) do
    rows[i].springs_per_second = rate
    list[i].free()
  end
  local function ratio(row, other) return row.springs_per_second / other.springs_per_second end
  for _, row in ipairs(rows) do row.relative_to_default = ratio(row, default) end
  how.say("\n" .. terminal.rows(TABLE, rows, terminal.style {}) .. "\n")
  how.say(("of symplectic Euler single: the default (leapfrog, compensated) %.2f, double %.2f")
    :format(ratio(default, plain.single), ratio(plain.double, plain.single)))
  how.say(("%d threads against one, %d robots each: %.2f"):format(how.device.threads, robots,
    ratio(on_all, on_one)))
  return { rows = rows, columns = { "integrator", "precision", "effects", "threads", "robots",
    "springs_per_second", "relative_to_default" } }
end

function throughput.run(how) return how.device.kind == "cuda" and gpu.run(how) or on_cpu(how) end

return throughput
