--- step_check.lua: whether the scores of a run depend on its time step. The best robots of the
--- first and of the last generation are scored once more at half of their step. If they lose
--- fitness, one warning names the loss and a finer tier. The run itself does not change. SI units.

local budget = require "limax.experiment.budget"
local defaults = require "limax.settings.defaults"
local rescore = require "limax.evolution.rescore"
local tiers = require "limax.settings.tiers"

local step_check = {}

--- The robots of a check.
step_check.ROBOTS = 8

-- The share of their fitness that they may lose.
local LOSS = 0.05
-- The tiers with a finer one that evolution can afford.
local CHEAP = { preview = true, evolve = true }

-- Is this generation checked?
local function applies(run, robots)
  if not CHEAP[tiers.of(run.world.config.simulation)] then return false end
  -- an own loop may have scored by another fitness than the one that scores again
  if robots.scored_by ~= run.world.fitness then return false end
  if robots.generation > 0 and budget.allows_another(run.world.config, robots.generation + 1,
    run.evaluations + robots.evaluations) then
    return false
  end
  -- with friction the step matters: masses touch, stick and slip at other times
  for _, trial in ipairs(robots.trials) do
    if trial.scene.friction then return true end
  end
  return false
end

-- The setting of half the step, of a trial's `simulation`.
local function half(simulation)
  local result = {}
  for _, name in ipairs { "time_step", "bound", "bound_fraction", "time_step_most" } do
    local value = simulation[name]
    result[name] = type(value) == "number" and value / 2 or value
  end
  return result
end

-- Sums of the best robots' fitness and of the same at half of their step, their number, and the
-- longest step, s.
local function compare(robots)
  local best, sums = {}, { before = 0, after = 0, count = 0, step = 0 }
  for k = 1, math.min(step_check.ROBOTS, #robots.ranked) do best[k] = robots.ranked[k] end
  local fine = rescore.population(robots, half, best)
  for _, i in ipairs(best) do
    if fine.fitness[i] then
      sums.before, sums.after = sums.before + robots[i].fitness, sums.after + fine.fitness[i]
      sums.count, sums.step = sums.count + 1, math.max(sums.step, 2 * fine.time_step[i])
    end
  end
  return sums
end

--- Warns if the best robots of a run's first or last generation lose fitness at half of their
--- time step.
---@param robots limax.population.scored scored, and not in the history yet
function step_check.look(run, robots)
  if not applies(run, robots) then return end
  local sums = compare(robots)
  if sums.count == 0 or sums.before - sums.after <= LOSS * math.abs(sums.before) then return end
  -- the steps of stiff bodies may be those of `publish` already
  local tier = defaults.tiers.publish.time_step_most <= sums.step / 2 and "publish" or "reference"
  local times = math.max(1, sums.step / defaults.tiers[tier].time_step_most)
  run.world.say(("at half of the time step the best %d robots of generation %d score %.4g in the"
    .. " mean instead of %.4g: take simulation.accuracy = \"%s\", for about %.1f times the time")
    :format(sums.count, robots.generation, sums.after / sums.count, sums.before / sums.count, tier,
    times), "step_check")
end

return step_check
