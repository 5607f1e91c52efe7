--- trial.lua: simulates a body under one setting: final positions of its masses, wall time, and
--- whether it failed. Also the reference of a body, and the names of integrators and precisions.
--- Wall time is the least of several runs, without creating kernels and springs. SI units.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local terminal = require "limax.base.terminal"

local trial = {}

trial.INTEGRATORS = engine.names.integrator.names
trial.PRECISIONS = { "single", "compensated", "mixed", "double" }

--- Names for people.
trial.LABELS = { symplectic_euler = "symplectic Euler", leapfrog = "leapfrog", rk4 = "RK4",
  xpbd = "XPBD" }

--- The paper's setting. The paper names no integrator and no precision; its step is 1e-5 s.
trial.PAPER = { integrator = "symplectic_euler", precision = "single", time_step = 1e-5 }

---@class limax.accuracy.subject what is simulated
---@field name string
---@field smooth boolean|nil no contact
---@field population limax.population equal bodies; robot 1 is measured
---@field materials limax.materials
---@field scene limax.scene
---@field duration number s
---@field settle number s
---@field position number[]|nil m
---@field place fun(simulation: limax.simulation, robot: integer)|nil places a robot's masses

--- The finest setting: leapfrog in double.
---@param time_step number s
function trial.finest(time_step)
  return { integrator = "leapfrog", precision = "double", time_step = time_step }
end

--- The device for timing one robot: one thread of a CPU, so that times are comparable.
function trial.one_thread(device)
  return device.kind == "cpu" and engine.device("cpu", { threads = 1 }) or device
end

--- Why the engine refuses a simulation with these options; nil if it does not.
---@param subject { population: limax.population, materials: limax.materials, scene: limax.scene }
function trial.refusal(subject, options, device)
  local fine, value = failure.attempt(engine.simulation, subject.population, subject.materials,
    subject.scene, options, device)
  if fine then
    value:free "its options were only checked"
    return nil
  end
  if failure.of_machine(value) then error(value, 0) end
  local message = failure.bare(value)
  return message:match "simulation: (.*)$" or message
end

--- Options of a subject under a setting: integrator, precision, time_step, bound, bound_fraction,
--- time_step_most.
function trial.options(subject, setting)
  return { integrator = setting.integrator, precision = setting.precision,
    time_step = setting.time_step, bound = setting.bound,
    bound_fraction = setting.bound_fraction, time_step_most = setting.time_step_most,
    duration = subject.duration, settle = subject.settle, position = subject.position }
end

--- A simulation of a subject, every robot placed.
function trial.simulation(subject, options, device)
  local simulation =
    engine.simulation(subject.population, subject.materials, subject.scene, options, device)
  if subject.place then
    for robot = 1, subject.population.count do subject.place(simulation, robot) end
  end
  -- creates kernels and springs, which are not timed
  simulation:describe()
  return simulation
end

--- Positions of the masses of robot 1, flat, m.
function trial.positions(simulation)
  local flat = {}
  for _, row in ipairs((simulation:state(1)):table()) do
    for axis = 1, 3 do flat[#flat + 1] = row[axis] end
  end
  return flat
end

--- Root mean square distance between masses, m.
function trial.rms(a, b)
  local sum = 0
  for i = 1, #a do sum = sum + (a[i] - b[i]) ^ 2 end
  return math.sqrt(sum / (#a / 3))
end

--- Simulates a subject under a setting: at least two runs, then more until `effort` is spent.
---@param effort { seconds: number, runs: integer }|nil wall time and runs at most; one run if left
--- out
---@return { status: string, reason: string|nil, positions: number[]|nil, seconds: number|nil,
--- time_step: number|nil, runs: integer|nil } `positions` at the end, flat, m; `seconds`: least
--- wall time of one robot and one simulated second, s
function trial.run(subject, setting, device, effort)
  local options = trial.options(subject, setting)
  local refused = trial.refusal(subject, options, device)
  if refused then return { status = "refused", reason = refused } end
  local result = { runs = 0 }
  local least, spent = math.huge, 0
  repeat
    local simulation = trial.simulation(subject, options, device)
    local began = host.clock()
    simulation:run()
    local seconds = host.clock() - began
    least, spent, result.runs = math.min(least, seconds), spent + seconds, result.runs + 1
    local outcome = simulation:outcome(1)
    result.status, result.reason = outcome.status, outcome.reason
    result.time_step = outcome.time_step
    if outcome.status == "done" then result.positions = trial.positions(simulation) end
    simulation:free "its trial was over"
  until result.status ~= "done" or not effort or result.runs >= effort.runs
    or result.runs >= 2 and spent >= effort.seconds
  if result.status == "done" then
    result.seconds = least / subject.population.count / (subject.duration + subject.settle)
  end
  return result
end

-- s: RK4's error falls with the fourth power of the step, so that the paper's step is enough.
local RK4_STEP = 1e-5

--- The reference of a subject: RK4 in double without contact, else leapfrog in double.
---@param time_step number s, of leapfrog
---@return { positions: number[], error: number, name: string } `error`: its distance from itself at
--- twice the step, m
function trial.reference(subject, time_step)
  local device = engine.device("cpu", { threads = 1 })
  local integrator = subject.smooth and "rk4" or "leapfrog"
  if subject.smooth then time_step = math.max(RK4_STEP, time_step) end
  local function run(step)
    local result = trial.run(subject,
      { integrator = integrator, precision = "double", time_step = step }, device)
    if result.status ~= "done" then
      error(("%s: the reference is %s: %s"):format(subject.name, result.status,
        tostring(result.reason)), 0)
    end
    return result.positions
  end
  local fine = run(time_step)
  return { positions = fine, error = trial.rms(fine, run(2 * time_step)),
    name = ("%s double %g s"):format(trial.LABELS[integrator], time_step) }
end

--- A table of errors with a line for each `words(row)` and a column for each time step.
---@param words fun(row: table): string[]
function trial.by_step(head, rows, words, style)
  local lines, columns = {}, {}
  head = { unpack(head) }
  for _, row in ipairs(rows) do
    local own = words(row)
    local key = table.concat(own, ", ")
    if not columns[row.time_step] then
      head[#head + 1] = ("%g s"):format(row.time_step)
      columns[row.time_step] = #head
    end
    if not lines[key] then
      lines[key], lines[#lines + 1] = own, own
    end
    lines[key][columns[row.time_step]] = row.error and ("%.1e"):format(row.error) or row.status
  end
  return terminal.table(head, lines, style)
end

return trial
