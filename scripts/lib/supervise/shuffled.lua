--- shuffled.lua: another run's parameters in random order: the control for their timing. Each
--- setting is used once. Changes are limited, so that large ones take several generations.
--- Source: as for `yoked`, with the order destroyed (a permutation control).

local donor = require "limax.supervise.donor"
local engine = require "limax.engine"
local schema = require "limax.engine.schema"

-- A permutation of 1 to n that depends only on the seed (Durstenfeld, 1964).
local function permutation(n, seed, repetition)
  local order, random = {}, engine.random(seed, repetition, "supervision", 0, 0)
  for k = 1, n do order[k] = k end
  for k = n, 2, -1 do
    local other = random:integer(k)
    order[k], order[other] = order[other], order[k]
  end
  return order
end

return donor.supervisor(function(from, options)
  local order = permutation(#from.settings, options.seed, options.repetition)
  return function(generation)
    local other = order[generation]
    if not other then return nil, "%s has no setting left" end
    return from.settings[other], ("generation %d of %%s, out of its order"):format(other)
  end
end, { seed = schema.number { value = 1, unit = "1", minimum = 0, maximum = 2 ^ 53,
  integer = true, reason = "any order will do" } })
