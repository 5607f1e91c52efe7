--- work_precision.lua: the error of the masses' final positions against wall time, a curve for each
--- integrator and precision. Failed runs stay in the rows. SI units.

local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local host = require "limax.host"
local subjects = require "limax.tools.bench.accuracy.subjects"
local terminal = require "limax.base.terminal"
local tiers = require "limax.settings.tiers"
local trial = require "limax.tools.bench.accuracy.trial"

local work_precision = {}

work_precision.COLUMNS = { "scene", "tier", "integrator", "precision", "time_step", "status",
  "reason", "error", "seconds_per_second", "runs", "reference", "reference_error" }

---@class limax.accuracy.size how much a section does
---@field lattice integer[]
---@field duration number|nil s; the subjects' own if left out
---@field steps number[] time steps, s, longest first
---@field reference number s, the step of a reference in leapfrog, double
---@field effort { seconds: number, runs: integer }

-- All steps of one method in one scene.
local function curve(subject, method, reference, size, device, rows)
  for _, time_step in ipairs(size.steps) do
    host.raise_if_interrupted()
    local row = { scene = subject.name, integrator = method.integrator,
      precision = method.precision, time_step = time_step, reference = reference.name,
      reference_error = reference.error }
    local got = trial.run(subject, { integrator = method.integrator,
      precision = method.precision, time_step = time_step }, device, size.effort)
    row.status, row.reason = got.status, got.reason
    row.seconds_per_second, row.runs = got.seconds, got.runs
    if got.positions then row.error = trial.rms(got.positions, reference.positions) end
    rows[#rows + 1] = row
    -- refused at every step
    if got.status == "refused" then return end
  end
end

-- The named tiers, each by its own rule for the step.
local function try_tiers(subject, reference, size, device, rows)
  for _, name in ipairs(tiers.NAMES) do
    host.raise_if_interrupted()
    local got = trial.run(subject, defaults.tiers[name], device, size.effort)
    rows[#rows + 1] = { scene = subject.name, tier = name,
      integrator = defaults.tiers[name].integrator, precision = defaults.tiers[name].precision,
      time_step = got.time_step, status = got.status, reason = got.reason,
      error = got.positions and trial.rms(got.positions, reference.positions),
      seconds_per_second = got.seconds, runs = got.runs, reference = reference.name,
      reference_error = reference.error }
  end
end

---@param how { device: limax.device, size: limax.accuracy.size, scenes: string[]|nil,
--- say: fun(text: string) }
---@return { columns: string[], rows: table[], where: string } `where`: what was timed
function work_precision.run(how)
  local rows = {}
  local device = how.device.kind == "cpu" and engine.device("cpu", { threads = 1 }) or how.device
  -- one robot on one thread; many on a GPU
  local count = device.kind == "cpu" and 1 or how.size.robots or 264
  for _, name in ipairs(how.scenes or subjects.NAMES) do
    local function subject_of(bodies)
      return subjects.get(name, { lattice = how.size.lattice, count = bodies,
        duration = how.size.duration })
    end
    local subject = subject_of(count)
    local reference = trial.reference(subject_of(1), how.size.reference)
    how.say(("%s: reference %s, its own error %.2g m"):format(subjects.TITLES[name],
      reference.name, reference.error))
    for _, integrator in ipairs(trial.INTEGRATORS) do
      for _, precision in ipairs(trial.PRECISIONS) do
        curve(subject, { integrator = integrator, precision = precision }, reference, how.size,
          device, rows)
      end
    end
    try_tiers(subject, reference, how.size, device, rows)
  end
  local where = count == 1 and "one body on one thread"
    or ("one of %d bodies on a GPU"):format(count)
  return { columns = work_precision.COLUMNS, rows = rows, where = where }
end

-- A line per scene and method, the steps side by side.
function work_precision.text(result, style)
  local lines, steps, head = {}, {}, { "scene", "integrator", "precision" }
  for _, row in ipairs(result.rows) do
    if row.time_step and not row.tier and not steps[row.time_step] then
      head[#head + 1] = ("%g s"):format(row.time_step)
      steps[row.time_step] = #head
    end
  end
  local line
  local tier_rows, notes = {}, {}
  for _, row in ipairs(result.rows) do
    local label = trial.LABELS[row.integrator]
    if row.tier then
      tier_rows[#tier_rows + 1] = { row.scene, row.tier, row.time_step or "-",
        row.error and ("%.1e"):format(row.error) or row.status, row.seconds_per_second or "-" }
      goto continue
    end
    if not line or line[1] ~= row.scene or line[2] ~= label or line[3] ~= row.precision then
      line = { row.scene, label, row.precision }
      lines[#lines + 1] = line
    end
    if row.status ~= "refused" then
      line[steps[row.time_step]] = row.error and ("%.1e"):format(row.error) or row.status
    end
    if row.status == "refused" then
      line[4] = "refused"
      local note = ("%s in %s: %s"):format(label, row.scene, row.reason)
      if notes[#notes] ~= note then notes[#notes + 1] = note end
    end
    ::continue::
  end
  for _, each in ipairs(lines) do
    for c = 4, #head do each[c] = each[c] or "" end
  end
  return "error of the masses' places at the end (m, root mean square), by time step\n"
    .. terminal.table(head, lines, style) .. "\n" .. table.concat(notes, "\n")
    .. "\n\n" .. terminal.table({ "scene", "tier", "time step, s", "error, m",
      "wall s per simulated s" }, tier_rows, style)
end

return work_precision
