--- holm.lua: p values adjusted for multiple tests.
--- Source: Holm, "A simple sequentially rejective multiple test procedure" (1979).

local holm = {}

--- The adjusted p values: the k-th smallest of m is multiplied by m - k + 1, and is at most 1 and
--- at least the adjusted value of a smaller one.
---@return number[]
function holm.adjust(list)
  local order, adjusted, least = {}, {}, 0
  for i = 1, #list do order[i] = i end
  table.sort(order, function(i, j)
    if list[i] ~= list[j] then return list[i] < list[j] end
    return i < j
  end)
  for k, i in ipairs(order) do
    least = math.max(least, math.min(1, (#list - k + 1) * list[i]))
    adjusted[i] = least
  end
  return adjusted
end

return holm
