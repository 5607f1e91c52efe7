--- ranking.lua: how well cheap scores order robots as good scores do. A score is a number, larger
--- is better; nil is a robot that failed, which ranks below every other and is never an elite.

local ranking = {}

-- Failures rank below every score, and equal each other.
local function compare(a, b)
  a, b = a or -math.huge, b or -math.huge
  if a == b then return 0 end
  return a > b and 1 or -1
end

--- Kendall's tau-b of two lists of scores of the same robots: concordant minus discordant pairs,
--- over the geometric mean of the numbers of pairs that each list tells apart. 1: the same order;
--- -1: the opposite one. nil where a list tells no two robots apart.
---@param a (number|nil)[]
---@param b (number|nil)[]
---@param count integer robots
---@return number|nil
function ranking.kendall_tau(a, b, count)
  local sum, told_a, told_b = 0, 0, 0
  for i = 1, count do
    for j = 1, i - 1 do
      local in_a, in_b = compare(a[i], a[j]), compare(b[i], b[j])
      sum = sum + in_a * in_b
      told_a, told_b = told_a + in_a * in_a, told_b + in_b * in_b
    end
  end
  if told_a == 0 or told_b == 0 then return nil end
  return sum / math.sqrt(told_a * told_b)
end

--- The best `share` of the robots, best first: round(share x count) of them, one at least, as
--- breeding takes them; equal ones in index order.
---@param scores (number|nil)[]
---@param count integer robots
---@param share number 0 to 1
---@return integer[] indices
function ranking.elites(scores, count, share)
  local ranked = {}
  for i = 1, count do
    if scores[i] then ranked[#ranked + 1] = i end
  end
  table.sort(ranked, function(i, j)
    if scores[i] ~= scores[j] then return scores[i] > scores[j] end
    return i < j
  end)
  local wanted = math.max(1, math.floor(share * count + 0.5))
  local elites = {}
  for k = 1, math.min(wanted, #ranked) do elites[k] = ranked[k] end
  return elites
end

--- Share of the reference's elites that are elites by the cheap scores too.
---@param reference (number|nil)[]
---@param cheap (number|nil)[]
---@param count integer robots
---@param share number of the robots that are elites
---@return number|nil nil without a robot that the reference could score
function ranking.overlap(reference, cheap, count, share)
  local chosen, both = {}, 0
  for _, i in ipairs(ranking.elites(cheap, count, share)) do chosen[i] = true end
  local best = ranking.elites(reference, count, share)
  for _, i in ipairs(best) do both = both + (chosen[i] and 1 or 0) end
  return #best > 0 and both / #best or nil
end

-- Sum of the reference's scores of some robots; one that failed there counts as the worst that did
-- not.
local function sum_of(scores, count, robots)
  local worst, sum = math.huge, 0
  for i = 1, count do worst = math.min(worst, scores[i] or math.huge) end
  for _, i in ipairs(robots) do sum = sum + (scores[i] or worst) end
  return sum
end

--- Elite regret: the share of reference fitness that is lost by taking the elites of the cheap
--- scores instead of the reference's own. 0: nothing is lost. Elites that the cheap scores could
--- not fill (too many failed) count as the reference's worst robot. nil where the reference's
--- elites have a mean of 0 or nobody could be scored.
---@param reference (number|nil)[]
---@param cheap (number|nil)[]
---@param count integer robots
---@param share number of the robots that are elites
---@return number|nil
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

--- Mean distance of two lists where both have a number, and that mean over the mean size of the
--- first.
---@param reference (number|nil)[]
---@param cheap (number|nil)[]
---@param count integer
---@return number|nil mean nil where there is no pair
---@return number|nil relative nil where the reference is 0
function ranking.mean_error(reference, cheap, count)
  local off, size, pairs_counted = 0, 0, 0
  for i = 1, count do
    if reference[i] and cheap[i] then
      off, size = off + math.abs(cheap[i] - reference[i]), size + math.abs(reference[i])
      pairs_counted = pairs_counted + 1
    end
  end
  if pairs_counted == 0 then return nil, nil end
  return off / pairs_counted, size > 0 and off / size or nil
end

return ranking
