--- work_precision.lua: the error of the masses' final positions against wall time, a curve for each
--- integrator and precision. Failed runs stay in the rows. SI units.

local defaults = require "limax.settings.defaults"
local host = require "limax.host"
local subjects = require "limax.tools.bench.accuracy.subjects"
local terminal = require "limax.base.terminal"
local tiers = require "limax.settings.tiers"
local trial = require "limax.tools.bench.accuracy.trial"

local work_precision = {}

work_precision.COLUMNS = { "scene", "tier", "integrator", "precision", "time_step", "status",
  "reason", "error", "seconds_per_second", "runs", "reference", "reference_error" }

---@param how { device: limax.device, size: table, scenes: string[]|nil, say: fun(text: string) }
---@return { columns: string[], rows: table[], where: string } `where`: what was timed
function work_precision.run(how)
  local rows, device, size = {}, trial.one_thread(how.device), how.size
  -- one robot on one thread; many on a GPU
  local count = device.kind == "cpu" and 1 or 264
  for _, name in ipairs(how.scenes or subjects.NAMES) do
    local options = { lattice = size.lattice, count = count, duration = size.duration }
    local subject = subjects.get(name, options)
    options.count = 1
    local reference = trial.reference(subjects.get(name, options), size.reference)
    how.say(("%s: reference %s, its own error %.2g m"):format(subjects.TITLES[name],
      reference.name, reference.error))
    local function try(setting, tier)
      host.raise_if_interrupted()
      local got = trial.run(subject, setting, device, size.effort)
      rows[#rows + 1] = { scene = name, tier = tier, integrator = setting.integrator,
        precision = setting.precision, time_step = tier and got.time_step or setting.time_step,
        status = got.status, reason = got.reason, seconds_per_second = got.seconds,
        runs = got.runs, error = got.positions and trial.rms(got.positions, reference.positions),
        reference = reference.name, reference_error = reference.error }
      return got.status
    end
    for _, integrator in ipairs(trial.INTEGRATORS) do
      for _, precision in ipairs(trial.PRECISIONS) do
        for _, time_step in ipairs(size.steps) do
          local status = try { integrator = integrator, precision = precision,
            time_step = time_step }
          -- it would be refused at every step
          if status == "refused" then break end
        end
      end
    end
    -- each tier by its own rule for the step
    for _, tier in ipairs(tiers.NAMES) do try(defaults.tiers[tier], tier) end
  end
  local where = count == 1 and "one body on one thread"
    or ("one of %d bodies on a GPU"):format(count)
  return { columns = work_precision.COLUMNS, rows = rows, where = where }
end

function work_precision.text(result, style)
  local methods, of_tiers, notes = {}, {}, {}
  for _, row in ipairs(result.rows) do
    table.insert(row.tier and of_tiers or methods, row)
    if row.status == "refused" then
      local note = ("%s in %s: %s"):format(trial.LABELS[row.integrator], row.scene, row.reason)
      if notes[#notes] ~= note then notes[#notes + 1] = note end
    end
  end
  return "error of the masses' positions at the end (m, root mean square), by time step\n"
    .. trial.by_step({ "scene", "integrator", "precision" }, methods, function(row)
      return { row.scene, trial.LABELS[row.integrator], row.precision }
    end, style) .. "\n" .. table.concat(notes, "\n") .. "\n\n"
    .. terminal.rows({ { "scene" }, { "tier" }, { "time step, s", "time_step" },
      { "error, m", function(row)
        return row.error and ("%.1e"):format(row.error) or row.status
      end },
      { "wall s per simulated s", "seconds_per_second" } }, of_tiers, style)
end

return work_precision
