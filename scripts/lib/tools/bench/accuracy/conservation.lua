--- conservation.lua: the drift of the energy of a body without damping and muscles that vibrates,
--- and of the energy and angular momentum of one that spins freely. SI units.

local engine = require "limax.engine"
local host = require "limax.host"
local invariants = require "limax.tools.bench.hard_cases.invariants"
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

-- Relative change of the energy between the first and the last window of steps.
local function energy_drift(simulation)
  local trace = simulation:trace(1, "energy")
  local samples = trace:size()
  local window = math.min(math.floor(WINDOW * TIME_STEP * RATE + 0.5), math.floor(samples / 2))
  local function mean(first)
    local sum = 0
    for k = first, first + window - 1 do sum = sum + trace[k][1] + trace[k][2] end
    return sum / window
  end
  local before, after = mean(1), mean(samples - window + 1)
  return (after - before) / before
end

-- Relative change of the angular momentum between the first and the last sample. The paper's sites
-- all have the same mass.
local function momentum_drift(simulation)
  local positions, velocities = simulation:trace(1, "position"), simulation:trace(1, "velocity")
  local function spin_at(sample)
    return invariants.motion(positions[sample]:table(), velocities[sample]:table()).spin
  end
  local before, after = spin_at(1), spin_at(positions:size())
  local change, size = 0, 0
  for axis = 1, 3 do
    change, size = change + (after[axis] - before[axis]) ^ 2, size + before[axis] ^ 2
  end
  return math.sqrt(change / size)
end

-- Rotation about the vertical axis through the body's centre.
local function spin(simulation, robot)
  local positions, velocities = simulation:state(robot)
  positions, velocities = positions:table(), velocities:table()
  local center = invariants.motion(positions, velocities).center
  for m, p in ipairs(positions) do
    velocities[m] = { -SPIN * (p[2] - center[2]), SPIN * (p[1] - center[1]), 0 }
  end
  simulation:place(robot, nil, velocities)
end

-- Sets the status and the drifts of a row.
local function measure(row, subject, device)
  local spins = row.scene == "spin"
  -- the first and the last sample are used; 20 Hz is the least rate
  local options = trial.options(subject, row,
    { energy = RATE, position = spins and 20 or nil, velocity = spins and 20 or nil })
  local refused = trial.refusal(subject, options, device)
  if refused then
    row.status = "refused: " .. refused
    return
  end
  local simulation = trial.simulation(subject, options, device)
  simulation:run()
  row.status = simulation:outcome(1).status
  if row.status == "done" then
    row.energy_drift = energy_drift(simulation)
    row.momentum_drift = spins and momentum_drift(simulation) or nil
  end
  simulation:free "its drift was measured"
end

function conservation.run(how)
  local rows, device = {}, trial.one_thread(how.device)
  for _, scene in ipairs { "vibration", "spin" } do
    local subject = subjects.get("free", { lattice = how.size.lattice, count = 1 })
    local steps = how.size[scene]
    subject.scene, subject.duration = engine.scene {}, steps * TIME_STEP
    if scene == "spin" then subject.place = spin end
    how.say(("%s: %g steps of %g s without damping"):format(scene, steps, TIME_STEP))
    for _, integrator in ipairs(trial.INTEGRATORS) do
      for _, precision in ipairs(trial.PRECISIONS) do
        host.raise_if_interrupted()
        local row = { scene = scene, integrator = integrator, precision = precision,
          time_step = TIME_STEP, steps = steps }
        measure(row, subject, device)
        rows[#rows + 1] = row
      end
    end
  end
  return { columns = conservation.COLUMNS, rows = rows }
end

function conservation.text(result, style)
  return ("relative drift without damping, steps of %g s; energies are means over %g steps\n")
    :format(TIME_STEP, WINDOW) .. terminal.rows({ { "scene" },
    { "integrator", function(row) return trial.LABELS[row.integrator] end }, { "precision" },
    { "steps" }, { "status" }, { "energy", "energy_drift", "%.1e" },
    { "angular momentum", "momentum_drift", "%.1e" } }, result.rows, style)
end

return conservation
