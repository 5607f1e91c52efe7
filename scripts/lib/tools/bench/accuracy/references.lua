--- references.lua: the positions that errors are measured from, and how far they can be trusted:
--- RK4 in double on smooth scenes, where the engine has it, else leapfrog in double. SI units.

local methods = require "limax.tools.bench.accuracy.methods"
local subjects = require "limax.tools.bench.accuracy.subjects"
local trial = require "limax.tools.bench.accuracy.trial"

local references = {}

-- s: RK4's error falls with the fourth power of the step, so that its reference needs no shorter
-- one than the paper's.
local RK4_STEP = 1e-5

---@class limax.accuracy.reference
---@field positions number[] of all masses at the end, m, flat
---@field error number m, its distance from itself at twice the step
---@field name string

--- The reference of a subject.
---@param subject limax.accuracy.subject
---@param time_step number s, of leapfrog
---@param device limax.device
---@return limax.accuracy.reference
function references.of(subject, time_step, device)
  local setting = { integrator = "leapfrog", precision = "double", time_step = time_step }
  local finest = { integrator = "rk4", precision = "double",
    time_step = math.max(RK4_STEP, time_step) }
  if subjects.SMOOTH[subject.name] and methods.in_build "rk4"
    and not methods.refusal(subject, trial.options(subject, finest), device) then
    setting = finest
  end
  local fine = trial.run(subject, setting, device)
  local coarse = trial.run(subject, { integrator = setting.integrator, precision = "double",
    time_step = 2 * setting.time_step }, device)
  if fine.status ~= "done" or coarse.status ~= "done" then
    error(("%s: the reference is %s: %s"):format(subject.name, fine.status,
      tostring(fine.reason or coarse.reason)), 0)
  end
  return { positions = fine.positions, error = trial.rms(fine.positions, coarse.positions),
    name = ("%s double %g s"):format(methods.LABELS[setting.integrator], setting.time_step) }
end

return references
