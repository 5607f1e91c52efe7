--- rank_sum.lua: the Mann-Whitney test of two independent samples, exact also with ties: the
--- distribution over all C(n+m, n) splits of the observed mid-ranks, by dynamic programming; and
--- the effect size A12. Sources: Mann, Whitney, "On a test of whether one of two random variables
--- is stochastically larger than the other" (1947); Vargha, Delaney, "A critique and improvement of
--- the CL common language effect size statistics" (2000).

local midranks = require "limax.base.statistics.midranks"

local rank_sum = {}

-- The number of choices of n of the doubled ranks by their sum, from 0; and the sum of all ranks.
-- Doubles hold the counts to 16 digits, up to about 1000 ranks.
local function choices(doubled, n)
  local counts, total = {}, 0
  for _, rank in ipairs(doubled) do total = total + rank end
  for k = 0, n do
    counts[k] = {}
    for s = 0, total do counts[k][s] = 0 end
  end
  counts[0][0] = 1
  local partial = 0
  for i, rank in ipairs(doubled) do
    partial = partial + rank
    for k = math.min(i, n), 1, -1 do
      local into, from = counts[k], counts[k - 1]
      for s = partial, rank, -1 do into[s] = into[s] + from[s - rank] end
    end
  end
  return counts[n], total
end

--- The exact two-sided test: the probability over all splits of a U at least as far from its mean.
---@param first number[] not empty
---@param second number[] not empty
---@return { p: number, u: number, a12: number } two-sided p; pairs in which the value of the first
--- sample is larger, equal pairs count half; u / (n m), the probability of such a pair
function rank_sum.test(first, second)
  local n, m, all = #first, #second, {}
  for _, value in ipairs(first) do all[#all + 1] = value end
  for _, value in ipairs(second) do all[#all + 1] = value end
  local doubled = midranks.doubled(all)
  local sum = 0
  for i = 1, n do sum = sum + doubled[i] end
  -- the mean of the doubled sum is a whole number
  local mean = n * (n + m + 1)
  local counts, total = choices(doubled, n)
  local far, whole = 0, 0
  for s = 0, total do
    whole = whole + counts[s]
    if math.abs(s - mean) >= math.abs(sum - mean) then far = far + counts[s] end
  end
  local u = sum / 2 - n * (n + 1) / 2
  return { p = far / whole, u = u, a12 = u / (n * m) }
end

-- C(n + m, n)
local function splits(n, m)
  local count = 1
  for k = 1, n do count = count * (m + k) / k end
  return count
end

--- The smallest p of samples of n and m: 2 of C(n+m, n) splits.
function rank_sum.smallest_p(n, m) return math.min(1, 2 / splits(n, m)) end

--- The critical value: the test rejects at `level` if min(U, n m - U) is at most this. For samples
--- without ties; nil if the test cannot reject.
function rank_sum.critical(n, m, level)
  local doubled = {}
  for i = 1, n + m do doubled[i] = 2 * i end
  local counts = choices(doubled, n)
  local p, found = 0, nil
  for u = 0, n * m / 2 do
    p = p + 2 * counts[2 * u + n * (n + 1)] / splits(n, m)
    if p > level then break end
    found = u
  end
  return found
end

return rank_sum
