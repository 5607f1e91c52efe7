--- fidelity.lua: whether a run's time step is short enough to trust its scores. In every tenth
--- generation the best robots are scored once more at half of the step. Where they lose fitness,
--- the best half of this and of each later generation is scored again at a finer tier. SI units.

local defaults = require "limax.settings.defaults"
local exchange = require "limax.base.exchange"
local metrics = require "limax.run.metrics"
local rescore = require "limax.evolution.rescore"
local schema = require "limax.engine.schema"
local tiers = require "limax.settings.tiers"

---@class limax.fidelity of one repetition
---@field tier string|nil at which robots are scored again; nil: a loss is only reported
---@field on boolean are they?
local Fidelity = {}
Fidelity.__index = Fidelity

local fidelity = {}

-- Generations between two checks, the robots of a check, and the share of their fitness that they
-- may lose.
local EVERY, ROBOTS, LOSS = 10, 8, 0.05
-- The ranked robots that are scored again: all elites, and others that the step may misjudge.
local SHARE = 0.5
local AUTOMATIC, CHEAP = "publish", { preview = true, evolve = true }

-- Rough ground is where the step matters: masses touch, stick and slip at other times.
local function has_friction(config)
  if config.scene.friction then return true end
  for _, trial in ipairs(config.trials or {}) do
    if trial.scene and trial.scene.friction then return true end
  end
  return false
end

--- What a repetition does; nil where nothing is checked.
---@param config table the experiment's
---@return limax.fidelity|nil
function fidelity.of(config)
  local named = config.rescore
  if named == "never" or not named and not has_friction(config) then return nil end
  local tier = named or CHEAP[tiers.of(config.simulation)] and AUTOMATIC or nil
  return setmetatable({ tier = tier, on = named ~= nil }, Fidelity)
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

-- Mean fitness of the best robots and the same at half of their step; how many they are, and the
-- longest step, s.
local function look(robots)
  local best, found = {}, { before = 0, after = 0, count = 0, step = 0 }
  for k, i in ipairs(metrics.rank(robots.records)) do
    if k <= ROBOTS then best[k] = i end
  end
  local fine = rescore.population(robots, half, best)
  for _, i in ipairs(best) do
    if fine.fitness[i] then
      found.before, found.after = found.before + robots[i].fitness, found.after + fine.fitness[i]
      found.count, found.step = found.count + 1, math.max(found.step, 2 * fine.time_step[i])
    end
  end
  return found
end

-- What is done about a loss, or what a user may do.
function Fidelity:remedy(step)
  if self.tier then
    local finer = defaults.tiers[self.tier].time_step_most
    return ("from here on the best half of each generation is scored again at the tier %s, for"
      .. " about %.1f times the time; rescore = \"never\" leaves it out"):format(self.tier,
      1 + SHARE * math.max(1, step / finer))
  end
  for _, name in ipairs(tiers.NAMES) do
    local most = defaults.tiers[name].time_step_most
    if most > 0 and most <= step / 2 then
      return "take simulation.accuracy = " .. schema.show(name)
    end
  end
  return ("take simulation.time_step = %.3g"):format(step / 4)
end

-- Looks whether scores depend on the step; once where nothing but a report follows.
function Fidelity:check(robots)
  if robots.generation % EVERY > 0 or not self.tier and robots.generation > 0 then return end
  local found = exchange.first(function() return look(robots) end)
  local loss = found.before - found.after
  if found.count == 0 or loss <= LOSS * math.abs(found.before) then return end
  self.on = self.tier ~= nil
  robots.world.say(("at half of the time step the best %d robots of generation %d score %.4g in the"
    .. " mean instead of %.4g: %s"):format(found.count, robots.generation,
    found.after / found.count, found.before / found.count, self:remedy(found.step)), "rescore")
end

--- The options under which robots of a generation are scored again.
---@param robots limax.population.scored
---@return table[] of each trial
function Fidelity:options(robots)
  local options = {}
  for k, trial in ipairs(robots.trials) do
    options[k] = rescore.options({ simulation = trial.simulation, record = trial.options.record },
      { accuracy = self.tier })
  end
  return options
end

--- Scores robots of a generation again where its scores depend on the step, until its best half
--- has finer scores.
---@param robots limax.population.scored simulated and scored
---@param replace fun(mask: boolean[]) gives robots new scores, under `options`
function Fidelity:improve(robots, replace)
  if not self.on then self:check(robots) end
  while self.on do
    local ranked, mask, count = metrics.rank(robots.records), {}, 0
    for i = 1, #robots do mask[i] = false end
    for k = 1, math.ceil(SHARE * #ranked) do
      local i = ranked[k]
      mask[i] = robots.records[i].first_fitness == nil
      if mask[i] then count = count + 1 end
    end
    if count == 0 then return end
    replace(mask)
  end
end

return fidelity
