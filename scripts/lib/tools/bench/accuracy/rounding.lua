--- rounding.lua: errors that rounding causes, by step: plain fp32, fp32 with compensated sums,
--- mixed and double, at the origin, 10 m and 1 km from it, and over a long distance at 1 m/s. An
--- actuated body in the air has no contact, so that its errors come only from the integrator and
--- rounding. SI units.

local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local host = require "limax.host"
local subjects = require "limax.tools.bench.accuracy.subjects"
local terminal = require "limax.base.terminal"
local trial = require "limax.tools.bench.accuracy.trial"

local rounding = {}

rounding.COLUMNS = { "integrator", "precision", "start", "way", "duration", "time_step", "bodies",
  "status", "error", "same_bits", "reference_error" }

-- m
local STARTS = { 0, 10, 1000 }

-- The integrator under which precisions differ most, and the paper's.
local METHODS = { { "leapfrog", "single" }, { "leapfrog", "compensated" }, { "leapfrog", "mixed" },
  { "leapfrog", "double" }, { "symplectic_euler", "single" } }

---@class limax.accuracy.rounding_size
---@field lattice integer[]
---@field duration number s
---@field steps number[] s
---@field reference number s
---@field distance number m, at 1 m/s
---@field moving_steps number[] s
---@field moving_reference number s
---@field moving_bodies integer after so many steps the rounding error of one is random

-- m/s: a good walker's
local WALK = 1

-- The subject starting at `start` m along x.
local function placed(options, start)
  local subject = subjects.get("air", options)
  subject.position = { start, 0, 0 }
  return subject
end

-- Positions relative to a start or a drift along x.
local function shifted(positions, distance)
  local own = {}
  for i, value in ipairs(positions) do own[i] = i % 3 == 1 and value - distance or value end
  return own
end

local function leapfrog(precision, time_step)
  return { integrator = "leapfrog", precision = precision, time_step = time_step }
end

-- Whether a body's motion has the same bits at a start of so many metres along x. Positions
-- relative to the start are exact if it is a power of two.
local function same_bits(subject, setting, start, device)
  local found = {}
  for k, x in ipairs { 0, start } do
    subject.position = { x, 0, 0 }
    local simulation = trial.simulation(subject, trial.options(subject, setting), device)
    simulation:run()
    found[k] = shifted(trial.positions(simulation), x)
    simulation:free "its bits were compared"
  end
  for i, value in ipairs(found[1]) do
    if value ~= found[2][i] then return false end
  end
  return true
end

-- Several bodies, at rest and moving: errors are the root mean square over the bodies.
local function long_distance(size, device, rows)
  local cases = {}
  local own = { lattice = size.lattice, count = 1, duration = size.distance / WALK }
  for _, precision in ipairs { "single", "compensated", "mixed" } do
    for _, time_step in ipairs(size.moving_steps) do
      for _, way in ipairs { 0, size.distance } do
        cases[#cases + 1] = { precision = precision, time_step = time_step, way = way, sum = 0,
          status = "done" }
      end
    end
  end
  local reference_sum = 0
  for number = 1, size.moving_bodies do
    own.number = number
    local subject = placed(own, 0)
    local reference = trial.reference(subject, size.moving_reference)
    reference_sum = reference_sum + reference.error ^ 2
    for _, case in ipairs(cases) do
      host.raise_if_interrupted()
      subject.velocity = { case.way / own.duration, 0, 0 }
      local got = trial.run(subject, leapfrog(case.precision, case.time_step), device)
      if got.positions then
        case.sum = case.sum + trial.rms(shifted(got.positions, case.way), reference.positions) ^ 2
      else
        case.status = got.status
      end
    end
  end
  for _, case in ipairs(cases) do
    rows[#rows + 1] = { integrator = "leapfrog", precision = case.precision, start = 0,
      way = case.way, duration = own.duration, time_step = case.time_step,
      bodies = size.moving_bodies, status = case.status,
      error = case.status == "done" and math.sqrt(case.sum / size.moving_bodies) or nil,
      reference_error = math.sqrt(reference_sum / size.moving_bodies) }
  end
end

---@param how { device: limax.device, size: limax.accuracy.rounding_size, say: fun(text: string) }
---@return { columns: string[], rows: table[] }
function rounding.run(how)
  local size, rows = how.size, {}
  local device = how.device.kind == "cpu" and engine.device("cpu", { threads = 1 }) or how.device
  local options = { lattice = size.lattice, count = 1, duration = size.duration }
  local reference = trial.reference(placed(options, 0), size.reference)
  how.say(("rounding: reference %s, its own error %.2g m"):format(reference.name, reference.error))
  for _, method in ipairs(METHODS) do
    for _, start in ipairs(STARTS) do
      local subject = placed(options, start)
      for _, time_step in ipairs(size.steps) do
        host.raise_if_interrupted()
        local got = trial.run(subject, { integrator = method[1], precision = method[2],
          time_step = time_step }, device)
        rows[#rows + 1] = { integrator = method[1], precision = method[2], start = start,
          way = 0, duration = size.duration, time_step = time_step, bodies = 1,
          status = got.status,
          error = got.positions and trial.rms(shifted(got.positions, start),
            reference.positions),
          reference_error = reference.error }
      end
    end
  end
  for _, precision in ipairs { "single", "compensated" } do
    local setting = leapfrog(precision, defaults.tiers.publish.time_step_most)
    rows[#rows + 1] = { integrator = "leapfrog", precision = precision, start = 1024, way = 0,
      duration = size.duration, time_step = setting.time_step, bodies = 1, status = "done",
      reference_error = reference.error,
      same_bits = same_bits(placed(options, 0), setting, 1024, device) }
  end
  long_distance(size, device, rows)
  return { columns = rounding.COLUMNS, rows = rows }
end

-- Where a row's body was.
local function place_of(row)
  if row.way > 0 then return ("moved %g m, %g s"):format(row.way, row.duration) end
  return ("%g m, %g s"):format(row.start, row.duration)
end

function rounding.text(result, style)
  local lines, head, columns, of_key, starts = {}, { "integrator", "precision", "at" }, {}, {}, {}
  for _, row in ipairs(result.rows) do
    if row.same_bits ~= nil then
      starts[#starts + 1] = ("%s: a start %g m away %s"):format(row.precision, row.start,
        row.same_bits and "changes no bit" or "changes bits")
    else
      local label, at = trial.LABELS[row.integrator], place_of(row)
      local key = label .. row.precision .. at
      if not of_key[key] then
        of_key[key] = { label, row.precision, at }
        lines[#lines + 1] = of_key[key]
      end
      if not columns[row.time_step] then
        head[#head + 1] = ("%g s"):format(row.time_step)
        columns[row.time_step] = #head
      end
      of_key[key][columns[row.time_step]] = row.error and ("%.1e"):format(row.error) or row.status
    end
  end
  return "error (m) by start and time step, an actuated body in the air\n"
    .. terminal.table(head, lines, style) .. "\n" .. table.concat(starts, "; ")
end

return rounding
