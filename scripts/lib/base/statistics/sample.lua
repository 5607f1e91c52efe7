--- sample.lua: numbers that describe a list of numbers.

local sample = {}

local function ascending(list)
  local sorted = { unpack(list) }
  table.sort(sorted)
  return sorted
end

--- The middle of a list, or the mean of the two in the middle; nil of an empty one.
---@param list number[]
---@return number|nil
function sample.median(list)
  local sorted, n = ascending(list), #list
  if n == 0 then return nil end
  return (sorted[math.ceil(n / 2)] + sorted[math.floor(n / 2) + 1]) / 2
end

--- The mean; nil of an empty list.
---@param list number[]
---@return number|nil
function sample.mean(list)
  local sum = 0
  for _, value in ipairs(list) do sum = sum + value end
  return #list > 0 and sum / #list or nil
end

--- The interquartile mean: that of what is left without the lowest and the highest floor(n/4).
--- Source: Agarwal et al., "Deep RL at the edge of the statistical precipice" (2021).
---@param list number[]
---@return number|nil
function sample.interquartile_mean(list)
  local sorted, cut = ascending(list), math.floor(#list / 4)
  return sample.mean { unpack(sorted, cut + 1, #sorted - cut) }
end

--- Runs from which the interquartile mean is told: below, its cut of n/4 is one run or none.
sample.LEAST_FOR_MEAN = 8

--- The centre that reports tell: the interquartile mean of 8 numbers or more, else the median.
---@param list number[]
---@return number|nil
---@return "interquartile mean"|"median" name
function sample.centre(list)
  if #list >= sample.LEAST_FOR_MEAN then
    return sample.interquartile_mean(list), "interquartile mean"
  end
  return sample.median(list), "median"
end

return sample
