--- arguments.lua: checks of what a script hands to the engine. Every refusal says which argument,
--- what was expected and what came, at the caller's line. Ranges that the engine knows are left to
--- the engine.

local fault = require "limax.engine.fault"
local suggest = require "limax.base.suggest"

local arguments = {}

--- A value as a message shows it.
---@param value any
---@return string
function arguments.shown(value)
  local kind = type(value)
  if kind == "string" then
    if #value > 60 then value = value:sub(1, 57) .. "..." end
    return ("%q"):format(value):gsub("\\\n", "\\n")
  elseif kind == "number" then
    return ("%.14g"):format(value)
  elseif kind == "nil" or kind == "boolean" then
    return tostring(value)
  elseif kind == "cdata" then
    return tostring(value)
  end
  return "a " .. kind
end

--- Raises "WHAT: expected EXPECTED, got VALUE".
---@param what string
---@param expected string
---@param value any
function arguments.refuse(what, expected, value)
  fault.raise(("%s: expected %s, got %s"):format(what, expected, (arguments.shown(value))))
end
local refuse = arguments.refuse

--- The same about a list that has another length than `expected` says; `count` is nil or false
--- where `value` is no list at all.
---@param what string
---@param expected string
---@param count integer|false|nil
---@param value any
function arguments.refuse_count(what, expected, count, value)
  if not count then refuse(what, expected, value) end
  fault.raise(("%s: expected %s, got %d"):format(what, expected, count))
end

---@generic T
---@param what string
---@param value T
---@return T
function arguments.table(what, value)
  if type(value) ~= "table" then refuse(what, "a table", value) end
  return value
end

---@param what string
---@param value any
---@return string
function arguments.text(what, value)
  if type(value) ~= "string" then refuse(what, "a string", value) end
  return value
end

--- A finite number.
---@param what string
---@param value any
---@return number
function arguments.number(what, value)
  if type(value) ~= "number" or value ~= value or value == math.huge or value == -math.huge then
    refuse(what, "a finite number", value)
  end
  return value
end

---@param what string
---@param value any
---@param minimum number
---@param maximum number
---@return integer
function arguments.integer(what, value, minimum, maximum)
  if type(value) ~= "number" or value ~= math.floor(value) or value < minimum
    or value > maximum then
    refuse(what, ("an integer from %.0f to %.0f"):format(minimum, maximum), value)
  end
  return value
end

--- A 1-based index into something that has `count` entries.
---@param what string
---@param value any
---@param count integer
---@return integer
function arguments.index(what, value, count)
  if type(value) ~= "number" or value ~= math.floor(value) or value < 1 or value > count then
    refuse(what, count == 0 and "an index, but there is none"
      or ("an index from 1 to %d"):format(count), value)
  end
  return value
end

---@param what string
---@param value any
---@return boolean
function arguments.boolean(what, value)
  if type(value) ~= "boolean" then refuse(what, "true or false", value) end
  return value
end

--- A list of exactly `count` finite numbers (or integers of a range), as a new table.
---@param what string
---@param value any
---@param count integer
---@param minimum number|nil with `maximum`: integers of this range
---@param maximum number|nil
---@return number[]
function arguments.list(what, value, count, minimum, maximum)
  if type(value) ~= "table" or #value ~= count then
    arguments.refuse_count(what, ("a list of %d numbers"):format(count),
      type(value) == "table" and #value, value)
  end
  local list = {}
  for i = 1, count do
    local name = ("%s[%d]"):format(what, i)
    list[i] = minimum and arguments.integer(name, value[i], minimum, maximum)
      or arguments.number(name, value[i])
  end
  return list
end

--- Refuses a field that is not in `known`, with the nearest that is.
---@param what string
---@param given table
---@param known string[]
---@param hint? fun(value: any): string|nil what an unknown field may have been meant as
function arguments.known(what, given, known, hint)
  local is_known, unknown = {}, {}
  for _, name in ipairs(known) do is_known[name] = true end
  for name in pairs(given) do
    if not is_known[name] then unknown[#unknown + 1] = name end
  end
  if #unknown == 0 then return end
  -- the first in the alphabet, whatever the order of the table
  table.sort(unknown, function(a, b) return tostring(a) < tostring(b) end)
  local name = unknown[1]
  local meant = hint and hint(given[name])
  fault.raise(("%s: unknown field %s%s%s"):format(what, (arguments.shown(name)),
    suggest.ending(name, known), meant and "; " .. meant or ""))
end

--- The value of a name of an enumeration (see names.lua).
---@param what string
---@param value any
---@param enumeration table
---@return integer
function arguments.choice(what, value, enumeration)
  local number = type(value) == "string" and enumeration.value[value]
  if not number then
    local choices = {}
    for i, name in ipairs(enumeration.names) do choices[i] = ('"%s"'):format(name) end
    local expected = table.concat(choices, ", ", 1, #choices - 1) .. " or " .. choices[#choices]
    refuse(what, expected, value)
  end
  return number
end

--- A 64-bit seed: an integer below 2^53, a string of digits, or an unsigned 64-bit cdata.
---@param what string
---@param value number|string|ffi.cdata*
---@return ffi.cdata* uint64_t
function arguments.seed(what, value)
  local expected = "an integer from 0 to 2^53, or a string of digits below 2^64"
  if type(value) == "number" then
    if value < 0 or value > 2 ^ 53 or value ~= math.floor(value) then
      refuse(what, expected, value)
    end
    return value + 0ULL
  elseif type(value) == "string" then
    if not value:match "^%d+$" then refuse(what, expected, value) end
    local digits = value:gsub("^0+", "")
    -- 2^64 - 1 has 20 digits, and strings of equal length compare as their numbers do
    if #digits > 20 or (#digits == 20 and digits > "18446744073709551615") then
      refuse(what, expected, value)
    end
    local seed = 0ULL
    for digit in digits:gmatch "%d" do seed = seed * 10 + tonumber(digit) end
    return seed
  elseif type(value) == "cdata" and tostring(value):match "^%d+ULL$" then
    return value
  end
  return refuse(what, expected, value)
end

return arguments
