--- tuning.lua: fixed parameters, tuned by short runs of a few settings, which spend part of the
--- budget of the run that follows with the best of them. The experiment's own setting is one of
--- them.

local cells = require "limax.tools.study.cells"
local engine = require "limax.engine"
local proposals = require "limax.supervise.proposals"
local source = require "limax.base.source"

local tuning = {}

-- Share of the budget that is spent on tuning, and the most settings that are tried: runs long
-- enough to compare settings, and most of the budget left for the run.
local SHARE, MAX_SETTINGS = 0.3, 4
-- Least populations for each of at least two settings: the first one, which is the same for all,
-- and two that a setting has bred.
local MIN_POPULATIONS, MIN_SETTINGS = 3, 2

--- Least populations in the budget of a study: tuning, and two for the run that follows.
tuning.MIN_STUDY_POPULATIONS = MIN_POPULATIONS * MIN_SETTINGS + 2

--- The number of settings that are tried, and the evaluations of each.
function tuning.budget(study)
  local all, least = SHARE * study.evaluations, MIN_POPULATIONS * study.config.population
  local settings = math.max(MIN_SETTINGS, math.min(MAX_SETTINGS, math.floor(all / least)))
  return settings, math.max(least, math.floor(all / settings))
end

-- Draws a setting from the ranges of proposals: rates and scales log-uniformly, others uniformly.
local function drawn(study, repetition, k)
  local random, breeding = engine.random(study.config.seed, repetition, "user", k, 0), {}
  for _, limit in ipairs(proposals.limits(study.config.population, nil, nil,
    study.config.breeding)) do
    if not limit.material then
      local u = random:uniform()
      breeding[limit.field] = limit.factor
        and limit.minimum * (limit.maximum / limit.minimum) ^ u
        or limit.minimum + u * (limit.maximum - limit.minimum)
    end
  end
  return breeding
end

--- Tunes one repetition: the setting with the best best_standard, and what was spent.
---@return { breeding: table, evaluations: integer }
function tuning.run(study, repetition)
  local settings, evaluations = tuning.budget(study)
  local best, spent = nil, 0
  for k = 1, settings do
    local options = source.copy(study.options)
    options.name, options.repetitions, options.supervisor = "tuning", study.repetitions, "fixed"
    options.generations, options.evaluations = study.generations, evaluations
    options.breeding = k == 1 and source.copy(study.config.breeding) or drawn(study, repetition, k)
    local result = cells.run { experiment = cells.experiment_of(options), repetition = repetition,
      path = ("%s/tuning/r%02d-%d"):format(study.out, repetition, k), device = study.device,
      say = study.warn }
    spent = spent + result.evaluations
    -- a champion that failed under the first materials has no score
    local score = result.best or -math.huge
    if not best or score > best.score then best = { score = score, breeding = options.breeding } end
  end
  return { breeding = best.breeding, evaluations = spent }
end

return tuning
