--- throughput.lua: `limax bench throughput`: springs per second. On the CPU of full 5x5x5 bodies:
--- each integrator and precision with all effects, then without each effect, then by threads; on a
--- GPU see gpu.lua. Then the cost of whole runs.

local bodies = require "limax.tools.bench.bodies"
local cases = require "limax.tools.bench.cases"
local child = require "limax.tools.bench.child"
local engine = require "limax.engine"
local gpu = require "limax.tools.bench.gpu"
local host = require "limax.host"
local timing = require "limax.tools.bench.timing"

local throughput = {}

local EFFECTS = { "gravity", "friction", "ground", "damping", "actuation" }
local PRECISIONS = { "single", "compensated", "mixed", "double" }
local FIVE = { 5, 5, 5 }
local ROUNDS = 5

-- The outcome of a run that ends before chaos.
local function short_run(materials, scene, integrator, precision, device)
  local population = bodies.population(materials, FIVE, 1)
  local simulation = engine.simulation(population, materials, engine.scene(scene), {
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
  local reference = short_run(materials, bodies.ALL, "leapfrog", "double", device)
  assert(reference.status == "done" and reference.springs == 1940 and reference.masses == 216)
  for _, integrator in ipairs { "leapfrog", "symplectic_euler" } do
    for _, precision in ipairs(PRECISIONS) do
      local outcome = short_run(materials, bodies.ALL, integrator, precision, device)
      -- m: symplectic Euler is of first order, fp32 resolves 6e-8 m at a metre
      local tolerance = integrator == "leapfrog" and 2e-6 or 2e-4
      for axis = 1, 3 do
        local off = math.abs(outcome.center_end[axis] - reference.center_end[axis])
        if outcome.status ~= "done" or not (off < tolerance) then
          error(("%s %s ends %.3g m from leapfrog double after 0.1 s; %.3g m are allowed: "
            .. "nothing is timed"):format(integrator, precision, off, tolerance), 0)
        end
      end
    end
  end
end

local function without(name)
  local scene = {}
  for _, effect in ipairs(EFFECTS) do scene[effect] = effect ~= name or nil end
  -- friction acts where something touches
  if name == "ground" then scene.friction = nil end
  return scene
end

-- The seconds of a generation of `limax run walk.lua`, and the memory of a large population.
local function whole_runs(how, rows)
  local walk = host.home .. "/scripts/experiments/walk.lua"
  local runs = { { generations = 2, robots = 30 } }
  if how.full then runs[2] = { generations = 1, robots = 1000 } end
  how.say ""
  for _, size in ipairs(runs) do
    local words = { "--device", how.device.kind, "--set", "generations=" .. size.generations,
      "--set", "population=" .. size.robots, "--set", "lattice=[5,5,5]",
      "--threads", tostring(how.device.threads) }
    local cost = child.run(walk, words)
    local row = { effects = "limax run walk.lua", threads = how.device.threads,
      robots = size.robots, generations = size.generations,
      seconds_per_generation = cost.seconds / size.generations, peak_bytes = cost.peak_bytes }
    rows[#rows + 1] = row
    how.say(("limax run walk.lua, %d robots, generations %d: %.3g s each, %.0f MB at most"):format(
      size.robots, size.generations, row.seconds_per_generation, row.peak_bytes / 1e6))
  end
end

---@class limax.bench_result
---@field columns string[]
---@field rows table[]

---@class limax.bench_how
---@field device limax.device
---@field threads integer|nil
---@field seconds number of one repeat of one measurement
---@field full boolean|nil every combination on a GPU; the memory of a large population
---@field store boolean|nil store the hashes of the last states of this GPU model
---@field say fun(text: string)

local function on_cpu(how)
  local materials = engine.materials "paper"
  local one = engine.device("cpu", { threads = 1 })
  local about = one:describe()
  how.say(("%s, %s passes; full 5x5x5 voxels: 216 masses, 1940 springs; time step %g s"):format(
    about.cpu, about.isa, cases.TIME_STEP))
  check(materials, one)
  how.say "checked: every precision and integrator ends where leapfrog double does"

  local rows, list = {}, {}
  local function add(row, scene, device, count)
    row.robots = count
    rows[#rows + 1] = row
    list[#list + 1] = cases.endless(materials, { lattice = FIVE, count = count, scene = scene,
      integrator = row.integrator, precision = row.precision, device = device,
      seconds = how.seconds })
  end
  local place = {} -- of a row, by integrator and precision
  for _, integrator in ipairs { "symplectic_euler", "leapfrog" } do
    place[integrator] = {}
    for _, precision in ipairs(PRECISIONS) do
      add({ integrator = integrator, precision = precision, effects = "all", threads = 1 },
        bodies.ALL, one, 1)
      place[integrator][precision] = #rows
    end
  end
  local function add_default(effects, scene, device, threads, count)
    add({
      integrator = "leapfrog", precision = "compensated", effects = effects, threads = threads,
    }, scene, device, count)
  end
  for _, effect in ipairs(EFFECTS) do
    local name = effect == "ground" and "ground and friction" or effect
    add_default("all but " .. name, without(effect), one, 1, 1)
  end
  add_default("gravity", { gravity = true }, one, 1, 1)
  add_default("none but springs", {}, one, 1, 1)
  local team = how.device
  local threads = team.threads
  -- the same work for one thread and for all, with enough robots that no thread waits
  add_default("all", bodies.ALL, one, 1, 8 * threads)
  add_default("all", bodies.ALL, team, threads, 8 * threads)

  local rates = timing.best_rates(list, ROUNDS)
  for _, case in ipairs(list) do case.free() end
  local default = rates[place.leapfrog.compensated]
  how.say ""
  how.say(("%-17s %-12s %-27s %7s %6s %10s %8s"):format("integrator", "precision", "effects",
    "threads", "robots", "springs/s", "relative"))
  for i, row in ipairs(rows) do
    row.springs_per_second = rates[i]
    row.relative_to_default = rates[i] / default
    how.say(("%-17s %-12s %-27s %7d %6d %10.3g %8.2f"):format(row.integrator, row.precision,
      row.effects, row.threads, row.robots, rates[i], rates[i] / default))
  end
  how.say ""
  local euler = place.symplectic_euler
  local plain = rates[euler.single]
  how.say(("of symplectic Euler single: the default (leapfrog, compensated) %.2f, mixed %.2f, "
    .. "double %.2f"):format(default / plain, rates[euler.mixed] / plain,
    rates[euler.double] / plain))
  how.say(("%d threads against one, %d robots each: %.2f"):format(threads, 8 * threads,
    rates[#rates] / rates[#rates - 1]))
  return {
    columns = { "integrator", "precision", "effects", "threads", "robots", "springs_per_second",
      "relative_to_default" },
    rows = rows,
  }
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
