--- tiers.lua: the named tiers of accuracy.

local defaults = require "limax.settings.defaults"
local settings = require "limax.settings.settings"

local tiers = {}

--- The tiers, cheapest first.
tiers.NAMES = { "preview", "evolve", "publish", "reference" }

-- Fields of `simulation` that a tier sets.
local PARTS = settings.of_tier

--- The tier of a resolved `simulation`; nil if the script set a part of it.
function tiers.of(simulation)
  local tier = defaults.tiers[simulation.accuracy]
  for _, part in ipairs(PARTS) do
    if simulation[part] ~= tier[part] then return nil end
  end
  return simulation.accuracy
end

--- Overrides that give an experiment a whole tier, also the parts that its script sets.
function tiers.overrides(name)
  local list = { "simulation.accuracy=" .. name }
  for _, part in ipairs(PARTS) do list[#list + 1] = ("simulation.%s=null"):format(part) end
  return list
end

--- A tier in words: "leapfrog, compensated, at most 0.0002 s".
function tiers.describe(name)
  local tier = defaults.tiers[name]
  local most = tier.time_step_most > 0 and (", at most %g s"):format(tier.time_step_most) or ""
  return ("%s, %s, %g of each body's bound%s%s"):format(tier.integrator, tier.precision,
    tier.bound_fraction, tier.bound and " by " .. tier.bound or "", most)
end

return tiers
