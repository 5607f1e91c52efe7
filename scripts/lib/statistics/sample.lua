--- sample.lua: numbers that describe a list of numbers.

local sample = {}

--- The middle of a list, or the mean of the two in the middle; nil of an empty one.
---@param list number[]
---@return number|nil
function sample.median(list)
  local sorted, n = { unpack(list) }, #list
  table.sort(sorted)
  if n == 0 then return nil end
  return (sorted[math.ceil(n / 2)] + sorted[math.floor(n / 2) + 1]) / 2
end

return sample
