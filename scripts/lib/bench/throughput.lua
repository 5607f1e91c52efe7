--- throughput.lua: springs per second of full 5x5x5 bodies: each integrator and precision with all
--- effects, then what each absent effect saves, then threads; and what whole runs cost. A spring
--- counts once per step, whatever its masses cost; wall time includes everything that `advance`
--- does: limits, origin, centre of mass at 50 Hz.

local child = require "limax.bench.child"
local engine = require "limax.engine"
local host = require "limax.host"
local timing = require "limax.bench.timing"

local throughput = {}

-- five effects besides the springs, which every scene has
local ALL = {
  gravity = true, ground = true, friction = true, damping = true, actuation = true,
}
local EFFECTS = { "gravity", "friction", "ground", "damping", "actuation" }
-- s: well under the bound of these bodies with every integrator, and a divisor of the sample
-- interval
local TIME_STEP = 1e-4
local ROUNDS = 5

-- Full bodies with all four materials in layers and weights that differ, so that nothing is
-- degenerate.
local function full_bodies(materials, count)
  local bodies = engine.population { lattice = { 5, 5, 5 }, count = count }
  local voxels, stiffness, amplitude, phase = {}, {}, {}, {}
  for voxel = 1, 125 do
    voxels[voxel] = 1 + (voxel * 7) % 4
    stiffness[voxel] = 0.3 + 0.7 * ((voxel * 37) % 101) / 100
    amplitude[voxel] = 0.2 + 0.6 * ((voxel * 53) % 101) / 100
    phase[voxel] = ((voxel * 71) % 101) / 100
  end
  for robot = 1, count do
    bodies:set_body(robot, voxels,
      { stiffness = stiffness, amplitude = amplitude, phase = phase })
  end
  bodies:check(materials, { require_muscle = false })
  return bodies
end

local function options(integrator, precision, duration)
  return {
    integrator = integrator, precision = precision, time_step = TIME_STEP, duration = duration,
    settle = 0, record = { center_of_mass = 50 },
  }
end

-- Where the centre of mass ends after a short run: before chaos, and with every effect at work.
local function short_run(materials, scene, integrator, precision, device)
  local bodies = full_bodies(materials, 1)
  local simulation = engine.simulation(bodies, materials, engine.scene(scene),
    options(integrator, precision, 0.1), device)
  simulation:run()
  local outcome = simulation:outcome(1)
  simulation:free()
  bodies:free()
  return outcome
end

-- Refuses to time a wrong result: every precision must end within `tolerance` metres of `double`,
-- and both integrators near each other.
local function check(materials, device)
  local reference = short_run(materials, ALL, "leapfrog", "double", device)
  assert(reference.status == "done" and reference.springs == 1940 and reference.masses == 216)
  for _, integrator in ipairs { "leapfrog", "symplectic_euler" } do
    for _, precision in ipairs { "single", "compensated", "double" } do
      local outcome = short_run(materials, ALL, integrator, precision, device)
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

-- A case for timing.best_rates: bodies that run on and on, a slice of `seconds` at a time.
local function endless(materials, scene, row, device, count, seconds)
  local bodies = full_bodies(materials, count)
  local simulation = engine.simulation(bodies, materials, engine.scene(scene),
    options(row.integrator, row.precision, 1e5), device)
  bodies:free()
  simulation:advance(0.02)
  local before = simulation:advance(0.02).spring_steps
  return {
    run = function()
      local progress = simulation:advance(seconds)
      local done = progress.spring_steps - before
      before = progress.spring_steps
      return done
    end,
  }
end

local function without(name)
  local scene = {}
  for _, effect in ipairs(EFFECTS) do scene[effect] = effect ~= name or nil end
  -- friction acts where something touches
  if name == "ground" then scene.friction = nil end
  return scene
end

-- What `limax run walk.lua` costs: the seconds of a generation as the quickstart has them, and the
-- memory of a large population.
local function whole_runs(how, threads, rows)
  local walk = host.home .. "/scripts/experiments/walk.lua"
  local runs = { { generations = 5, robots = 30 } }
  if how.full then runs[2] = { generations = 1, robots = 1000 } end
  how.say ""
  for _, size in ipairs(runs) do
    local words = { "--device", how.device, "--set", "generations=" .. size.generations,
      "--set", "population=" .. size.robots, "--set", "lattice=[5,5,5]",
      "--threads", tostring(threads) }
    local cost = child.run(walk, words)
    local row = { effects = "limax run walk.lua", threads = threads, robots = size.robots,
      generations = size.generations,
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
---@field device string
---@field threads integer|nil
---@field seconds number of one repeat of one measurement
---@field full boolean|nil also the memory of a large population
---@field say fun(text: string)

---@param how limax.bench_how
---@return limax.bench_result
function throughput.run(how)
  local materials = engine.materials "paper"
  local one = engine.device(how.device, { threads = 1 })
  local about = one:describe()
  how.say(("%s, %s passes; full 5x5x5 voxels: 216 masses, 1940 springs; time step %g s"):format(
    about.cpu, about.isa, TIME_STEP))
  check(materials, one)
  how.say "checked: every precision and integrator ends where leapfrog double does"

  local rows, cases = {}, {}
  local function add(row, scene, device, count)
    row.robots = count
    rows[#rows + 1] = row
    cases[#cases + 1] = endless(materials, scene, row, device, count, how.seconds)
  end
  for _, integrator in ipairs { "symplectic_euler", "leapfrog" } do
    for _, precision in ipairs { "single", "compensated", "double" } do
      add({ integrator = integrator, precision = precision, effects = "all", threads = 1 }, ALL,
        one, 1)
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
  local threads = how.threads or engine.device(how.device).threads
  local team = engine.device(how.device, { threads = threads })
  -- the same work for one thread and for all; enough robots that no thread waits for another
  add_default("all", ALL, one, 1, 8 * threads)
  add_default("all", ALL, team, threads, 8 * threads)

  local rates = timing.best_rates(cases, ROUNDS)
  local default = rates[5]
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
  how.say(("of symplectic Euler single: the default (leapfrog, compensated) %.2f, double %.2f")
    :format(rates[5] / rates[1], rates[3] / rates[1]))
  how.say(("%d threads against one, %d robots each: %.2f"):format(threads, 8 * threads,
    rates[#rates] / rates[#rates - 1]))
  whole_runs(how, threads, rows)
  return {
    columns = { "integrator", "precision", "effects", "threads", "robots", "springs_per_second",
      "relative_to_default", "generations", "seconds_per_generation", "peak_bytes" },
    rows = rows,
  }
end

return throughput
