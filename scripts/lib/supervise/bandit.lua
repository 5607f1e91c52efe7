--- bandit.lua: nine settings of mutation rate and scale as a bandit's arms, chosen by UCB1 (Auer,
--- Cesa-Bianchi, Fischer, "Finite-time analysis of the multiarmed bandit problem", 2002; for
--- operators of an evolution: DaCosta et al., "Adaptive operator selection with dynamic multi-armed
--- bandits", 2008). The reward of a generation is 1 if its best beat all before, else 0. It goes to
--- the setting nearest to the applied parameters: their change is limited to a factor of 2,
--- so some generations lie between two settings.

local schema = require "limax.engine.schema"

local FIELDS = { "mutation_rate", "mutation_scale" }

local function best_of(entry) return entry.best_standard or entry.best end

-- The settings, as factors on the first parameters: every pair of 1/spread, 1, spread.
local function settings_of(first, spread)
  local list = {}
  for _, rate in ipairs { 1, 1 / spread, spread } do
    for _, scale in ipairs { 1, 1 / spread, spread } do
      list[#list + 1] = { mutation_rate = rate * first.mutation_rate,
        mutation_scale = scale * first.mutation_scale }
    end
  end
  return list
end

-- Squared distance of parameters from a setting, in logarithms; a first value of 0 has no distance.
local function distance(parameters, setting)
  local sum = 0
  for _, field in ipairs(FIELDS) do
    if setting[field] > 0 and parameters[field] > 0 then
      sum = sum + math.log(parameters[field] / setting[field]) ^ 2
    end
  end
  return sum
end

-- The nearest setting for which `accepts` returns true; the first of equally near ones.
local function nearest(parameters, settings, accepts)
  local found, least
  for k, setting in ipairs(settings) do
    local apart = distance(parameters, setting)
    -- differences by rounding do not count
    if accepts(k) and (not least or apart < least - 1e-9) then found, least = k, apart end
  end
  return found
end

-- Plays and rewards of each setting over the history.
local function count(history, settings)
  local plays, rewards, best = {}, {}, best_of(history[1]) or -math.huge
  for k = 1, #settings do plays[k], rewards[k] = 0, 0 end
  for k = 2, #history do
    local played = nearest(history[k].parameters, settings, function() return true end)
    local reached = best_of(history[k]) or -math.huge
    plays[played] = plays[played] + 1
    if reached > best then rewards[played], best = rewards[played] + 1, reached end
  end
  return plays, rewards
end

return {
  options = {
    spread = schema.number { value = 2, unit = "factor between neighbouring settings", above = 1,
      maximum = 10, reason = "the largest change in one generation" },
    exploration = schema.number { value = 0.5, unit = "of UCB1's own", minimum = 0, maximum = 10,
      reason = "runs are short: a hundred plays of nine arms" },
  },
  changes = function() return FIELDS end,
  make = function(options)
    return function(history)
      local now = history[#history].parameters
      local settings = settings_of(history[1].parameters, options.spread)
      local plays, rewards = count(history, settings)
      local chosen = nearest(now, settings, function(k) return plays[k] == 0 end)
      local reason = "not tried yet"
      if not chosen then
        local highest
        for k = 1, #settings do
          local mean = rewards[k] / plays[k]
          local bound = mean
            + options.exploration * math.sqrt(2 * math.log(#history - 1) / plays[k])
          if not highest or bound > highest then chosen, highest = k, bound end
        end
        reason = ("%d of %d generations found a new best, bound %.3g"):format(rewards[chosen],
          plays[chosen], highest)
      end
      local setting = settings[chosen]
      return { mutation_rate = setting.mutation_rate, mutation_scale = setting.mutation_scale },
        ("setting %d of %d: %s"):format(chosen, #settings, reason)
    end
  end,
}
