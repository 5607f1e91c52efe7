--- random.lua: a random walk of the parameters inside the ranges that bind every proposal, no step
--- larger than the largest change per generation: the control for whoever claims to know better.

local schema = require "limax.schema"

-- A value that left its range comes back in from the border, so that borders are no traps.
local function reflected(value, low, high)
  if value < low then value = 2 * low - value end
  if value > high then value = 2 * high - value end
  return math.min(math.max(value, low), high)
end

-- One step from `before`: a factor where the ledger limits by a factor, else a difference.
local function step(before, limit, share, random)
  local u = share * (2 * random:uniform() - 1)
  if limit.factor then
    local low, high = math.log(limit.minimum), math.log(limit.maximum)
    local from = math.log(math.max(before, limit.minimum))
    local value = math.exp(reflected(from + u * math.log(limit.factor), low, high))
    -- exp(log(x)) may miss x by a rounding
    return math.min(math.max(value, limit.minimum), limit.maximum)
  end
  return reflected(before + u * limit.step, limit.minimum, limit.maximum)
end

return {
  options = {
    step = schema.number { value = 1, unit = "of the largest change per generation", above = 0,
      maximum = 1, reason = "as free as any other supervisor" },
  },
  make = function(options)
    return function(history, random, limits)
      local now = history[#history]
      if not now then return nil, "nothing is scored yet" end
      local proposal = {}
      for _, limit in ipairs(limits) do
        local before = now.parameters[limit.field]
        if before then proposal[limit.field] = step(before, limit, options.step, random) end
      end
      return proposal, "a random step"
    end
  end,
}
