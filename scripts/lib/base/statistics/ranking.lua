--- ranking.lua: how well cheap scores rank robots compared with reference scores. Larger is better;
--- nil is a failed robot, which ranks below every other and is never an elite.

local sorting = require "limax.base.sorting"

local ranking = {}

local function compare(a, b)
  a, b = a or -math.huge, b or -math.huge
  if a == b then return 0 end
  return a > b and 1 or -1
end

--- Kendall's tau-b of two lists of scores of the same robots: concordant minus discordant pairs
--- over the geometric mean of each list's number of untied pairs. 1 is the same order, -1 the
--- reverse; nil if all pairs of a list are tied.
function ranking.kendall_tau(a, b, count)
  local sum, untied_a, untied_b = 0, 0, 0
  for i = 1, count do
    for j = 1, i - 1 do
      local in_a, in_b = compare(a[i], a[j]), compare(b[i], b[j])
      sum = sum + in_a * in_b
      untied_a, untied_b = untied_a + in_a * in_a, untied_b + in_b * in_b
    end
  end
  if untied_a == 0 or untied_b == 0 then return nil end
  return sum / math.sqrt(untied_a * untied_b)
end

--- The elites: the best round(share x count) robots, at least one, best first as in breeding; equal
--- ones in index order.
---@param share number 0 to 1
function ranking.elites(scores, count, share)
  local scored, values, elites = {}, {}, {}
  for i = 1, count do
    if scores[i] then scored[#scored + 1], values[#values + 1] = i, scores[i] end
  end
  local order, wanted = sorting.descending(values), math.max(1, math.floor(share * count + 0.5))
  for k = 1, math.min(wanted, #order) do elites[k] = scored[order[k]] end
  return elites
end

--- Share of the reference's elites that are also elites by the cheap scores.
---@param share number of the robots that are elites
---@return number|nil nil if the reference scored no robot
function ranking.overlap(reference, cheap, count, share)
  local chosen, both = {}, 0
  for _, i in ipairs(ranking.elites(cheap, count, share)) do chosen[i] = true end
  local best = ranking.elites(reference, count, share)
  for _, i in ipairs(best) do both = both + (chosen[i] and 1 or 0) end
  return #best > 0 and both / #best or nil
end

-- Sum of the scores of some robots; a failed robot counts as the worst scored one.
local function sum_of(scores, count, robots)
  local worst, sum = math.huge, 0
  for i = 1, count do worst = math.min(worst, scores[i] or math.huge) end
  for _, i in ipairs(robots) do sum = sum + (scores[i] or worst) end
  return sum
end

--- Elite regret: the share of reference fitness that is lost by choosing elites by the cheap
--- scores. If too many robots failed under the cheap scores, the missing elites count as the
--- reference's worst robot. nil if the reference's elites have a mean of 0 or no robot was scored.
function ranking.elite_regret(reference, cheap, count, share)
  local best, taken = ranking.elites(reference, count, share), ranking.elites(cheap, count, share)
  if #best == 0 then return nil end
  local worst = best[1]
  for i = 1, count do
    if reference[i] and reference[i] < reference[worst] then worst = i end
  end
  while #taken > #best do taken[#taken] = nil end
  while #taken < #best do taken[#taken + 1] = worst end
  local most = sum_of(reference, count, best)
  if most == 0 then return nil end
  return (most - sum_of(reference, count, taken)) / math.abs(most)
end

--- Mean absolute error where both lists have a number, absolute and relative to the mean absolute
--- value of the reference.
---@return number|nil mean nil without a pair
---@return number|nil relative nil if the reference is 0
function ranking.mean_error(reference, cheap, count)
  local error_sum, size, compared = 0, 0, 0
  for i = 1, count do
    if reference[i] and cheap[i] then
      error_sum = error_sum + math.abs(cheap[i] - reference[i])
      size, compared = size + math.abs(reference[i]), compared + 1
    end
  end
  if compared == 0 then return nil, nil end
  return error_sum / compared, size > 0 and error_sum / size or nil
end

return ranking
