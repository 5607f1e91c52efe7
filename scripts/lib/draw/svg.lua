--- svg.lua: a page of SVG, written element by element. Coordinates are pixels of 1/96 inch, y
--- downwards.

local host = require "limax.host"

local svg = {}

---@class limax.svg
---@field parts string[]
local Page = {}
Page.__index = Page

-- Text as XML holds it: control characters, which it cannot hold, become question marks, and so do
-- the letters of a name that is no UTF-8, which a folder's may be.
local function escaped(text)
  local entities = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;" }
  text = tostring(text)
  if not pcall(host.json.encode, text) then text = text:gsub("[\128-\255]", "?") end
  return (text:gsub("[&<>\"]", entities):gsub("[%z\1-\8\11\12\14-\31]", "?")
    :gsub("\239\191[\190\191]", "?"))
end

--- A page of this size.
---@param width integer
---@param height integer
---@param title string
---@param size integer of the text
---@param ink string colour of the text
---@param options? { millimetres: number|nil, transparent: boolean|nil, description: string|nil }
--- its width on paper; without a white ground; what a screen reader says of it, "" for nothing
---@return limax.svg
function svg.page(width, height, title, size, ink, options)
  options = options or {}
  local page = setmetatable({ parts = {} }, Page)
  local wide, high = ("%d"):format(width), ("%d"):format(height)
  if options.millimetres then
    wide = ("%.4gmm"):format(options.millimetres)
    high = ("%.4gmm"):format(options.millimetres * height / width)
  end
  page:add('<svg xmlns="http://www.w3.org/2000/svg" width="%s" height="%s" viewBox="0 0 %d %d"'
    .. ' role="img"', wide, high, width, height)
  page:add('font-family="DejaVu Sans, Verdana, Helvetica, sans-serif" font-size="%.4g" fill="%s">',
    size, ink)
  page:add("<title>%s</title>", escaped(title))
  if options.description and options.description ~= "" then
    page:add("<desc>%s</desc>", escaped(options.description))
  end
  if not options.transparent then
    page:add('<rect width="%d" height="%d" fill="#ffffff"/>', width, height)
  end
  return page
end

--- Adds an element, by a format.
---@param pattern string
---@param ... any
function Page:add(pattern, ...) self.parts[#self.parts + 1] = pattern:format(...) end

---@param x number
---@param y number of the base line
---@param text string
---@param attributes? string
function Page:text(x, y, text, attributes)
  self:add('<text x="%.1f" y="%.1f"%s>%s</text>', x, y, attributes and " " .. attributes or "",
    escaped(text))
end

---@param from number[] { x, y }
---@param to number[]
---@param color string
---@param width number
function Page:line(from, to, color, width)
  self:add('<line x1="%.1f" y1="%.1f" x2="%.1f" y2="%.1f" stroke="%s" stroke-width="%.2g"/>',
    from[1], from[2], to[1], to[2], color, width)
end

local function points_text(points)
  local parts = {}
  for k, point in ipairs(points) do parts[k] = ("%.1f,%.1f"):format(point[1], point[2]) end
  return table.concat(parts, " ")
end

--- A filled polygon.
---@param points number[][] { x, y }
---@param attributes string
function Page:polygon(points, attributes)
  self:add('<polygon points="%s" %s/>', points_text(points), attributes)
end

--- An open line through points.
---@param points number[][]
---@param color string
---@param width number
---@param opacity? number
function Page:path(points, color, width, opacity)
  local style = 'fill="none" stroke="%s" stroke-width="%.2g" stroke-opacity="%.2g"'
  self:add('<polyline points="%s" %s/>', points_text(points),
    style:format(color, width, opacity or 1))
end

---@param center number[]
---@param radius number
---@param fill string
function Page:dot(center, radius, fill)
  self:add('<circle cx="%.1f" cy="%.1f" r="%.2g" fill="%s" stroke="#ffffff" stroke-width="0.9"/>',
    center[1], center[2], radius, fill)
end

--- The whole text.
---@return string
function Page:finish()
  self:add "</svg>"
  return table.concat(self.parts, "\n") .. "\n"
end

return svg
