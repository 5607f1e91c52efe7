--- schema.lua: declarative checking of plain tables. A rule turns a given value into a resolved one
--- (defaults filled in) or says in one line what was expected and what came; unknown fields end
--- with the name that was probably meant.

local suggest = require "limax.base.suggest"

local schema = {}

--- A rule: `value, message = rule(given, path)`; a message means that `given` was refused. `path`
--- names the field in messages.
---@alias schema.rule fun(given: any, path: string): any, string|nil

--- A value as a message shows it: short, on one line.
---@param value any
---@return string
function schema.show(value)
  if type(value) == "string" then
    local text = #value > 40 and value:sub(1, 37) .. "..." or value
    return '"' .. text:gsub("[%c]", "?") .. '"'
  end
  if type(value) == "number" then return ("%.12g"):format(value) end
  if value == nil or type(value) == "boolean" then return tostring(value) end
  -- no `tostring`: it shows an address, or calls what a script has put there
  return "a " .. type(value)
end

--- "a whole number from 1 to 10 (voxels)" of a field of defaults.lua.
---@param field defaults.field
---@return string
function schema.expected(field)
  local parts = { field.integer and "a whole number" or "a number" }
  local from, to = field.minimum or field.above, field.maximum or field.below
  if field.minimum then parts[#parts + 1] = ("from %.12g"):format(from)
  elseif field.above then parts[#parts + 1] = ("above %.12g"):format(from) end
  if field.maximum then parts[#parts + 1] = ("%s %.12g"):format(from and "to" or "of at most", to)
  elseif field.below then
    parts[#parts + 1] = (from and "and below %.12g" or "below %.12g"):format(to)
  end
  if field.unit ~= "1" and field.unit ~= "" then parts[#parts + 1] = "(" .. field.unit .. ")" end
  return table.concat(parts, " ")
end

local function refused(path, expected, given)
  return nil, ("%s: expected %s, got %s"):format(path, expected, schema.show(given))
end

local function in_range(field, value)
  if type(value) ~= "number" or value ~= value then return false end
  if field.integer and value ~= math.floor(value) then return false end
  return not (field.minimum and value < field.minimum or field.above and value <= field.above
    or field.maximum and value > field.maximum or field.below and value >= field.below)
end

--- A number by a field of defaults.lua: finite, in its range, whole if it must be. Absent: the
--- field's default, which may be `override`.
---@param field defaults.field
---@param override? any
---@return schema.rule
function schema.number(field, override)
  return function(given, path)
    if given == nil then
      if override ~= nil then return override end
      return field.value
    end
    if not in_range(field, given) then return refused(path, schema.expected(field), given) end
    return given
  end
end

--- One word, or a number: `schema.word_or_number("auto", field)`.
---@param word string
---@param field defaults.field
---@return schema.rule
function schema.word_or_number(word, field)
  return function(given, path)
    if given == nil or given == word then return given end
    if not in_range(field, given) then
      return refused(path, ('"%s" or %s'):format(word, schema.expected(field)), given)
    end
    return given
  end
end

---@param default boolean
---@return schema.rule
function schema.boolean(default)
  return function(given, path)
    if given == nil then return default end
    if type(given) ~= "boolean" then return refused(path, "true or false", given) end
    return given
  end
end

--- A text that matches a Lua pattern from end to end.
---@param pattern string
---@param expected string the pattern in words
---@return schema.rule
function schema.text(pattern, expected)
  return function(given, path)
    if given == nil then return nil end
    if type(given) ~= "string" or not given:match("^" .. pattern .. "$") then
      return refused(path, expected, given)
    end
    return given
  end
end

--- One of a list of words; absent stays absent.
---@param words string[]
---@return schema.rule
function schema.choice(words)
  local quoted = {}
  for i, word in ipairs(words) do quoted[i] = '"' .. word .. '"' end
  local expected = "one of " .. table.concat(quoted, ", ")
  return function(given, path)
    if given == nil then return nil end
    for _, word in ipairs(words) do
      if given == word then return given end
    end
    local nearest = suggest(given, words)
    local message = ("%s: expected %s, got %s"):format(path, expected, schema.show(given))
    return nil, nearest and ('%s; did you mean "%s"?'):format(message, nearest) or message
  end
end

-- Number of entries of a list, or nil when `value` is no list: any key that is not 1, 2, ... n.
local function list_size(value)
  if type(value) ~= "table" then return nil end
  local keys = 0
  for _ in pairs(value) do keys = keys + 1 end
  return keys == #value and keys or nil
end
schema.list_size = list_size

--- A list whose entries all follow one rule. `count` fixes its length, else anything up to `most`;
--- absent: a copy of `default`.
---@param rule schema.rule
---@param options { count?: integer, most?: integer, default?: table, expected: string }
---@return schema.rule
function schema.list(rule, options)
  return function(given, path)
    if given == nil then given = options.default end
    if given == nil then return nil end
    local size = list_size(given)
    local wrong = not size or options.count and size ~= options.count
    if wrong or options.most and size > options.most then
      local came = size and ("%d entries"):format(size) or schema.show(given)
      return nil, ("%s: expected %s, got %s"):format(path, options.expected, came)
    end
    local result = {}
    for i = 1, size do
      local value, message = rule(given[i], ("%s[%d]"):format(path, i))
      if message then return nil, message end
      result[i] = value
    end
    return result
  end
end

--- The keys of a table, texts, sorted; `nil, message` when one of them is no text.
---@param given table
---@param path string
---@return string[]|nil
---@return string|nil
function schema.names(given, path)
  local names = {}
  for key in pairs(given) do
    if type(key) ~= "string" then
      return nil, ("%s: expected named fields, got an entry without a name"):format(path)
    end
    names[#names + 1] = key
  end
  table.sort(names)
  return names
end

--- A table of named fields, each with its rule; absent: as if empty. Unknown names are refused with
--- a suggestion.
---@param fields table<string, schema.rule>
---@return schema.rule
function schema.fields(fields)
  local known = {}
  for name in pairs(fields) do known[#known + 1] = name end
  table.sort(known)
  return function(given, path)
    if given == nil then given = {} end
    if type(given) ~= "table" then
      return nil, ("%s: expected a table, got %s")
        :format(path == "" and "experiment" or path, schema.show(given))
    end
    local prefix = path == "" and "" or path .. "."
    local names, message = schema.names(given, path == "" and "experiment" or path)
    if not names then return nil, message end
    for _, name in ipairs(names) do
      if not fields[name] then
        return nil, ("%s: unknown field%s"):format(prefix .. name, suggest.ending(name, known))
      end
    end
    local result = {}
    for _, name in ipairs(known) do
      local value, refusal = fields[name](given[name], prefix .. name)
      if refusal then return nil, refusal end
      result[name] = value
    end
    return result
  end
end

return schema
