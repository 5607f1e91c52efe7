--- schema.lua: the validator of everything that a script hands to limax. A rule returns the value,
--- completed with defaults, or a message with what was expected; `schema.demand` raises the message
--- at the user's line.

local fault = require "limax.engine.fault"
local host = require "limax.host"
local suggest = require "limax.engine.suggest"

local schema = {}

--- `result, message = rule(value, path)`; `message` is nil for a valid value. `path` names the
--- field in messages. Most rules take nil as "absent" and return their default. The functions below
--- that describe a kind of value return its rule.
---@alias schema.rule fun(value: any, path: string): any, string|nil

-- Stand for a required value that is nil, so that rules refuse it.
local absent, missing = newproxy(), newproxy()

--- A value as messages show it: short, on one line.
function schema.show(value)
  if value == absent or value == missing then return "nil" end
  if value == host.json.null then return "null" end
  if type(value) == "string" then
    local text = #value > 40 and value:sub(1, 37) .. "..." or value
    return '"' .. text:gsub("[%c]", "?") .. '"'
  end
  if type(value) == "number" then return ("%.12g"):format(value) end
  if value == nil or type(value) == "boolean" or type(value) == "cdata" then
    return tostring(value)
  end
  -- a view of the engine, such as a trace
  if type(value) == "userdata" and not tostring(value):find "0x" then return tostring(value) end
  -- no `tostring`: it shows an address, or calls a metamethod of the script
  return "a " .. type(value)
end

-- `nil, message` about a value; of a list with a wrong number of entries `count` is shown.
local function refused(path, expected, value, count)
  if value == missing then return nil, ("%s: is missing; expected %s"):format(path, expected) end
  return nil, ("%s: expected %s, got %s"):format(path, expected,
    count and ("%d entries"):format(count) or schema.show(value))
end

--- Raises "PATH: expected EXPECTED, got VALUE" at the user's line.
---@param count? integer|false of the entries, where that is what is wrong with a list
function schema.refuse(path, expected, value, count)
  fault.raise(select(2, refused(path, expected, value, count)))
end

--- The rule of a value that is checked where it is used.
function schema.any(value) return value end

--- Checks a required value; raises at the user's line.
function schema.demand(rule, value, path)
  local result, message = rule(value, path)
  if result == nil and not message then message = select(2, rule(absent, path)) end
  if message then fault.raise(message) end
  return result
end

--- The rule of a required value.
function schema.required(rule)
  return function(value, path)
    if value ~= nil then return rule(value, path) end
    local _, message = rule(missing, path)
    return nil, message or path .. ": is missing"
  end
end

-- The rule of values that pass a test; `default` for nil.
local function optional(test, expected, default)
  return function(value, path)
    if value == nil then return default end
    if test(value) then return value end
    return refused(path, expected, value)
  end
end

-- ---- numbers ------------------------------------------------------------------------------------

---@class limax.range
---@field minimum? number inclusive
---@field above? number exclusive lower end
---@field maximum? number inclusive
---@field below? number exclusive upper end
---@field integer? boolean
---@field unit? string "1" for a pure number
---@field value? any the default

