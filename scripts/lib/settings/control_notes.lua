--- control_notes.lua: fields of scene.control that are valid but probably unintended. Each gives
--- one note. SI units.

local control_notes = {}

-- Fewer steps than this in a tick: the tick shortens the steps, not the body.
local STEPS_PER_TICK = 20

-- Does a text read a name? Comments do not count.
local function reads(signal, name)
  return (" " .. signal:gsub("//[^\n]*", "") .. " "):find("[^%w_.]" .. name .. "[^%w_]") ~= nil
end

-- A clock that ticks do not resolve.
local function fast_clock(control)
  local clock = reads(control.signal, "clock_sine") or reads(control.signal, "clock_cosine")
  if not clock or control.frequency < control.rate / 2 then return nil end
  return ("scene.control.frequency is %.6g Hz, and there are %.6g ticks a second: the clock needs"
    .. " more than two ticks in a period; set rate above %.6g Hz, or a lower frequency"):format(
    control.frequency, control.rate, 2 * control.frequency)
end

-- A delay that hides all of the run, or none of it.
local function odd_delay(control, duration)
  local delay, tick = control.delay, 1 / control.rate
  if delay > duration then
    return ("scene.control.delay is %.4g s, and simulation.duration is %.4g s: sensors keep their"
      .. " first reading; set a shorter delay"):format(delay, duration)
  elseif delay > 0 and delay < tick / 2 then
    return ("scene.control.delay is %.4g s, less than half a tick of %.4g s: it is rounded to 0;"
      .. " set at least %.4g s, or a higher rate"):format(delay, tick, tick)
  end
end

--- Notes on a scene's controller.
---@param scene table effects with all their fields
---@param duration number s
---@return string[]
function control_notes.of(scene, duration)
  local control, list = scene.control, {}
  if not control then return list end
  list[#list + 1] = fast_clock(control)
  list[#list + 1] = odd_delay(control, duration)
  return list
end

--- A note on ticks that shorten the automatic step to less than half; nil if they do not.
---@param scene table effects with all their fields
---@param options table of the engine's simulation
---@param outcome { time_step: number, time_step_bound: number|nil } of a robot
---@return string|nil
function control_notes.short_steps(scene, options, outcome)
  local control, bound = scene.control, outcome.time_step_bound
  if not control or not bound or type(options.time_step) == "number" then return nil end
  local step, most = outcome.time_step, options.time_step_most or 0
  local own = math.min((options.bound_fraction or 1) * bound, most > 0 and most or math.huge)
  local steps = math.floor(1 / (control.rate * step) + 0.5)
  if steps >= STEPS_PER_TICK or step >= own / 2 then return nil end
  return ("scene.control.rate is %.6g Hz: its ticks shorten the automatic time step from about %.2g"
    .. " to %.2g s (%d in a tick), and runs take that much longer; set a lower rate, or a smaller"
    .. " control.change"):format(control.rate, own, step, steps)
end

return control_notes
