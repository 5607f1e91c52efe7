--- signed_rank.lua: Wilcoxon's signed-rank test of paired differences, exact also with ties: the
--- distribution over all 2^n signs of the observed mid-ranks, by dynamic programming.
--- Source: Wilcoxon, "Individual comparisons by ranking methods" (1945).

local midranks = require "limax.base.statistics.midranks"

local signed_rank = {}

-- Probabilities of the sum of the doubled ranks with a positive sign, from 0, and the largest sum.
-- A probability is a whole number over 2^n, hence exact up to n = 53.
local function distribution(doubled)
  local probabilities, total = { [0] = 1 }, 0
  for _, rank in ipairs(doubled) do
    for s = total + 1, total + rank do probabilities[s] = 0 end
    total = total + rank
    for s = total, 0, -1 do
      local with = s >= rank and probabilities[s - rank] or 0
      probabilities[s] = (probabilities[s] + with) / 2
    end
  end
  return probabilities, total
end

-- Probability of a sum at least as far from its mean, total/2, as `sum`.
local function two_sided(probabilities, total, sum)
  local far, p = math.abs(2 * sum - total), 0
  for s = 0, total do
    if math.abs(2 * s - total) >= far then p = p + probabilities[s] end
  end
  return math.min(p, 1)
end

--- The exact two-sided test. The null hypothesis is a median of 0; p is 1 if all differences are 0.
---@return { p: number, positive: number, negative: number, n: integer, zeros: integer } two-sided
--- p, the sums of the ranks of positive and negative differences, their number, and the number of
--- differences that are 0, which are left out as in Wilcoxon's paper
function signed_rank.test(differences)
  local sizes, signs = {}, {}
  for _, difference in ipairs(differences) do
    if difference ~= 0 then
      sizes[#sizes + 1], signs[#signs + 1] = math.abs(difference), difference > 0
    end
  end
  local doubled = midranks.doubled(sizes)
  local probabilities, total = distribution(doubled)
  local positive = 0
  for i, rank in ipairs(doubled) do positive = positive + (signs[i] and rank or 0) end
  return { p = two_sided(probabilities, total, positive), positive = positive / 2,
    negative = (total - positive) / 2, n = #sizes, zeros = #differences - #sizes }
end

--- The smallest p of n pairs: all differences of one sign, 2 of 2^n.
function signed_rank.smallest_p(n) return math.min(1, 2 * 0.5 ^ n) end

--- The critical value: the test rejects at `level` if the smaller rank sum is at most this. For n
--- differences without ties; nil if the test cannot reject.
function signed_rank.critical(n, level)
  local doubled = {}
  for i = 1, n do doubled[i] = 2 * i end
  local probabilities, total = distribution(doubled)
  local p, found = 0, nil
  for s = 0, total / 2, 2 do
    p = p + 2 * probabilities[s]
    if p > level then break end
    found = s / 2
  end
  return found
end

return signed_rank
