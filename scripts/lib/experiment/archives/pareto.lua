--- pareto.lua: an archive of the robots that no other robot of the run dominates.

local front = require "limax.experiment.front"

--- An archive of non-dominated robots; of robots with equal objectives the first stays.
---@param options { objectives: limax.measure[], reference?: number[] }
---@return limax.archive.definition|string
return function(options)
  local wrong = front.wrong_reference(options)
  if wrong then return wrong end
  return {
    objectives = options.objectives, reference = options.reference,
    choose = function(rows, _, candidates)
      local all, stays, entered, leaving = {}, {}, {}, {}
      for _, row in ipairs(rows) do all[#all + 1] = row end
      for _, row in ipairs(candidates) do all[#all + 1] = row end
      for _, at in ipairs(front.of(front.points(all, options.objectives))) do
        stays[all[at]] = true
      end
      for _, row in ipairs(rows) do leaving[row.id] = not stays[row] or nil end
      for _, row in ipairs(candidates) do
        if stays[row] then entered[#entered + 1] = row end
      end
      return entered, next(leaving) and leaving
    end,
  }
end
