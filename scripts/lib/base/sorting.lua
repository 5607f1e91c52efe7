--- sorting.lua: the order of numbers, by a radix sort on arrays that LuaJIT compiles: `table.sort`
--- with a function takes twenty times as long.

local bit = require "bit"
local ffi = require "ffi"

local sorting = {}

local band, bnot, bxor, rshift = bit.band, bit.bnot, bit.bxor, bit.rshift

-- A double by its halves, and what is sorted by it.
local row_of = ffi.typeof "struct { int32_t low, high, item; }"
local rows_of = ffi.typeof("$[?]", row_of)

-- Memory for two arrays of rows, which is kept: new pages may cost more time than the sort.
local kept = { count = 0 }

local function memory_of(count)
  if kept.count < count then
    kept.count = math.ceil(1.2 * count)
    kept.from, kept.to = rows_of(kept.count), rows_of(kept.count)
  end
  return kept.from, kept.to
end

-- Changes a double's bits so that they have its order as whole numbers, and back: of a negative
-- number all bits are inverted, of another one the sign.
local function ordered(low, high)
  if high < 0 then return bnot(low), bnot(high) end
  return low, bxor(high, -2 ^ 31)
end

local function restored(low, high)
  if high < 0 then return low, bxor(high, -2 ^ 31) end
  return bnot(low), bnot(high)
end

-- How many keys have each value of each byte, the lowest first, then where the next of these goes.
local places = ffi.new "int32_t[8][256]"

local function count_digits(rows, count)
  ffi.fill(places, ffi.sizeof(places))
  for k = 0, count - 1 do
    local low, high = rows[k].low, rows[k].high
    for byte = 0, 3 do
      local a, b = band(rshift(low, 8 * byte), 255), band(rshift(high, 8 * byte), 255)
      places[byte][a] = places[byte][a] + 1
      places[byte + 4][b] = places[byte + 4][b] + 1
    end
  end
end

-- Moves rows to their places by one byte of the keys, equal ones as they were.
local function pass(from, to, count, half, byte, at)
  local sum = 0
  for d = 0, 255 do at[d], sum = sum, sum + at[d] end
  for k = 0, count - 1 do
    local d = band(rshift(from[k][half], 8 * byte), 255)
    local place = at[d]
    to[place] = from[k]
    at[d] = place + 1
  end
end

--- Sorts numbers and the items beside them, of the smallest number first, or of the largest; equal
--- ones as they were. A key -0 becomes 0.
---@param keys ffi.cdata* double[count], none is not a number
---@param items ffi.cdata* int32_t[count]
---@param descending? boolean
function sorting.sort(keys, items, count, descending)
  if count == 0 then return end
  local from, to = memory_of(count)
  local halves, sign = ffi.cast("int32_t *", keys), descending and -1 or 1
  for k = 0, count - 1 do
    keys[k] = sign * keys[k] + 0 -- the sum makes -0 a 0
    from[k].low, from[k].high = ordered(halves[2 * k], halves[2 * k + 1])
    from[k].item = items[k]
  end
  count_digits(from, count)
  for byte = 0, 7 do
    local half = byte < 4 and "low" or "high"
    local first = band(rshift(from[0][half], 8 * (byte % 4)), 255)
    if places[byte][first] < count then -- not all are equal
      pass(from, to, count, half, byte % 4, places[byte])
      from, to = to, from
    end
  end
  for k = 0, count - 1 do
    halves[2 * k], halves[2 * k + 1] = restored(from[k].low, from[k].high)
    keys[k], items[k] = sign * keys[k] + 0, from[k].item
  end
end

-- The indices of a list of numbers, sorted.
local function order_of(values, descending)
  local count, order = #values, {}
  local keys, items = ffi.new("double[?]", count, values), ffi.new("int32_t[?]", count)
  for k = 1, count do items[k - 1] = k end
  sorting.sort(keys, items, count, descending)
  for k = 1, count do order[k] = items[k - 1] end
  return order
end

--- The indices of `values`, of the smallest number first; equal ones in index order.
---@param values number[] none is not a number
function sorting.ascending(values) return order_of(values, false) end

--- The same with the largest number first; equal ones in index order.
---@param values number[] none is not a number
function sorting.descending(values) return order_of(values, true) end

return sorting
