--- midranks.lua: ranks of numbers; equal numbers share the mean of their ranks. Ranks are doubled,
--- which makes them whole numbers, so that their sums compare exactly.

local sorting = require "limax.base.sorting"

local midranks = {}

--- Twice the mid-rank of each number, from 1 for the smallest.
function midranks.doubled(list)
  local order, doubled, first = sorting.ascending(list), {}, 1
  while first <= #order do
    local last = first
    while last < #order and list[order[last + 1]] == list[order[first]] do last = last + 1 end
    for k = first, last do doubled[order[k]] = first + last end
    first = last + 1
  end
  return doubled
end

return midranks
