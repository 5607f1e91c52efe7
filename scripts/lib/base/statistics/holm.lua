--- holm.lua: p values adjusted for multiple tests.
--- Source: Holm, "A simple sequentially rejective multiple test procedure" (1979).

local sorting = require "limax.base.sorting"

local holm = {}

--- The adjusted p values: the k-th smallest of m is multiplied by m - k + 1, and is at most 1 and
--- at least the adjusted value of a smaller one.
function holm.adjust(list)
  local adjusted, least = {}, 0
  for k, i in ipairs(sorting.ascending(list)) do
    least = math.max(least, math.min(1, (#list - k + 1) * list[i]))
    adjusted[i] = least
  end
  return adjusted
end

return holm
