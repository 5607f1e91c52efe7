--- xml.lua: elements and texts of XML files that are written.

local xml = {}

xml.HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'

local ESCAPES = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;" }

--- A text with XML's special characters escaped and control characters replaced by blanks.
function xml.escaped(text)
  return (text:gsub("[%c]", " "):gsub('[&<>"]', ESCAPES))
end

--- An element around lines of content.
function xml.element(tag, ...)
  return ("<%s>\n%s\n</%s>"):format(tag, table.concat({ ... }, "\n"), tag:match "^%S+")
end

return xml
