--- pareto.lua: an archive of the robots that no other robot of the run dominates.

local front = require "limax.experiment.front"

-- The robots of a list that stay, as a set: those that none dominates. If these are more than the
-- capacity, the most crowded leave, except the `safe` ones.
local function staying(list, options, safe)
  local points, of_front, stays = front.points(list, options.objectives), {}, {}
  local places = front.of(points)
  for k, at in ipairs(places) do of_front[k], stays[list[at]] = points[at], true end
  local surplus = #places - options.capacity
  local order = surplus > 0 and front.crowded_order(of_front) or {}
  for k = #order, 1, -1 do
    local row = list[places[order[k]]]
    if surplus > 0 and not safe[row] then stays[row], surplus = nil, surplus - 1 end
  end
  return stays
end

local function joined(rows, more)
  local all = {}
  for k, row in ipairs(rows) do all[k] = row end
  for k, row in ipairs(more) do all[#rows + k] = row end
  return all
end

--- An archive of non-dominated robots; of robots with equal objectives the first stays.
---@param options { objectives: limax.measure[], capacity: integer, reference?: number[] }
---@return limax.archive.definition|string
return function(options)
  local wrong = front.wrong_reference(options)
  if wrong then return wrong end
  return {
    objectives = options.objectives, reference = options.reference,
    choose = function(rows, _, candidates, random)
      local entered, safe, leaving = {}, {}, {}
      local stays = random and staying(joined(rows, candidates), options, {})
      for _, row in ipairs(candidates) do
        if not stays or stays[row] then entered[#entered + 1], safe[row] = row, true end
      end
      -- the robots that leave depend only on those that enter, so that files give the same archive
      stays = staying(joined(rows, entered), options, safe)
      for _, row in ipairs(rows) do leaving[row.id] = not stays[row] or nil end
      return entered, next(leaving) and leaving
    end,
  }
end
