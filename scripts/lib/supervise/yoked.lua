--- yoked.lua: another run's parameters, generation by generation: the control for feedback. A
--- supervisor that does no better than another run's answers has shown that varying parameters
--- helps, not that its answers do. Source: the yoked control of experiments on
--- learning (Church, "Systematic effect of random error in the yoked control design", 1964).

local donor = require "limax.supervise.donor"

return donor.supervisor(function(from)
  return function(generation)
    local setting = from.settings[generation]
    return setting, setting and ("generation %d of %%s"):format(generation)
      or ("%%s has no generation %d"):format(generation)
  end
end)
