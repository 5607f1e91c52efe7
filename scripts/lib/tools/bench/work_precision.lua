--- work_precision.lua: `limax bench work_precision`: the error of the masses' final positions and
--- its price, for each integrator, precision and time step, and for the tiers. SI units.

local bodies = require "limax.tools.bench.bodies"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local scenes = require "limax.scenes"
local terminal = require "limax.base.terminal"
local tiers = require "limax.settings.tiers"

local work_precision = {}

local LATTICE = { 4, 4, 4 }
-- s: some periods of the free body's slowest mode; the fall from 0.1 m takes 0.14 s
local DURATION = 0.4
-- s: on both sides of the paper's 1e-5; the first is too long for stiff bodies
local STEPS = { 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5 }
-- s, of references: RK4 where it exists, whose error falls with the fourth power of the step
local RK4_STEP, LEAPFROG_STEP = 5e-6, 2e-6
-- of a setting: the best of so many runs
local RUNS = 2
-- m/s across the body: strains of some per cent, as of muscles
local SHAKEN = 0.5

-- Velocities that stretch, bend and twist at once, with almost no momentum.
local function shake(simulation)
  local velocities, edges = {}, LATTICE[1]
  local positions = (simulation:state(1)):table()
  for mass, p in ipairs(positions) do
    local u = {}
    for axis = 1, 3 do u[axis] = (p[axis] - positions[1][axis]) / (0.1 * edges) - 0.5 end
    velocities[mass] = { SHAKEN * (u[1] + u[3] * u[3] - 1 / 12), SHAKEN * u[3] * u[1],
      -SHAKEN * (u[3] + u[1] * u[2]) }
  end
  for robot = 1, simulation.count do simulation:place(robot, nil, velocities) end
end

local SCENES = {
  { name = "free body, vibrating", smooth = true, place = shake,
    scene = function() return { damping = true } end },
  { name = "muscles in the air", smooth = true,
    scene = function() return scenes.air { gravity = false } end },
  { name = "drop from 0.1 m", position = { 0, 0, 0.1 },
    scene = function() return scenes.land { actuation = false } end },
}

-- Final positions of robot 1, flat, m; the time of one robot and one simulated second, s; and the
-- outcome. nil and why where the engine refuses the setting.
local function simulate(subject, setting, count, device, runs)
  local materials = engine.materials "paper"
  local population = bodies.population(materials, LATTICE, count)
  local options = { integrator = setting.integrator, precision = setting.precision,
    time_step = setting.time_step, bound = setting.bound, bound_fraction = setting.bound_fraction,
    time_step_most = setting.time_step_most, duration = DURATION, settle = 0,
    position = subject.position }
  local least, simulation, outcome = math.huge, nil, nil
  for _ = 1, runs do
    local fine, made = failure.attempt(engine.simulation, population, materials,
      engine.scene(subject.scene()), options, device)
    if not fine and failure.of_machine(made) then error(made, 0) end
    if not fine then return nil, (failure.bare(made):gsub("^simulation: ", "")) end
    simulation = made
    if subject.place then subject.place(simulation) end
    simulation:describe() -- kernels and springs are not timed
    local began = host.clock()
    simulation:run()
    least, outcome = math.min(least, host.clock() - began), simulation:outcome(1)
    host.raise_if_interrupted()
  end
  local flat = {}
  for _, row in ipairs((simulation:state(1)):table()) do
    for axis = 1, 3 do flat[#flat + 1] = row[axis] end
  end
  return flat, least / count / DURATION, outcome
end

-- Root mean square distance between masses, m.
local function distance(a, b)
  local sum = 0
  for i = 1, #a do sum = sum + (a[i] - b[i]) ^ 2 end
  return math.sqrt(sum / (#a / 3))
end

-- Adds the rows of a scene.
local function measure(rows, subject, count, device)
  local cpu = engine.device("cpu", { threads = 1 })
  local reference = simulate(subject, { integrator = subject.smooth and "rk4" or "leapfrog",
    precision = "double", time_step = subject.smooth and RK4_STEP or LEAPFROG_STEP }, 1, cpu, 1)
  local function try(setting, tier)
    local positions, seconds, outcome = simulate(subject, setting, count, device, RUNS)
    local row = { scene = subject.name, tier = tier, integrator = setting.integrator,
      precision = setting.precision, status = outcome and outcome.status or "refused",
      time_step = outcome and outcome.time_step or setting.time_step }
    if row.status == "done" then
      row.error, row.seconds_per_second = distance(positions, reference), seconds
    elseif not outcome then
      row.reason = seconds
    end
    rows[#rows + 1] = row
    return row.status
  end
  for _, integrator in ipairs(engine.names.integrator.names) do
    for _, precision in ipairs { "single", "compensated", "double" } do
      for _, time_step in ipairs(STEPS) do
        -- what is refused at one step is refused at all
        if try { integrator = integrator, precision = precision, time_step = time_step }
          == "refused" then break end
      end
    end
  end
  for _, tier in ipairs(tiers.NAMES) do try(defaults.tiers[tier], tier) end
end

---@param how { device: limax.device, say: fun(text: string) }
function work_precision.run(how)
  local on_cpu = how.device.kind == "cpu"
  -- one body on one thread, so that times are comparable; many on a GPU
  local device = on_cpu and engine.device("cpu", { threads = 1 }) or how.device
  local rows = {}
  for _, subject in ipairs(SCENES) do
    how.say(subject.name)
    measure(rows, subject, on_cpu and 1 or 264, device)
  end
  how.say(terminal.rows({ { "scene" }, { "tier" }, { "integrator" }, { "precision" },
    { "time step, s", "time_step" },
    { "error, m", function(row)
      return row.error and ("%.1e"):format(row.error) or row.status
    end },
    { "wall s per simulated s", "seconds_per_second" } }, rows, terminal.style {}))
  return { columns = { "scene", "tier", "integrator", "precision", "time_step", "status", "reason",
    "error", "seconds_per_second" }, rows = rows }
end

return work_precision