--- "a whole number from 1 to 10 (voxels)".
function schema.expected(field)
  local parts = { field.integer and "a whole number" or "a number" }
  local from, to = field.minimum or field.above, field.maximum or field.below
  if field.minimum then parts[#parts + 1] = ("from %.12g"):format(from)
  elseif field.above then parts[#parts + 1] = ("above %.12g"):format(from) end
  if field.maximum then parts[#parts + 1] = ("%s %.12g"):format(from and "to" or "of at most", to)
  elseif field.below then
    parts[#parts + 1] = (from and "and below %.12g" or "below %.12g"):format(to)
  end
  local unit = field.unit or ""
  if unit ~= "1" and unit ~= "" then parts[#parts + 1] = "(" .. unit .. ")" end
  return table.concat(parts, " ")
end

local function in_range(field, value)
  if type(value) ~= "number" or value ~= value or math.abs(value) == math.huge then return false end
  -- beyond 2^53 whole numbers are not exact
  local exact = value == math.floor(value) and math.abs(value) <= 2 ^ 53
  if field.integer and not exact then return false end
  return not (field.minimum and value < field.minimum or field.above and value <= field.above
    or field.maximum and value > field.maximum or field.below and value >= field.below)
end

--- A finite number of a range. Absent: the range's default, or `default`.
function schema.number(field, default)
  if default == nil then default = field.value end
  return optional(function(value) return in_range(field, value) end, schema.expected(field),
    default)
end

-- A number that switches something on.
local function switch(default)
  return optional(function(value) return value == 0 or value == 1 end, "0 or 1", default)
end

--- A number, or a list of three, of a field of the engine.
function schema.field(field, default)
  if field.switch then return switch(default or field.value[1]) end
  if field.components ~= 3 then return schema.number(field, default) end
  local part = {}
  for key, value in pairs(field) do part[key] = key ~= "value" and value or nil end
  return schema.list(schema.number(part), { count = 3, default = default or field.value,
    expected = ("a list { x, y, z } in %s"):format(field.unit) })
end

--- A whole number.
function schema.whole(minimum, maximum, default)
  return schema.number({ integer = true, minimum = minimum, maximum = maximum }, default)
end

--- One word, or a number: `schema.word_or_number("auto", field)`.
function schema.word_or_number(word, field)
  return optional(function(value) return value == word or in_range(field, value) end,
    ('"%s" or %s'):format(word, schema.expected(field)))
end

--- A 1-based index into something that has `count` entries; raises at the user's line. `path` may
--- be a format of the values that follow.
function schema.index(path, value, count, ...)
  if type(value) ~= "number" or value < 1 or value > count or value ~= math.floor(value) then
    schema.refuse(path:format(...), count == 0 and "an index, but there is none"
      or ("an index from 1 to %d"):format(count), value)
  end
  return value
end

local MOST_SEED = "18446744073709551615" -- 2^64 - 1

--- A seed: a whole number up to 2^53, its digits as text up to 2^64 - 1, or a uint64_t. Digits that
--- a number holds exactly become one.
---@return string|nil message
function schema.seed(value, path)
  if type(value) == "cdata" and tostring(value):match "^%d+ULL$" then return value end
  local digits = type(value) == "string" and value:match "^0*(%d+)$"
  -- texts of equal length compare as their numbers do
  if digits and (#digits < #MOST_SEED or #digits == #MOST_SEED and digits <= MOST_SEED) then
    return tonumber(digits) < 2 ^ 53 and tonumber(digits) or digits
  end
  if value == nil or in_range({ integer = true, minimum = 0, maximum = 2 ^ 53 }, value) then
    return value
  end
  return refused(path, "a whole number from 0 to 2^53, or its digits as text up to " .. MOST_SEED,
    value)
end

--- A seed as the engine takes it; raises at the user's line.
---@return ffi.cdata* uint64_t
function schema.uint64(value, path)
  value = schema.demand(schema.seed, value, path)
  if type(value) ~= "string" then return value + 0ULL end
  local number = 0ULL
  for digit in value:gmatch "%d" do number = number * 10 + tonumber(digit) end
  return number
end

-- ---- other values -------------------------------------------------------------------------------

function schema.boolean(default)
  return optional(function(value) return type(value) == "boolean" end, "true or false", default)
end

--- A text that matches a Lua pattern from end to end.
---@param expected string the pattern in words
function schema.text(pattern, expected)
  return optional(function(value)
    return type(value) == "string" and value:match("^" .. pattern .. "$")
  end, expected)
end

--- Any text.
schema.string = schema.text(".*", "a text")

--- The path of a file.
schema.path = schema.text("[^%z]+", "the path of a file")

--- Any table.
schema.table = optional(function(value) return type(value) == "table" end, "a table")

--- One of a list of words; absent stays absent.
function schema.choice(words)
  local quoted = {}
  for i, word in ipairs(words) do quoted[i] = '"' .. word .. '"' end
  local expected = "one of " .. table.concat(quoted, ", ")
  return function(value, path)
    if value == nil then return nil end
    for _, word in ipairs(words) do
      if value == word then return value end
    end
    local nearest = suggest.nearest(value, words)
    local _, message = refused(path, expected, value)
    return nil, nearest and ('%s; did you mean "%s"?'):format(message, nearest) or message
  end
end

-- ---- tables -------------------------------------------------------------------------------------

--- The number of entries of a list; nil for a value that is not a list: one with any key besides 1,
--- 2, ... n.
function schema.list_size(value)
  if type(value) ~= "table" then return nil end
  local keys = 0
  for _ in pairs(value) do keys = keys + 1 end
  return keys == #value and keys or nil
end

--- A list whose entries all follow one rule. `count` fixes its length, `most` limits it; absent: a
--- copy of `default`.
---@param options { count?: integer, most?: integer, default?: table, expected: string }
function schema.list(rule, options)
  return function(value, path)
    if value == nil then value = options.default end
    if value == nil then return nil end
    local size = schema.list_size(value)
    if not size or options.count and size ~= options.count
      or options.most and size > options.most then
      return refused(path, options.expected, value, size)
    end
    local result = {}
    for i = 1, size do
      local entry, message = rule(value[i], path)
      -- the place, which takes time to format, is only needed here
      if message then return rule(value[i], ("%s[%d]"):format(path, i)) end
      result[i] = entry
    end
    return result
  end
end

--- Exactly `count` finite numbers.
---@param field? limax.range of each
function schema.numbers(count, field)
  return schema.list(schema.number(field or {}),
    { count = count, expected = ("a list of %d numbers"):format(count) })
end

--- The keys of a table, texts, sorted; `nil, message` when one of them is not a text.
function schema.names(value, path)
  local names = {}
  for key in pairs(value) do
    if type(key) ~= "string" then
      return nil, ("%s: expected named fields, got an entry without a name"):format(path)
    end
    names[#names + 1] = key
  end
  table.sort(names)
  return names
end

-- The message about the first name of `names` that is not a key of `fields`.
local function unknown(names, fields, path, ending)
  for _, name in ipairs(names) do
    if fields[name] == nil then
      return ("%s%s: unknown field%s"):format(path == "" and "" or path .. ".", name,
        ending and ending(name) or suggest.ending(name, schema.names(fields, path)))
    end
  end
end

--- Raises at the user's line unless every name of a table is a key of `fields`.
---@param fields table<string, any>
---@param ending? fun(name: string): string|nil ends the message about an unknown name instead of a
--- suggestion
---@return string[] names sorted
function schema.known(value, fields, path, ending)
  local names, message = schema.names(value, path)
  message = message or unknown(names, fields, path, ending)
  if message then fault.raise(message) end
  return names
end

--- A table of named fields, each with its rule; absent: as if empty. Unknown names are refused with
--- a suggestion.
---@param fields table<string, schema.rule>
---@param ending? fun(name: string): string|nil ends the message about an unknown name instead
function schema.fields(fields, ending)
  local known = schema.names(fields, "")
  return function(value, path)
    if value == nil then value = {} end
    local title = path == "" and "experiment" or path
    if type(value) ~= "table" then return refused(title, "a table", value) end
    local prefix = path == "" and "" or path .. "."
    local names, message = schema.names(value, title)
    message = message or unknown(names, fields, path, ending)
    if message then return nil, message end
    local result = {}
    for _, name in ipairs(known) do
      local entry, refusal = fields[name](value[name], prefix .. name)
      if refusal then return nil, refusal end
      result[name] = entry
    end
    return result
  end
end

-- The rule of a table that is returned itself, without defaults. `check(value, path)` returns the
-- message about an entry.
local function table_rule(check)
  return function(value, path)
    if value == nil then return nil end
    if type(value) ~= "table" then return refused(path, "a table", value) end
    local message = check(value, path)
    if message then return nil, message end
    return value
  end
end

--- A table of a file: its named fields follow their rules, and others are kept.
---@param fields table<string, schema.rule>
function schema.record(fields)
  local known = schema.names(fields, "")
  return table_rule(function(value, path)
    local prefix = path == "" and "" or path .. "."
    for _, name in ipairs(known) do
      local _, message = fields[name](value[name], prefix .. name)
      if message then return message end
    end
  end)
end

--- A table whose entries have any names and follow one rule.
function schema.map(rule)
  return table_rule(function(value, path)
    local names, message = schema.names(value, path)
    for _, name in ipairs(names or {}) do
      message = select(2, rule(value[name], path .. "." .. name))
      if message then break end
    end
    return message
  end)
end

return schema
