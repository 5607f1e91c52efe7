--- text.lua: texts of a model made safe to print and record: cut to a length, without control
--- characters, without the key.

local base64 = require "limax.base.base64"
local terminal = require "limax.base.terminal"

local text = {}

-- ---- length and control characters --------------------------------------------------------------

--- The beginning of a text in UTF-8, cut between characters.
---@param longest integer bytes
function text.beginning(value, longest)
  if #value <= longest then return value end
  while longest > 0 and value:byte(longest + 1) >= 0x80 and value:byte(longest + 1) < 0xc0 do
    longest = longest - 1
  end
  return value:sub(1, longest)
end

-- Control characters of ASCII, C1 controls, line separators, marks that change the direction of
-- writing (U+0080 to U+009F, U+2028 to U+202E, U+2066 to U+2069 in UTF-8).
local CONTROLS = { "[%c\127]+", "\194[\128-\159]", "\226\128[\168-\174]", "\226\129[\166-\169]" }

--- A text as one line of UTF-8 without control characters.
---@param longest integer bytes
function text.line(value, longest)
  for _, control in ipairs(CONTROLS) do value = value:gsub(control, " ") end
  return text.beginning(terminal.utf8(value), longest)
end

-- ---- the key ------------------------------------------------------------------------------------

--- Replaces a key. It is legal inside a JSON string.
text.MARK = "[key]"

--- A shorter key is a placeholder for a server that wants a key and checks none: it is not hidden.
--- Of a longer one, so many characters from its beginning are taken for the key ("sk-proj-****").
text.SHORTEST_KEY = 8
-- Characters in a row from the rest of a key that are taken for it; fewer occur by chance.
local SHORTEST_PIECE = 12

-- How a key may be escaped: the characters, and the format of each.
local ESCAPES = { { ".", "%%%02X" }, { ".", "%%%02x" }, { ".", "%02X" }, { ".", "%02x" },
  { ".", "\\u%04X" }, { ".", "\\u%04x" }, { "[^%w%-._~]", "%%%02X" }, { "[^%w%-._~]", "%%%02x" },
  { "/", "\\%c" }, { '[\\"]', "\\%c" } }

-- The key as it may be written in a text: { form, length of the shortest beginning }.
local function forms_of(key)
  local forms = { { key, text.SHORTEST_KEY } }
  for _, row in ipairs(ESCAPES) do
    local function escaped(part)
      return (part:gsub(row[1], function(character) return row[2]:format(character:byte()) end))
    end
    forms[#forms + 1] = { escaped(key), #escaped(key:sub(1, text.SHORTEST_KEY)) }
  end
  -- the letters of base64 that depend on the key only, for its three offsets in a longer text
  for offset = 0, 2 do
    local form = base64.encode(("\0"):rep(offset) .. key):gsub("=+$", "")
    form = form:sub(({ 1, 3, 4 })[offset + 1], (#key + offset) % 3 == 0 and -1 or -2)
    local shortest = math.floor(text.SHORTEST_KEY * 4 / 3) - 1
    forms[#forms + 1] = { form, shortest }
    forms[#forms + 1] = { form:gsub("%+", "-"):gsub("/", "_"), shortest }
  end
  for at = 2, #key - SHORTEST_PIECE + 1 do forms[#forms + 1] = { key:sub(at), SHORTEST_PIECE } end
  return forms
end

-- How much of a form a text has at `at`, bytes; 0 for less than its shortest beginning.
local function matched(value, at, form, shortest)
  local length = 0
  while length < #form and value:byte(at + length) == form:byte(length + 1) do
    length = length + 1
  end
  return length >= shortest and length or 0
end

-- The text with the longest of all forms replaced wherever the beginning of form `k` is.
local function without(value, forms, k)
  local beginning, parts, from = forms[k][1]:sub(1, forms[k][2]), {}, 1
  for at in function() return (value:find(beginning, from, true)) end do
    local length = 0
    for _, form in ipairs(forms) do
      length = math.max(length, matched(value, at, form[1], form[2]))
    end
    parts[#parts + 1] = value:sub(from, at - 1)
    from = at + length
  end
  parts[#parts + 1] = value:sub(from)
  return table.concat(parts, text.MARK)
end

--- The function that takes this key out of a text: in plain form, percent-encoded, in hexadecimal,
--- escaped as in JSON, in base64; whole, or its first 8 characters and what follows of it; in plain
--- form also any 12 characters in a row.
---@param key string|nil nil, or a placeholder: texts stay as they are
---@return fun(value: string): string
function text.redactor(key)
  if not key or #key < text.SHORTEST_KEY then return function(value) return value end end
  local forms = forms_of(key)
  return function(value)
    for k = 1, #forms do value = without(value, forms, k) end
    return value
  end
end

return text
