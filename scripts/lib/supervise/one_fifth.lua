--- one_fifth.lua: Rechenberg's rule: if more than a fifth of the offspring beat their parents, the
--- search is too cautious and mutation_scale grows; if fewer do, it shrinks. The two changes cancel
--- at exactly a fifth. Source: Rechenberg, "Evolutionsstrategie" (1973); the asymmetric factors:
--- Kern et al., "Learning probability distributions in continuous evolutionary algorithms" (2004).

local schema = require "limax.engine.schema"

-- The number of offspring in generation `now` that are fitter than both parents, and of all. A
-- failed offspring is not a success; one whose parents are not in `before` does not count.
local function successes(now, before)
  local fitness_of = {}
  for i = 1, #before.population do
    local robot = before.population[i]
    if robot.fitness then fitness_of[robot.id] = robot.fitness end
  end
  local won, tried = 0, 0
  for i = 1, #now.population do
    local robot = now.population[i]
    local to_beat
    if robot.origin == "bred" then
      for _, parent in ipairs(robot.parents) do
        local score = fitness_of[parent]
        if score and (not to_beat or score > to_beat) then to_beat = score end
      end
    end
    if to_beat then
      tried = tried + 1
      if robot.fitness and robot.fitness > to_beat then won = won + 1 end
    end
  end
  return won, tried
end

return {
  options = {
    factor = schema.number { value = 1.5, unit = "growth of mutation_scale per generation",
      above = 1, maximum = 2, reason = "its fourth root, 0.90, is the fall: it halves in seven" },
    window = schema.number { value = 3, unit = "generations", minimum = 1, maximum = 1000,
      integer = true, reason = "twenty offspring are too few to estimate a share of one fifth" },
  },
  changes = function() return { "mutation_scale" } end,
  reads_robots = true, -- origin and parents
  make = function(options)
    return function(history)
      local won, tried = 0, 0
      for k = math.max(2, #history - options.window + 1), #history do
        local w, t = successes(history[k], history[k - 1])
        won, tried = won + w, tried + t
      end
      if tried == 0 then return nil, "no offspring to judge by" end
      local rate = won / tried
      local reason = ("%d of %d offspring beat their parents"):format(won, tried)
      local scale = history[#history].parameters.mutation_scale
      if rate > 0.2 then
        reason = reason .. ", more than a fifth: larger mutations"
        return { mutation_scale = scale * options.factor }, reason
      end
      if rate < 0.2 then
        reason = reason .. ", less than a fifth: smaller mutations"
        return { mutation_scale = scale * options.factor ^ -0.25 }, reason
      end
      return nil, reason .. ", exactly a fifth"
    end
  end,
}
