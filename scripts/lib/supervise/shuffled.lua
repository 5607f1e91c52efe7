--- shuffled.lua: another run's parameters in random order: the control for their timing. Each
--- setting is used once. The ledger limits changes, so that large ones take several generations.
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

local options = { seed = schema.number { value = 1, unit = "1", minimum = 0, maximum = 2 ^ 53,
  integer = true, reason = "any order will do" } }
for name, rule in pairs(donor.options) do options[name] = rule end

return {
  options = options,
  unfit = donor.unfit,
  make = function(chosen)
    local from = donor.read(chosen)
    local order = permutation(#from.settings, chosen.seed, chosen.repetition)
    return function(history, _, limits)
      local generation = order[history[#history].generation + 1]
      if not generation then return nil, donor.name(from) .. " has no setting left" end
      return donor.proposal(from.settings[generation], limits),
        ("generation %d of %s, out of its order"):format(generation, donor.name(from))
    end
  end,
}
