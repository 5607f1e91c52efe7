--- redaction.lua: takes a key out of a text: as it is, in base64 (at any offset within a longer
--- text), percent-encoded, in hexadecimal, escaped as JSON does; whole, or 8 and more of its
--- characters in a row.

local base64 = require "limax.llm.base64"

local redaction = {}

--- What stands for what was taken out. It is legal inside a JSON string.
redaction.MARK = "[key]"

-- So many characters of a key in a row are taken for the key: fewer occur by chance.
local PIECE = 8

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

-- Forms whose pieces are 8 letters long: one letter, or more, for a character of the key.
local function plain_forms(key)
  local some = key:gsub("[^%w%-._~]", percent)
  local forms = { key, some, (some:gsub("%%..", string.lower)), (key:gsub("/", "\\/")),
    (key:gsub('[\\"]', "\\%0")) }
  for _, form in ipairs(base64_forms(key)) do forms[#forms + 1] = form end
  return forms
end

-- Forms in which each character of the key takes the same number of letters.
local ESCAPES = { "%%%02X", "%%%02x", "%02X", "%02x", "\\u%04X", "\\u%04x" }

-- Pieces of forms with `unit` letters for a character, by their text.
local function group_of(forms, unit, characters)
  local group = { unit = unit, long = unit * characters, pieces = {}, first = {} }
  for _, form in ipairs(forms) do
    for i = 1, #form - group.long + 1, unit do
      local piece = form:sub(i, i + group.long - 1)
      group.pieces[piece], group.first[piece:byte()] = true, true
    end
  end
  return group
end

local function groups_of(key)
  local characters = math.min(PIECE, #key)
  local groups = { group_of(plain_forms(key), 1, characters) }
  for i = 1, #ESCAPES, 2 do
    local forms = {}
    for k = i, i + 1 do
      local function escape(letter) return ESCAPES[k]:format(letter:byte()) end
      forms[#forms + 1] = key:gsub(".", escape)
    end
    groups[#groups + 1] = group_of(forms, #forms[1] / #key, characters)
  end
  return groups
end

local function without(text, group)
  local pieces, first, long, unit = group.pieces, group.first, group.long, group.unit
  local parts, from, i, last = {}, 1, 1, #text - long + 1
  while i <= last do
    if first[text:byte(i)] and pieces[text:sub(i, i + long - 1)] then
      -- as far as pieces follow each other
      local stop = i + long
      while pieces[text:sub(stop - long + unit, stop + unit - 1)] do stop = stop + unit end
      parts[#parts + 1] = text:sub(from, i - 1) .. redaction.MARK
      from, i = stop, stop
    else
      i = i + 1
    end
  end
  if from == 1 then return text end
  return table.concat(parts) .. text:sub(from)
end

--- The function that takes this key out of a text; without a key it changes nothing.
---@param key string|nil
---@return fun(text: string): string
function redaction.of(key)
  if not key then return function(text) return text end end
  local groups = groups_of(key)
  return function(text)
    for _, group in ipairs(groups) do text = without(text, group) end
    return text
  end
end

return redaction
