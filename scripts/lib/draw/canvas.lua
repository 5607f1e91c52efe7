--- canvas.lua: the drawing surface of pictures, film strips, frames of animations, figures and the
--- charts of a report. The same calls make PNG, PDF, SVG or pixels. Lengths are px of 1/96 inch, x
--- to the right and y downwards.

local cairo = require "limax.draw.cairo"
local svg = require "limax.draw.svg"
local terminal = require "limax.base.terminal"

local canvas = {}

---@class limax.draw.style
---@field fill string|nil "#rrggbb"
---@field fill_opacity number|nil 1
---@field stroke string|nil "#rrggbb"
---@field width number|nil of the stroke, px
---@field opacity number|nil of the stroke, 1
---@field dash number[]|nil px drawn and left out

---@class limax.draw.text
---@field size number px
---@field fill string|nil "#rrggbb"; the text colour if left out
---@field anchor "middle"|"end"|nil what of the text is at x; its start if left out
---@field bold boolean|nil
---@field upwards boolean|nil written from below to above

--- The colours of texts.
canvas.ink, canvas.faint = "#26282b", "#6b7076"

---@class limax.canvas
---@field kind "png"|"pdf"|"svg"|"pixels"
---@field width integer
---@field height integer
local Canvas = {}

---@class limax.canvas.options
---@field title string|nil
---@field description string|nil text for screen readers, of an SVG
---@field transparent boolean|nil without a white ground
---@field millimetres number|nil width of an SVG on paper
---@field prefix string|nil of the names within an SVG: those in one page must differ

-- Text that XML and Cairo can hold: control characters become question marks, and so do the letters
-- of a name that is not UTF-8, which a folder's may be.
local function clean(text)
  return (terminal.utf8(tostring(text)):gsub("[%z\1-\31\127]", "?"):gsub("\239\191[\190\191]", "?"))
end

--- An empty canvas.
---@param kind "png"|"pdf"|"svg"|"pixels" pixels are four bytes each: red, green, blue, opacity
---@param options? limax.canvas.options
function canvas.new(kind, width, height, options)
  options = options or {}
  local self = setmetatable({ kind = kind, width = width, height = height,
    title = clean(options.title or ""), description = clean(options.description or ""),
    millimetres = options.millimetres, prefix = options.prefix or "",
    transparent = options.transparent },
    kind == "svg" and svg.class or cairo.class)
  self:open()
  if not self.transparent then
    self:polygon({ { 0, 0 }, { width, 0 }, { width, height }, { 0, height } },
      { fill = "#ffffff" })
  end
  return self
end

--- px that a text takes along its line.
function canvas.text_width(text, style) return cairo.width(clean(text), style) end

--- A text as lines that are at most so wide; a word that is wider has a line of its own.
---@param width number px
function canvas.wrapped(text, style, width)
  return terminal.wrap(text, width, "", function(line) return canvas.text_width(line, style) end)
end

-- clip(left, top, right, bottom): nothing is drawn outside of this box until the next call; clip()
-- ends it. circle(center, radius, style). finish(): the bytes of the file. These are the sinks'
-- own.

--- A closed shape.
---@param points number[][] { x, y }
function Canvas:polygon(points, style) self:outline(points, true, style) end

--- A line through points.
function Canvas:path(points, style)
  if #points > 1 then self:outline(points, false, style) end
end

function Canvas:line(from, to, color, width)
  self:outline({ from, to }, false, { stroke = color, width = width })
end

--- A rectangle of one colour.
function Canvas:box(left, top, width, height, fill)
  self:polygon({ { left, top }, { left + width, top }, { left + width, top + height },
    { left, top + height } }, { fill = fill })
end

-- of the lines between faces
local EDGE = 0.5

--- A filled polygon with lines along some of its edges.
---@param fill string "#rrggbb"
---@param edges boolean[] has the k-th edge a line?
---@param color string of the lines
---@param opacity? number of the filling
function Canvas:face(points, fill, edges, color, width, opacity)
  local whole = not opacity
  for k = 1, #points do whole = whole and edges[k] end
  if whole then
    self:polygon(points, { fill = fill, stroke = color, width = width, opacity = EDGE })
    return
  end
  -- a thin edge of its own colour closes the seams between neighbours
  self:polygon(points, { fill = fill, fill_opacity = opacity, stroke = not opacity and fill or nil,
    width = 0.3 })
  for k, p in ipairs(points) do
    if edges[k] then
      self:path({ p, points[k % #points + 1] }, { stroke = color, width = width, opacity = EDGE })
    end
  end
end

--- A text; y is its base line.
function Canvas:text(x, y, text, style)
  self:write(x, y, clean(text), { size = style.size, anchor = style.anchor, bold = style.bold,
    upwards = style.upwards, fill = style.fill or canvas.ink })
end

for _, class in ipairs { svg.class, cairo.class } do
  class.__index = class
  setmetatable(class, { __index = Canvas })
end

return canvas
