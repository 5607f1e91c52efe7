--- rounding.lua: errors that rounding causes, by step: plain fp32, fp32 with compensated sums,
--- mixed and double, at the origin, 10 m and 1 km from it, and over a long distance at 1 m/s. An
--- actuated body in the air has no contact, so that its errors come only from the integrator and
--- rounding. SI units.

local defaults = require "limax.settings.defaults"
local host = require "limax.host"
local subjects = require "limax.tools.bench.accuracy.subjects"
local trial = require "limax.tools.bench.accuracy.trial"

local rounding = {}

rounding.COLUMNS = { "integrator", "precision", "start", "way", "duration", "time_step", "bodies",
  "status", "error", "same_bits", "reference_error" }

-- m
local STARTS = { 0, 10, 1000 }

-- The integrator under which precisions differ most, and the paper's.
local METHODS = { { "leapfrog", "single" }, { "leapfrog", "compensated" }, { "leapfrog", "mixed" },
  { "leapfrog", "double" }, { "symplectic_euler", "single" } }

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
local function same_bits(options, setting, start, device)
  local near = trial.run(placed(options, 0), setting, device).positions
  local far = trial.run(placed(options, start), setting, device).positions
  return trial.rms(near, shifted(far, start)) == 0
end

-- Several bodies, at rest and moving: errors are the root mean square over the bodies, since after
-- so many steps the rounding error of one is random.
local function long_distance(size, device, rows)
  local own = { lattice = size.lattice, count = 1, duration = size.distance / WALK }
  local first = #rows + 1
  for _, precision in ipairs { "single", "compensated", "mixed" } do
    for _, time_step in ipairs(size.moving_steps) do
      for _, way in ipairs { 0, size.distance } do
        rows[#rows + 1] = { integrator = "leapfrog", precision = precision, start = 0, way = way,
          duration = own.duration, time_step = time_step, bodies = size.moving_bodies,
          status = "done", error = 0, reference_error = 0 }
      end
    end
  end
  -- mean squares until all bodies have been simulated
  for number = 1, size.moving_bodies do
    own.number = number
    local subject = placed(own, 0)
    local reference = trial.reference(subject, size.moving_reference)
    for k = first, #rows do
      host.raise_if_interrupted()
      local row = rows[k]
      subject.velocity = { row.way / own.duration, 0, 0 }
      local got = trial.run(subject, row, device)
      row.reference_error = row.reference_error + reference.error ^ 2 / row.bodies
      if got.positions and row.error then
        row.error = row.error
          + trial.rms(shifted(got.positions, row.way), reference.positions) ^ 2 / row.bodies
      else
        row.status, row.error = row.error and got.status or row.status, nil
      end
    end
  end
  for k = first, #rows do
    rows[k].error = rows[k].error and math.sqrt(rows[k].error)
    rows[k].reference_error = math.sqrt(rows[k].reference_error)
  end
end

function rounding.run(how)
  local size, rows, device = how.size, {}, trial.one_thread(how.device)
  local options = { lattice = size.lattice, count = 1, duration = size.duration }
  local reference = trial.reference(placed(options, 0), size.reference)
  how.say(("rounding: reference %s, its own error %.2g m"):format(reference.name, reference.error))
  local function add(row)
    row.way, row.duration, row.bodies, row.reference_error = 0, size.duration, 1, reference.error
    rows[#rows + 1] = row
  end
  for _, method in ipairs(METHODS) do
    for _, start in ipairs(STARTS) do
      local subject = placed(options, start)
      for _, time_step in ipairs(size.steps) do
        host.raise_if_interrupted()
        local row = { integrator = method[1], precision = method[2], start = start,
          time_step = time_step }
        local got = trial.run(subject, row, device)
        row.status = got.status
        row.error = got.positions
          and trial.rms(shifted(got.positions, start), reference.positions)
        add(row)
      end
    end
  end
  for _, precision in ipairs { "single", "compensated" } do
    local row = leapfrog(precision, defaults.tiers.publish.time_step_most)
    row.start, row.status = 1024, "done"
    row.same_bits = same_bits(options, row, row.start, device)
    add(row)
  end
  long_distance(size, device, rows)
  return { columns = rounding.COLUMNS, rows = rows }
end

function rounding.text(result, style)
  local errors, starts = {}, {}
  for _, row in ipairs(result.rows) do
    if row.same_bits == nil then
      errors[#errors + 1] = row
    else
      starts[#starts + 1] = ("%s: a start %g m away %s"):format(row.precision, row.start,
        row.same_bits and "changes no bit" or "changes bits")
    end
  end
  return "error (m) by start and time step, an actuated body in the air\n"
    .. trial.by_step({ "integrator", "precision", "at" }, errors, function(row)
      return { trial.LABELS[row.integrator], row.precision,
        (row.way > 0 and "moved %g m, %g s" or "%g m, %g s"):format(
          row.way > 0 and row.way or row.start, row.duration) }
    end, style) .. "\n" .. table.concat(starts, "; ")
end

return rounding
