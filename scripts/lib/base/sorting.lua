--- sorting.lua: the order of numbers, by a radix sort on arrays that LuaJIT compiles: `table.sort`
--- with a function takes twenty times as long.

local bit = require "bit"
local ffi = require "ffi"

local sorting = {}

-- Changes doubles so that their bits have their order as whole numbers: of a negative number all
-- bits are inverted, of another one the sign.
local function order_bits(keys, count)
  local halves = ffi.cast("int32_t *", keys)
  for i = 0, 2 * count - 1, 2 do
    local high = halves[i + 1]
    if high < 0 then
      halves[i], halves[i + 1] = bit.bnot(halves[i]), bit.bnot(high)
    else
      halves[i + 1] = bit.bxor(high, -2 ^ 31)
    end
  end
end

-- Where the next key goes, by the value of its digit.
local places = ffi.new "int32_t[257]"

-- Orders `from` into `to` by one byte of the keys, equal ones as they were. Returns false if all
-- are equal.
local function pass(bytes, from, to, count)
  ffi.fill(places, ffi.sizeof(places))
  for i = 0, 8 * (count - 1), 8 do places[bytes[i] + 1] = places[bytes[i] + 1] + 1 end
  if places[bytes[0] + 1] == count then return false end
  for d = 1, 255 do places[d] = places[d] + places[d - 1] end
  for k = 0, count - 1 do
    local d = bytes[8 * from[k]]
    to[places[d]], places[d] = from[k], places[d] + 1
  end
  return true
end

-- The indices of `sign` times the values, of the smallest first.
local function order_of(values, sign)
  local count, order = #values, {}
  local keys = ffi.new("double[?]", count + 1)
  local from, to = ffi.new("int32_t[?]", count + 1), ffi.new("int32_t[?]", count + 1)
  -- the sum makes -0 a 0
  for i = 0, count - 1 do keys[i], from[i] = sign * values[i + 1] + 0, i end
  order_bits(keys, count)
  for byte = 0, 7 do -- the lowest first
    if pass(ffi.cast("uint8_t *", keys) + byte, from, to, count) then from, to = to, from end
  end
  for k = 1, count do order[k] = from[k - 1] + 1 end
  return order
end

--- The indices of `values`, of the smallest number first; equal ones in index order.
---@param values number[] none is not a number
function sorting.ascending(values) return order_of(values, 1) end

--- The same with the largest number first; equal ones in index order.
---@param values number[] none is not a number
function sorting.descending(values) return order_of(values, -1) end

return sorting
