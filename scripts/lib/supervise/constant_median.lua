--- constant_median.lua: the median of each of another run's parameters, kept constant: the control
--- for the level. A supervisor that does no better than its own medians has found good parameters,
--- not a good way to change them. Source: the comparison of control with tuning in Karafotias,
--- Hoogendoorn, Eiben, "Parameter control in evolutionary algorithms: trends and challenges"
--- (2015).

local donor = require "limax.supervise.donor"
local sample = require "limax.base.statistics.sample"

-- The median of a field over the bred generations.
local function median_of(settings, read)
  local values = {}
  for k, setting in ipairs(settings) do values[k] = read(setting) end
  return sample.median(values)
end

local function medians(settings)
  local middle = { parameters = {}, materials = {} }
  if #settings == 0 then return middle end
  for field in pairs(settings[1].parameters) do
    middle.parameters[field] = median_of(settings, function(s) return s.parameters[field] end)
  end
  for name, fields in pairs(settings[1].materials) do
    middle.materials[name] = {}
    for field in pairs(fields) do
      middle.materials[name][field] =
        median_of(settings, function(s) return s.materials[name][field] end)
    end
  end
  return middle
end

return donor.supervisor(function(from)
  local middle = medians(from.settings)
  return function() return middle, "the medians of %s" end
end)
