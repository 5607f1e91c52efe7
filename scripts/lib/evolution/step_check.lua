--- step_check.lua: whether a run's time step is short enough to trust its scores: the best robots
--- of the first generation are scored once more at half the step. SI units.

local defaults = require "limax.settings.defaults"
local host = require "limax.host"
local rescore = require "limax.evolution.rescore"
local schema = require "limax.engine.schema"
local tiers = require "limax.settings.tiers"

local step_check = {}

-- Robots that are scored again, and the share of their fitness that they may lose.
local ROBOTS, LOSS = 8, 0.05

-- The setting of half the step, of a trial's `simulation`.
local function half(simulation)
  local result = {}
  for _, name in ipairs { "time_step", "bound", "bound_fraction", "time_step_most" } do
    local value = simulation[name]
    result[name] = type(value) == "number" and value / 2 or value
  end
  return result
end

-- The cheapest tier that at least halves a step, or such a step.
local function finer(time_step)
  for _, name in ipairs(tiers.NAMES) do
    local most = defaults.tiers[name].time_step_most
    if most > 0 and most <= time_step / 2 then
      return "simulation.accuracy = " .. schema.show(name)
    end
  end
  return ("simulation.time_step = %.3g"):format(time_step / 4)
end

--- Warns where the best robots of a scored generation lose fitness at half of their time step.
---@param robots limax.population.scored
function step_check.warn(robots)
  local began, best = host.clock(), {}
  for k = 1, math.min(ROBOTS, #robots.ranked) do best[k] = robots.ranked[k] end
  local fine = rescore.population(robots, half, best)
  local before, after, count, longest = 0, 0, 0, 0
  for _, i in ipairs(best) do
    if fine.fitness[i] then
      before, after = before + robots[i].fitness, after + fine.fitness[i]
      count, longest = count + 1, math.max(longest, 2 * fine.time_step[i])
    end
  end
  if count == 0 or before - after <= LOSS * math.abs(before) then return end
  robots.world.say(("at half of the time step the best %d robots of the first generation score %.4g"
    .. " in the mean instead of %.4g: take %s (this check took %.1f s)"):format(count,
    after / count, before / count, finer(longest), host.clock() - began))
end

return step_check
