--- self_adaptive.lua: mutation scales that survive with the robots that they bred. In SAMR-GA
--- (Clune et al., "Natural selection fails to optimize mutation rates for long-term adaptation on
--- rugged fitness landscapes", 2008; constants as in evosax) every individual has a scale of its
--- own, inherited and multiplied by 2^U(-1, 1). Here a genome has none: a generation has one scale
--- for all its offspring, and a robot's scale is that of the generation that bred it. A parent is
--- drawn from the best, and its scale times 2^U(-1, 1) breeds the next generation: scales whose
--- offspring are not among the best disappear, as in SAMR-GA.

local schema = require "limax.engine.schema"

return {
  options = {
    span = schema.number { value = 2, unit = "largest factor on an inherited scale", above = 1,
      maximum = 100, reason = "SAMR-GA's in evosax: 2^U(-1, 1)" },
    parents = schema.number { value = 0.3, unit = "of the population", above = 0, maximum = 1,
      reason = "the default share of elites: those whose scales survive" },
  },
  changes = function() return { "mutation_scale" } end,
  reads_robots = true, -- the generation of one
  make = function(options)
    return function(history, random)
      local now = history[#history]
      local best = now.population.ranked
      if #best == 0 then return nil, "no robot has a score" end
      local count = math.max(1, math.floor(options.parents * #now.population + 0.5))
      local parent = now.population[best[random:integer(math.min(count, #best))]]
      local scale = history[parent.generation + 1].parameters.mutation_scale
      local factor = options.span ^ (2 * random:uniform() - 1)
      return { mutation_scale = scale * factor },
        ("robot %d was bred with scale %.4g: that times %.3g"):format(parent.id, scale, factor)
    end
  end,
}
