--- sorting.lua: the order of numbers, by a merge sort on arrays that LuaJIT compiles: `table.sort`
--- with a function takes twenty times as long.

local ffi = require "ffi"

local sorting = {}

-- Merges the sorted runs from `first` and from `middle` to `last` (exclusive) into `to`.
local function merge(keys, from, to, first, middle, last)
  local left, right = first, middle
  for k = first, last - 1 do
    if left < middle and (right >= last or keys[from[left]] <= keys[from[right]]) then
      to[k], left = from[left], left + 1
    else
      to[k], right = from[right], right + 1
    end
  end
end

--- The indices of `values`, of the smallest number first; equal ones in index order.
function sorting.ascending(values)
  local count = #values
  local keys, from, to = ffi.new("double[?]", count + 1), ffi.new("int32_t[?]", count + 1),
    ffi.new("int32_t[?]", count + 1)
  for i = 1, count do keys[i], from[i - 1] = values[i], i end
  local width = 1
  while width < count do
    for first = 0, count - 1, 2 * width do
      merge(keys, from, to, first, math.min(first + width, count),
        math.min(first + 2 * width, count))
    end
    from, to, width = to, from, 2 * width
  end
  local order = {}
  for k = 1, count do order[k] = from[k - 1] end
  return order
end

--- The same with the largest number first; equal ones in index order.
function sorting.descending(values)
  local negated = {}
  for i = 1, #values do negated[i] = -values[i] end
  return sorting.ascending(negated)
end

return sorting
