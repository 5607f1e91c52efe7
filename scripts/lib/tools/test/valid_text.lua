--- valid_text.lua: a text without the bytes that are no UTF-8, which neither JSON nor XML has a
--- place for: each run of them becomes a question mark.

-- Lengths of well-formed sequences: RFC 3629, without its finer rules for the second byte.
local SEQUENCES = {
  "^[\194-\223][\128-\191]", "^[\224-\239][\128-\191][\128-\191]",
  "^[\240-\244][\128-\191][\128-\191][\128-\191]",
}

-- Overlong forms, surrogates and what lies beyond U+10FFFF.
local FORBIDDEN = { "^\224[\128-\159]", "^\237[\160-\191]", "^\240[\128-\143]", "^\244[\144-\191]" }

local function sequence_at(bytes, at)
  for _, each in ipairs(FORBIDDEN) do
    if bytes:find(each, at) then return nil end
  end
  for _, each in ipairs(SEQUENCES) do
    local _, last = bytes:find(each, at)
    if last then return last end
  end
end

---@param text string
---@return string
return function(text)
  return (text:gsub("[\128-\255]+", function(bytes)
    local parts, at, broken = {}, 1, false
    while at <= #bytes do
      local last = sequence_at(bytes, at)
      if last then
        parts[#parts + 1] = bytes:sub(at, last)
      elseif not broken then
        parts[#parts + 1] = "?"
      end
      broken = not last
      at = (last or at) + 1
    end
    return table.concat(parts)
  end))
end
