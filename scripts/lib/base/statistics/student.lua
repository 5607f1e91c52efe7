--- student.lua: Student's t distribution for whole degrees of freedom, and confidence intervals of
--- a mean. Sources: Student, "The probable error of a mean" (1908); Abramowitz and Stegun,
--- "Handbook of mathematical functions" (1964), 26.7.3 and 26.7.4, the finite series used here.

local sample = require "limax.base.statistics.sample"

local student = {}

--- The probability of |T| < t.
---@param t number at least 0
---@param freedom integer degrees of freedom, 1 or more
function student.within(t, freedom)
  local angle = math.atan(t / math.sqrt(freedom))
  local cosine, sine = math.cos(angle), math.sin(angle)
  local odd = freedom % 2 == 1
  local term, sum = odd and cosine or 1, 0
  for k = odd and 1 or 0, freedom - 2, 2 do
    sum = sum + term
    term = term * cosine * cosine * (k + 1) / (k + 2)
  end
  if odd then return 2 / math.pi * (angle + sine * sum) end
  return sine * sum
end

--- The t for which |T| < t has this probability.
---@param probability number above 0, below 1
function student.quantile(probability, freedom)
  local low, high = 0, 1
  while student.within(high, freedom) < probability do high = 2 * high end
  for _ = 1, 60 do
    local middle = (low + high) / 2
    if student.within(middle, freedom) < probability then low = middle else high = middle end
  end
  return (low + high) / 2
end

--- The mean of a list and the half width of its confidence interval.
---@param list number[] two or more
---@param confidence number 0 to 1
function student.interval(list, confidence)
  local mean, sum, n = sample.mean(list), 0, #list
  for _, value in ipairs(list) do sum = sum + (value - mean) ^ 2 end
  return mean, student.quantile(confidence, n - 1) * math.sqrt(sum / (n - 1) / n)
end

return student
