--- budget.lua: when a repetition ends: after its last generation, or before the one that its budget
--- of evaluations may not hold. An evaluation is a robot simulated for its score; an elite that
--- keeps its score is none.

local budget = {}

--- May another generation be bred? A whole population must fit in what is left, whatever the share
--- of elites, so that the answer is known before a supervisor is asked.
---@param config table of the experiment
---@param generations integer scored so far
---@param evaluations integer spent on them
---@return boolean
function budget.allows_another(config, generations, evaluations)
  if generations >= config.generations then return false end
  return not config.evaluations or evaluations + config.population <= config.evaluations
end

--- The most generations that a repetition can take: with the largest share of elites, whose scores
--- all stand.
---@param config table
---@return integer
function budget.most_generations(config)
  if not config.evaluations then return config.generations end
  -- the table of supervision binds the share by a half, a breeding of a script's own by one robot
  local least = math.max(1, config.population
    - math.max(math.ceil(config.population / 2),
      math.floor(config.breeding.elite_fraction * config.population + 0.5)))
  local bred = math.floor((config.evaluations - config.population) / least)
  return math.min(config.generations, 1 + bred)
end

return budget
