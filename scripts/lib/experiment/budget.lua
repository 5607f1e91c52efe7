--- budget.lua: when a repetition ends: after its last generation, or before the one that might
--- exceed its budget of evaluations. An evaluation is a robot simulated for its score; an elite
--- that keeps its score does not count.

local budget = {}

--- May another generation be bred? A whole population must fit in the rest of the budget, whatever
--- the share of elites, so that the answer does not depend on the supervisor.
---@param config table of the experiment
---@param generations integer scored so far
---@param evaluations integer spent on them
function budget.allows_another(config, generations, evaluations)
  if generations >= config.generations then return false end
  return not config.evaluations or evaluations + config.population <= config.evaluations
end

--- The field of an experiment that ended a repetition, and must grow for it to go on.
---@param generations integer scored
function budget.limit(config, generations)
  return generations >= config.generations and "generations" or "evaluations"
end

--- The largest possible number of generations of a repetition: with the largest share of elites,
--- all of which keep their scores.
function budget.most_generations(config)
  if not config.evaluations then return config.generations end
  -- supervision limits the share to a half; a script that breeds itself leaves at least one robot
  local least = math.max(1, config.population
    - math.max(math.ceil(config.population / 2),
      math.floor(config.breeding.elite_fraction * config.population + 0.5)))
  local bred = math.floor((config.evaluations - config.population) / least)
  return math.min(config.generations, 1 + bred)
end

return budget
