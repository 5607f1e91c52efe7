--- tuning.lua: fixed parameters, tuned: short runs of a few settings, out of the same budget of
--- evaluations as the run that follows with the best of them. The experiment's own setting is one
--- of them, so that tuning cannot lose but by what it spends.

local cells = require "limax.tools.study.cells"
local engine = require "limax.engine"
local ledger = require "limax.supervise.ledger"
local source = require "limax.base.source"

local tuning = {}

-- Share of the budget that is spent on tuning, and the most settings that are tried: runs long
-- enough to tell settings apart, and most of the budget left for the run.
local SHARE, SETTINGS = 0.3, 4
-- Populations that each of two settings takes at least: the first one, which is the same for all,
-- and two that a setting has bred.
local LEAST, LEAST_SETTINGS = 3, 2

--- Populations that a study's budget must hold: tuning, and two for the run that follows.
tuning.LEAST_POPULATIONS = LEAST * LEAST_SETTINGS + 2

--- Settings that are tried, and evaluations of the short run of each.
---@param study limax.study
---@return integer settings
---@return integer evaluations
function tuning.budget(study)
  local all, least = SHARE * study.evaluations, LEAST * study.config.population
  local settings = math.max(LEAST_SETTINGS, math.min(SETTINGS, math.floor(all / least)))
  return settings, math.max(least, math.floor(all / settings))
end

-- A setting drawn from the ranges that bind supervisors: rates and scales by their logarithm, the
-- rest evenly.
local function drawn(study, repetition, k)
  local random, breeding = engine.random(study.config.seed, repetition, "user", k, 0), {}
  for _, limit in ipairs(ledger.limits(study.config.population)) do
    if not limit.material then
      local u = random:uniform()
      breeding[limit.field] = limit.factor
        and limit.minimum * (limit.maximum / limit.minimum) ^ u
        or limit.minimum + u * (limit.maximum - limit.minimum)
    end
  end
  return breeding
end

--- Tunes one repetition: the breeding that reached the best best_standard, and what was spent.
---@param study limax.study
---@param repetition integer
---@return { breeding: table, evaluations: integer }
function tuning.run(study, repetition)
  local settings, evaluations = tuning.budget(study)
  local best, spent = nil, 0
  for k = 1, settings do
    local given = source.copy(study.given)
    given.name, given.repetitions, given.supervisor = "tuning", study.repetitions, "fixed"
    given.generations, given.evaluations = study.generations, evaluations
    given.breeding = k == 1 and source.copy(study.config.breeding) or drawn(study, repetition, k)
    local result = cells.run { experiment = cells.experiment_of(given), repetition = repetition,
      path = ("%s/tuning/r%02d-%d"):format(study.out, repetition, k), device = study.device,
      say = study.hear }
    spent = spent + result.evaluations
    -- a champion that failed under the first materials has no score
    local score = result.best or -math.huge
    if not best or score > best.score then best = { score = score, breeding = given.breeding } end
  end
  return { breeding = best.breeding, evaluations = spent }
end

return tuning
