--- yoked.lua: another run's parameters, generation by generation: the control for feedback. A
--- supervisor that does no better than another run's answers has shown that varying parameters
--- helps, not that its answers do. Source: the yoked control of experiments on
--- learning (Church, "Systematic effect of random error in the yoked control design", 1964).

local donor = require "limax.supervise.donor"

return {
  options = donor.options,
  unfit = donor.unfit,
  make = function(options)
    local from = donor.read(options)
    return function(history, _, limits)
      local coming = history[#history].generation + 1
      local setting = from.settings[coming]
      if not setting then
        return nil, ("%s has no generation %d"):format(donor.name(from), coming)
      end
      return donor.proposal(setting, limits),
        ("generation %d of %s"):format(coming, donor.name(from))
    end
  end,
}
