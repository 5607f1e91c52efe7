--- xml.lua: texts inside XML that is written.

local xml = {}

local ESCAPES = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;" }

--- A text as XML has it, without what XML cannot hold.
---@param text string
---@return string
function xml.escaped(text)
  return (text:gsub("[%c]", " "):gsub('[&<>"]', ESCAPES))
end

return xml
