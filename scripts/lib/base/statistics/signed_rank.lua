--- signed_rank.lua: Wilcoxon's signed-rank test of paired differences, exact with ties too: the
--- distribution over all 2^n signs of the mid-ranks at hand, by dynamic programming.
--- Source: Wilcoxon, "Individual comparisons by ranking methods" (1945).

local midranks = require "limax.base.statistics.midranks"

local signed_rank = {}

-- Chances of each sum of the doubled ranks with a positive sign, from 0; each sign is a fair coin.
-- A chance is a whole number over 2^n, and so exact up to n = 53.
local function distribution(doubled)
  local chances, total = { [0] = 1 }, 0
  for _, rank in ipairs(doubled) do
    for s = total + 1, total + rank do chances[s] = 0 end
    total = total + rank
    for s = total, 0, -1 do
      local with = s >= rank and chances[s - rank] or 0
      chances[s] = (chances[s] + with) / 2
    end
  end
  return chances, total
end

-- Chance of a sum at least as far from its mean, total/2, as `sum`.
local function two_sided(chances, total, sum)
  local far, p = math.abs(2 * sum - total), 0
  for s = 0, total do
    if math.abs(2 * s - total) >= far then p = p + chances[s] end
  end
  return math.min(p, 1)
end

---@class limax.statistics.signed_rank
---@field p number two-sided
---@field positive number sum of the ranks of the positive differences
---@field negative number sum of the ranks of the negative ones
---@field n integer differences that are not 0
---@field zeros integer differences that are 0: left out, as Wilcoxon did
---@field ties boolean

--- The exact two-sided test of differences whose median is 0 under the null hypothesis. Without a
--- difference other than 0, p is 1.
---@param differences number[]
---@return limax.statistics.signed_rank
function signed_rank.test(differences)
  local sizes, signs = {}, {}
  for _, difference in ipairs(differences) do
    if difference ~= 0 then
      sizes[#sizes + 1], signs[#signs + 1] = math.abs(difference), difference > 0
    end
  end
  local doubled, ties = midranks.doubled(sizes)
  local chances, total = distribution(doubled)
  local positive = 0
  for i, rank in ipairs(doubled) do positive = positive + (signs[i] and rank or 0) end
  return { p = two_sided(chances, total, positive), positive = positive / 2,
    negative = (total - positive) / 2, n = #sizes, zeros = #differences - #sizes, ties = ties }
end

--- The smallest p that n pairs can give: all differences of one sign, 2 of 2^n.
---@param n integer
---@return number
function signed_rank.smallest_p(n) return math.min(1, 2 * 0.5 ^ n) end

--- The largest smaller rank sum for which p is at most `level`, for n differences without ties; nil
--- where there is none. A sample rejects if the smaller of its two rank sums is at most that.
---@param n integer
---@param level number
---@return integer|nil
function signed_rank.critical(n, level)
  local doubled = {}
  for i = 1, n do doubled[i] = 2 * i end
  local chances, total = distribution(doubled)
  local p, found = 0, nil
  for s = 0, total / 2, 2 do
    p = p + 2 * chances[s]
    if p > level then break end
    found = s / 2
  end
  return found
end

return signed_rank
