--- sample.lua: summary statistics of a list of numbers.

local sample = {}

local function ascending(list)
  local sorted = { unpack(list) }
  table.sort(sorted)
  return sorted
end

--- The median; nil of an empty list.
function sample.median(list)
  local sorted, n = ascending(list), #list
  if n == 0 then return nil end
  return (sorted[math.ceil(n / 2)] + sorted[math.floor(n / 2) + 1]) / 2
end

--- The q-quantile of an ascending list, linear between neighbours (R's type 7).
---@param sorted number[] ascending, not empty
---@param q number 0 to 1
function sample.quantile(sorted, q)
  return sample.quantile_of(#sorted, function(k) return sorted[k] end, q)
end

--- The same of `count` numbers, of which `at(k)` is the k-th smallest.
---@param at fun(k: integer): number
function sample.quantile_of(count, at, q)
  local position = q * (count - 1) + 1
  local below = math.floor(position)
  local low, high = at(below), at(math.min(below + 1, count))
  return low + (position - below) * (high - low)
end

--- The mean; nil of an empty list.
function sample.mean(list)
  local sum = 0
  for _, value in ipairs(list) do sum = sum + value end
  return #list > 0 and sum / #list or nil
end

--- The interquartile mean: the mean without the lowest and the highest floor(n/4) values.
--- Source: Agarwal et al., "Deep RL at the edge of the statistical precipice" (2021).
function sample.interquartile_mean(list)
  local sorted, cut = ascending(list), math.floor(#list / 4)
  return sample.mean { unpack(sorted, cut + 1, #sorted - cut) }
end

--- Least number of values for the interquartile mean in reports: with fewer it drops one or none.
sample.LEAST_FOR_MEAN = 8

--- The centre in reports: the interquartile mean of 8 values or more, else the median.
---@return number|nil
---@return "interquartile mean"|"median" name
function sample.centre(list)
  if #list >= sample.LEAST_FOR_MEAN then
    return sample.interquartile_mean(list), "interquartile mean"
  end
  return sample.median(list), "median"
end

return sample
