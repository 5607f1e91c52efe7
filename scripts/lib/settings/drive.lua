--- drive.lua: whether the muscles' drive is too fast for a time step: with few steps in a period it
--- is not sampled as a sine. SI units.

local drive = {}

--- Fewer steps than this in a period give a warning: with 20, straight lines between the samples of
--- a sine are within 1.2 % of it, 1 - cos(pi / 20).
drive.STEPS_PER_PERIOD = 20

--- The warning about a scene's drive at a time step; nil if it is sampled well.
---@param scene table effects by name, with their fields
---@param time_step number s
function drive.problem(scene, time_step)
  local actuation = scene.actuation
  if not actuation then return nil end
  local steps = 1 / (actuation.frequency * time_step)
  if steps >= drive.STEPS_PER_PERIOD then return nil end
  return ("scene.actuation: at %.6g Hz a period is %.3g steps of %.3g s, fewer than %d: muscles"
    .. " do not follow a sine; use a slower drive or a time_step of %.3g s"):format(
    actuation.frequency, steps, time_step, drive.STEPS_PER_PERIOD,
    1 / (actuation.frequency * drive.STEPS_PER_PERIOD))
end

return drive
