--- base64.lua: bytes as base64 text (RFC 4648, section 4).

local bit = require "bit"

local LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"

local function letter(value)
  local index = bit.band(value, 63) + 1
  return LETTERS:sub(index, index)
end

local base64 = {}

---@return string text padded with "="
function base64.encode(bytes)
  local parts = {}
  for i = 1, #bytes, 3 do
    local a, b, c = bytes:byte(i, i + 2)
    local three = a * 65536 + (b or 0) * 256 + (c or 0)
    parts[#parts + 1] = letter(bit.rshift(three, 18)) .. letter(bit.rshift(three, 12))
      .. (b and letter(bit.rshift(three, 6)) or "=") .. (c and letter(three) or "=")
  end
  return table.concat(parts)
end

return base64
