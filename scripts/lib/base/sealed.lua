--- sealed.lua: JSON objects whose first field, `hash`, is a hash of all that follows it, so that a
--- change of any byte is found, without decoding.
---
---   {"hash":"2d06800538d394c2","repetition":1}
---
--- The hash is the XXH3 (64 bits, 16 hexadecimal digits) of the bytes after its closing quote up to
--- the end, without a line break there: here of `,"repetition":1}`.

local host = require "limax.host"

local sealed = {}

local OPENING = '{"hash":"'
local FIRST = #OPENING + 1  -- digit
local REST = FIRST + 16 + 1 -- byte that the hash is of

-- The last byte before a line break at the end.
local function end_of(text) return text:sub(-1) == "\n" and #text - 1 or #text end

--- Adds the hash to an encoded object.
---@param json string may end in a line break, which it keeps
function sealed.add(json)
  local last = end_of(json)
  local rest = (json:find "^{%s*}" and "" or ",") .. json:sub(2, last)
  return OPENING .. host.xxh3(rest) .. '"' .. rest .. json:sub(last + 1)
end

-- The text after the hash; nil if the hash does not match it.
local function checked(line)
  if line:sub(1, #OPENING) ~= OPENING or line:sub(REST - 1, REST - 1) ~= '"' then return nil end
  local rest = line:sub(REST, end_of(line))
  return host.xxh3(rest) == line:sub(FIRST, REST - 2) and rest or nil
end

--- Does a line match its hash?
---@param line string with or without its line break
function sealed.check(line) return checked(line) ~= nil end

--- The object of a line, without `hash`.
---@param line string with or without its line break
---@return table|nil
---@return string|nil reason
function sealed.open(line)
  local rest = checked(line)
  if not rest then return nil, "does not match its hash" end
  return host.json.decode("{" .. rest:gsub("^,", "", 1))
end

return sealed
