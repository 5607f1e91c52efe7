--- redaction.lua: takes a key out of a text: as it is, in base64 (at any offset within a longer
--- text), percent-encoded, in hexadecimal, escaped as JSON does; whole or in pieces.

local base64 = require "limax.supervise.llm.base64"

local redaction = {}

--- What stands for what was taken out. It is legal inside a JSON string.
redaction.MARK = "[key]"

-- So many characters of a key are taken for the key where they stand in a row: its first ones, as
-- in "sk-proj-****", or any. Fewer, and words like the end of "no-key-required", occur by chance.
local BEGINNING, ANY = 8, 12

--- A shorter key is a placeholder, like "none", for a server that wants a key and looks at none. It
--- hides nothing and stays where it is.
redaction.SHORTEST = BEGINNING

-- The letters of base64 that depend on the key alone, for the three ways in which it can lie in a
-- longer text.
local function base64_forms(key)
  local forms = {}
  for offset = 0, 2 do
    local text = base64.encode(("\0"):rep(offset) .. key):gsub("=+$", "")
    -- letters that mix with what stands before; the last may mix with what stands after
    local first = ({ 1, 3, 4 })[offset + 1]
    local last = (#key + offset) % 3 == 0 and #text or #text - 1
    text = text:sub(first, last)
    forms[#forms + 1] = text
    forms[#forms + 1] = (text:gsub("%+", "-"):gsub("/", "_"))
  end
  return forms
end

local function percent(letter) return ("%%%02X"):format(letter:byte()) end

-- Forms in which a character of the key takes one letter, or now one and then more.
local function plain_forms(key)
  local some = key:gsub("[^%w%-._~]", percent)
  local forms = { key, some, (some:gsub("%%..", string.lower)), (key:gsub("/", "\\/")),
    (key:gsub('[\\"]', "\\%0")) }
  for _, form in ipairs(base64_forms(key)) do forms[#forms + 1] = form end
  return forms
end

-- Forms in which each character of the key takes the same number of letters.
local ESCAPES = { "%%%02X", "%%%02x", "%02X", "%02x", "\\u%04X", "\\u%04x" }

-- Where pieces of forms begin, by their text; `unit` letters stand for a character of the key.
local function group_of(forms, unit)
  local group = { unit = unit, starts = {}, lengths = { BEGINNING * unit, ANY * unit }, first = {} }
  local function enter(form, at, length)
    local piece = form:sub(at, at + length - 1)
    local places = group.starts[piece] or {}
    places[#places + 1] = { form = form, at = at }
    group.starts[piece], group.first[piece:byte()] = places, true
  end
  for _, form in ipairs(forms) do
    enter(form, 1, group.lengths[1])
    for at = 1, #form - group.lengths[2] + 1, unit do enter(form, at, group.lengths[2]) end
  end
  return group
end

local function groups_of(key)
  local groups = { group_of(plain_forms(key), 1) }
  for i = 1, #ESCAPES, 2 do
    local forms = {}
    for k = i, i + 1 do
      local function escape(letter) return ESCAPES[k]:format(letter:byte()) end
      forms[#forms + 1] = key:gsub(".", escape)
    end
    groups[#groups + 1] = group_of(forms, #forms[1] / #key)
  end
  return groups
end

-- How many letters of a text, from `i` on, belong to the key; 0: none.
local function matched(text, i, group)
  local longest = 0
  for _, length in ipairs(group.lengths) do
    for _, place in ipairs(group.starts[text:sub(i, i + length - 1)] or {}) do
      local count, unit = length, group.unit
      local form, at = place.form, place.at
      while at + count <= #form
        and text:sub(i + count, i + count + unit - 1) == form:sub(at + count, at + count + unit - 1)
      do
        count = count + unit
      end
      longest = math.max(longest, count)
    end
  end
  return longest
end

local function without(text, group)
  local first, parts, from, i = group.first, {}, 1, 1
  local last = #text - group.lengths[1] + 1
  while i <= last do
    local count = first[text:byte(i)] and matched(text, i, group) or 0
    if count > 0 then
      parts[#parts + 1] = text:sub(from, i - 1) .. redaction.MARK
      i = i + count
      from = i
    else
      i = i + 1
    end
  end
  if from == 1 then return text end
  return table.concat(parts) .. text:sub(from)
end

--- The function that takes this key out of a text; without a key, or with a placeholder, it changes
--- nothing.
---@param key string|nil
---@return fun(text: string): string
function redaction.of(key)
  if not key or #key < redaction.SHORTEST then return function(text) return text end end
  local groups = groups_of(key)
  return function(text)
    for _, group in ipairs(groups) do text = without(text, group) end
    return text
  end
end

return redaction
