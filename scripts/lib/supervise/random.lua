--- random.lua: a random walk of the parameters within the limits of every proposal: the control for
--- supervisors that use the history. Materials change too where the experiment allows it. Source:
--- Karafotias, Hoogendoorn, Eiben, "Why parameter control mechanisms should be benchmarked against
--- random variation" (2013).

local schema = require "limax.engine.schema"

-- A value outside of its range is reflected at the border.
local function reflected(value, low, high)
  if value < low then value = 2 * low - value end
  if value > high then value = 2 * high - value end
  return math.min(math.max(value, low), high)
end

-- One step from `before`: a factor if the limit is a factor, else a difference. `unit` is the unit
-- of the limit's range.
local function step(before, limit, unit, share, random)
  local u = share * (2 * random:uniform() - 1)
  local least, most = limit.minimum * unit, limit.maximum * unit
  if limit.factor then
    local low, high = math.log(least), math.log(most)
    local from = math.log(math.max(before, least))
    local value = math.exp(reflected(from + u * math.log(limit.factor), low, high))
    -- exp(log(x)) may miss x by a rounding
    return math.min(math.max(value, least), most)
  end
  return reflected(before + u * limit.step, least, most)
end

-- Steps of one field in every material that has it.
local function step_materials(proposal, history, limit, share, random)
  local first = history[1].materials.materials
  for k, material in ipairs(history[#history].materials.materials) do
    local before = material[limit.field]
    if before and material.kind ~= "empty" then
      local unit = limit.field == "stiffness" and first[k].stiffness or 1
      proposal[material.name] = proposal[material.name] or {}
      proposal[material.name][limit.field] = step(before, limit, unit, share, random)
    end
  end
end

return {
  options = {
    step = schema.number { value = 1, unit = "of the largest change per generation", above = 0,
      maximum = 1, reason = "as large as for any other supervisor" },
  },
  make = function(options)
    return function(history, random, limits)
      local now = history[#history]
      local proposal = {}
      for _, limit in ipairs(limits) do
        local before = now.parameters[limit.field]
        if limit.allowed and limit.material then
          proposal.materials = proposal.materials or {}
          step_materials(proposal.materials, history, limit, options.step, random)
        elseif limit.allowed and before then
          proposal[limit.field] = step(before, limit, 1, options.step, random)
        end
      end
      return proposal, "a random step"
    end
  end,
}
