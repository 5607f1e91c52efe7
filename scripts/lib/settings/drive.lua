--- drive.lua: whether a muscle's drive is too fast for a time step: a period of few steps is not
--- the wave that was meant. SI units.

local drive = {}

--- Fewer steps than this in a period are said: a sine of twenty lies within 1.2 % of straight lines
--- between its samples, 1 - cos(pi / 20).
drive.STEPS_PER_PERIOD = 20

--- What is wrong with a scene's drive at a time step; nil where nothing is.
---@param scene table effects by name, with their fields
---@param time_step number s
---@return string|nil
function drive.problem(scene, time_step)
  local actuation = scene.actuation
  if not actuation then return nil end
  local steps = 1 / (actuation.frequency * time_step)
  if steps >= drive.STEPS_PER_PERIOD then return nil end
  return ("scene.actuation: at %.6g Hz a period is %.3g steps of %.3g s, fewer than %d: muscles do"
    .. " not follow the wave that was meant; take a slower drive or a time_step of %.3g s"):format(
    actuation.frequency, steps, time_step, drive.STEPS_PER_PERIOD,
    1 / (actuation.frequency * drive.STEPS_PER_PERIOD))
end

return drive
