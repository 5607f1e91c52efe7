--- conservation.lua: what a body without damping and muscles must keep: its energy when it
--- vibrates, its energy and angular momentum when it spins freely. SI units.

local engine = require "limax.engine"
local host = require "limax.host"
local methods = require "limax.tools.bench.accuracy.methods"
local subjects = require "limax.tools.bench.accuracy.subjects"
local terminal = require "limax.base.terminal"
local trial = require "limax.tools.bench.accuracy.trial"

local conservation = {}

conservation.COLUMNS = { "scene", "integrator", "precision", "time_step", "steps", "status",
  "energy_drift", "momentum_drift" }

-- The paper's step; and steps over which the first and the last mean are taken.
local TIME_STEP, WINDOW = 1e-5, 2e4
-- Hz: an energy every 100 steps, 200 to a mean
local RATE = 1000
-- rad/s about z
local SPIN = 5

---@class limax.accuracy.conservation_size
---@field lattice integer[]
---@field vibration integer steps
---@field spin integer steps

-- Relative change of the energy between the first and the last window of steps.
local function energy_drift(simulation)
  local trace = simulation:trace(1, "energy")
  local samples, window = trace:size(), math.floor(WINDOW * TIME_STEP * RATE + 0.5)
  window = math.min(window, math.floor(samples / 2))
  local function mean(first)
    local sum = 0
    for k = first, first + window - 1 do sum = sum + trace[k][1] + trace[k][2] end
    return sum / window
  end
  local before, after = mean(1), mean(samples - window + 1)
  return (after - before) / before
end

-- Angular momentum about the centre of mass at a sample, over the mass of one site: the paper's
-- sites all weigh the same.
local function momentum(places, speeds)
  local center, drift, count = { 0, 0, 0 }, { 0, 0, 0 }, #places
  for m = 1, count do
    for axis = 1, 3 do
      center[axis] = center[axis] + places[m][axis] / count
      drift[axis] = drift[axis] + speeds[m][axis] / count
    end
  end
  local sum = { 0, 0, 0 }
  for m = 1, count do
    local r, v = {}, {}
    for axis = 1, 3 do
      r[axis], v[axis] = places[m][axis] - center[axis], speeds[m][axis] - drift[axis]
    end
    sum[1] = sum[1] + r[2] * v[3] - r[3] * v[2]
    sum[2] = sum[2] + r[3] * v[1] - r[1] * v[3]
    sum[3] = sum[3] + r[1] * v[2] - r[2] * v[1]
  end
  return sum
end

local function length(v) return math.sqrt(v[1] ^ 2 + v[2] ^ 2 + v[3] ^ 2) end

-- Relative change of the angular momentum between the first and the last sample.
local function momentum_drift(simulation)
  local places, speeds = simulation:trace(1, "position"), simulation:trace(1, "velocity")
  local last = places:size()
  local before = momentum(places[1]:table(), speeds[1]:table())
  local after = momentum(places[last]:table(), speeds[last]:table())
  local change = {}
  for axis = 1, 3 do change[axis] = after[axis] - before[axis] end
  return length(change) / length(before)
end

-- Every mass on its circle about the vertical axis through the body's middle.
local function spin(simulation, robot)
  local places = (simulation:state(robot)):table()
  local middle, velocities = { 0, 0 }, {}
  for _, p in ipairs(places) do
    middle[1], middle[2] = middle[1] + p[1] / #places, middle[2] + p[2] / #places
  end
  for m, p in ipairs(places) do
    velocities[m] = { -SPIN * (p[2] - middle[2]), SPIN * (p[1] - middle[1]), 0 }
  end
  simulation:place(robot, nil, velocities)
end

local function subject_of(scene, size, materials)
  local subject = subjects.get("free",
    { materials = materials, lattice = size.lattice, count = 1 })
  subject.scene = engine.scene {}
  local steps = size.vibration
  if scene == "spin" then subject.place, steps = spin, size.spin end
  subject.duration = steps * TIME_STEP
  return subject, steps
end

--- Measures every method in both scenes.
---@param how { device: limax.device, size: limax.accuracy.conservation_size,
--- say: fun(text: string) }
---@return { columns: string[], rows: table[] }
function conservation.run(how)
  local materials, rows = engine.materials "paper", {}
  local device = how.device.kind == "cpu" and engine.device("cpu", { threads = 1 }) or how.device
  for _, scene in ipairs { "vibration", "spin" } do
    local subject, steps = subject_of(scene, how.size, materials)
    how.say(("%s: %g steps of %g s without damping"):format(scene, steps, TIME_STEP))
    for _, integrator in ipairs(methods.INTEGRATORS) do
      for _, precision in ipairs(methods.PRECISIONS) do
        host.raise_if_interrupted()
        local row = { scene = scene, integrator = integrator, precision = precision,
          time_step = TIME_STEP, steps = steps }
        local record = { energy = RATE }
        -- two samples of every mass would do; 20 Hz is the least rate
        if scene == "spin" then record.position, record.velocity = 20, 20 end
        local options = trial.options(subject, row, record)
        local refused = not methods.in_build(integrator) and "not in this build"
          or methods.refusal(subject, options, device)
        if refused then
          row.status = "refused: " .. refused
        else
          local simulation = trial.simulation(subject, options, device)
          simulation:run()
          row.status = simulation:outcome(1).status
          if row.status == "done" then
            row.energy_drift = energy_drift(simulation)
            if scene == "spin" then row.momentum_drift = momentum_drift(simulation) end
          end
          simulation:free "what it kept was known"
        end
        rows[#rows + 1] = row
      end
    end
  end
  return { columns = conservation.COLUMNS, rows = rows }
end

--- The rows as a table for people.
---@param result { rows: table[] }
---@param style limax.terminal.style
---@return string
function conservation.text(result, style)
  local lines = {}
  for k, row in ipairs(result.rows) do
    local function shown(value) return value and ("%.1e"):format(value) or "-" end
    lines[k] = { row.scene, methods.LABELS[row.integrator], row.precision, row.steps,
      row.energy_drift and shown(row.energy_drift) or row.status, shown(row.momentum_drift) }
  end
  return ("relative drift without damping, steps of %g s; energies are means over %g steps\n")
    :format(TIME_STEP, WINDOW) .. terminal.table({ "scene", "integrator", "precision", "steps",
    "energy", "angular momentum" }, lines, style)
end

return conservation
