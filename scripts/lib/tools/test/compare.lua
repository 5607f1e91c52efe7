--- compare.lua: compares numbers, tables and views element by element and describes differences,
--- the worst first.

local ffi = require "ffi"
local choice = require "limax.base.choice"
local engine = require "limax.engine"

local compare = {}

---@class limax.difference
---@field path string such as "[3][2]" or ".energy"; empty for the values themselves
---@field expected any
---@field got any
---@field text string|nil of a missing or an additional value
---@field excess number difference over what is allowed; infinite if nothing is

local bits = ffi.new "union { double number; uint64_t bits; }"

-- The 64 bits of a number as text.
local function bits_of(number)
  bits.number = number
  return bit.tohex(bits.bits, 16)
end

--- A value in full precision.
function compare.shown(value)
  if type(value) == "number" then return ("%.17g"):format(value) end
  if type(value) == "string" then return (("%q"):format(value):gsub("\\\n", "\\n")) end
  if type(value) == "table" then return "a table" end
  return tostring(value)
end

-- Keys of both tables, sorted.
local function keys_of(a, b)
  local keys = {}
  for key in pairs(a) do keys[key] = true end
  for key in pairs(b) do keys[key] = true end
  return choice.sorted_keys(keys)
end

local function step(path, key)
  if type(key) == "string" and key:match "^[%a_][%w_]*$" then return path .. "." .. key end
  return ("%s[%s]"):format(path, compare.shown(key))
end

local function plain(value)
  if engine.is_view(value) then return value:table() end
  return value
end

-- Walks both values together; `excess(expected, got)` compares leaves of one type and returns nil
-- if they agree.
local function walk(expected, got, path, excess, list)
  expected, got = plain(expected), plain(got)
  local function add(amount, text)
    list[#list + 1] =
      { path = path, expected = expected, got = got, text = text, excess = amount }
  end
  if type(expected) == "table" and rawequal(expected, got) then return list end
  if expected == nil or got == nil then
    if expected ~= got then
      add(math.huge, path ~= "" and (got == nil and "is missing" or "is not expected") or nil)
    end
  elseif type(expected) ~= type(got) then
    add(math.huge)
  elseif type(expected) == "table" then
    for _, key in ipairs(keys_of(expected, got)) do
      walk(expected[key], got[key], step(path, key), excess, list)
    end
  else
    local amount = excess(expected, got)
    if amount then add(amount) end
  end
  return list
end

-- The differences of two values, those of the largest excess first.
local function differences_of(expected, got, excess)
  local list = walk(expected, got, "", excess, {})
  for i, difference in ipairs(list) do difference.order = i end
  table.sort(list, function(a, b)
    if a.excess ~= b.excess then return a.excess > b.excess end
    return a.order < b.order
  end)
  return list
end

--- The places where two values are not equal; NaN equals NaN.
function compare.equal(expected, got)
  return differences_of(expected, got, function(a, b)
    return not (a == b or (a ~= a and b ~= b)) and math.huge or nil
  end)
end

--- The places where two values do not have the same bits.
function compare.same_bits(expected, got)
  return differences_of(expected, got, function(a, b)
    local same = a == b
    if type(a) == "number" then same = bits_of(a) == bits_of(b) end
    return not same and math.huge or nil
  end)
end

--- The places where numbers differ by more than atol + rtol |expected|, or other values are not
--- equal. NaN always differs.
---@param tolerance { rtol: number, atol: number }
function compare.near(expected, got, tolerance)
  return differences_of(expected, got, function(a, b)
    if a == b then return nil end
    if type(a) ~= "number" then return math.huge end
    local allowed = tolerance.atol + tolerance.rtol * math.abs(a)
    local difference = math.abs(a - b)
    if difference <= allowed and difference < math.huge then return nil end
    if difference ~= difference or allowed == 0 then return math.huge end
    return difference / allowed
  end)
end

-- ", relative 0.01" of two numbers.
local function relative(expected, got)
  if type(expected) ~= "number" or type(got) ~= "number" or expected == 0 then return "" end
  return (", relative %.3g"):format(math.abs((got - expected) / expected))
end

--- ".energy: 1 -> 1.01, relative 0.01" of one difference.
function compare.change(difference)
  return ("%s: %s -> %s%s"):format(difference.path, compare.shown(difference.expected),
    compare.shown(difference.got), relative(difference.expected, difference.got))
end

--- "expected 1, got 2; difference 1, relative 1" of one difference.
function compare.text(difference)
  local place = difference.path == "" and "" or difference.path .. ": "
  local expected, got = difference.expected, difference.got
  if difference.text then
    local value = got == nil and expected or got
    return ("%s%s (%s)"):format(place, difference.text, compare.shown(value))
  end
  local text = ("%sexpected %s, got %s"):format(place, compare.shown(expected), compare.shown(got))
  if type(expected) ~= "number" or type(got) ~= "number" then return text end
  return ("%s; difference %.3g%s"):format(text, math.abs(got - expected), relative(expected, got))
end

return compare
