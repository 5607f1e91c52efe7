--- svg.lua: a canvas that writes SVG, with texts as texts. See canvas.lua for the calls. Cairo's
--- own SVG is not used: it turns letters into shapes, and the report's content policy forbids its
--- style attributes.

local svg = {}

---@class limax.draw.svg : limax.canvas
local Sink = {}
svg.class = Sink

local ENTITIES = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;" }
local function escaped(text) return (text:gsub("[&<>\"]", ENTITIES)) end

local function add(self, pattern, ...) self.parts[#self.parts + 1] = pattern:format(...) end

--- Writes the head of the page.
function Sink:open()
  self.parts, self.clips, self.open_clip = {}, 0, false
  local wide, high = ("%d"):format(self.width), ("%d"):format(self.height)
  if self.millimetres then
    wide = ("%.4gmm"):format(self.millimetres)
    high = ("%.4gmm"):format(self.millimetres * self.height / self.width)
  end
  add(self, '<svg xmlns="http://www.w3.org/2000/svg" width="%s" height="%s" viewBox="0 0 %d %d"'
    .. ' role="img" stroke-linejoin="round"', wide, high, self.width, self.height)
  add(self, 'font-family="DejaVu Sans, Verdana, Helvetica, sans-serif">')
  add(self, "<title>%s</title>", escaped(self.title))
  if self.description ~= "" then add(self, "<desc>%s</desc>", escaped(self.description)) end
end

local function style_text(style)
  local parts = { ('fill="%s"'):format(style.fill or "none") }
  local function put(pattern, value)
    if value then parts[#parts + 1] = pattern:format(value) end
  end
  put('fill-opacity="%.3g"', style.fill_opacity)
  put('stroke="%s"', style.stroke)
  put('stroke-width="%.2g"', style.stroke and style.width)
  put('stroke-opacity="%.3g"', style.opacity)
  put('stroke-dasharray="%s"', style.dash and table.concat(style.dash, " "))
  return table.concat(parts, " ")
end

function Sink:clip(left, top, right, bottom)
  if self.open_clip then add(self, "</g>") end
  self.open_clip = left ~= nil
  if left then
    self.clips = self.clips + 1
    local name = ("%sclip%d"):format(self.prefix, self.clips)
    add(self, '<clipPath id="%s"><rect x="%.2f" y="%.2f" width="%.2f" height="%.2f"/></clipPath>'
      .. '<g clip-path="url(#%s)">', name, left, top, right - left, bottom - top, name)
  end
end

function Sink:outline(points, closed, style)
  if #points == 2 then
    add(self, '<line x1="%.1f" y1="%.1f" x2="%.1f" y2="%.1f" %s/>', points[1][1], points[1][2],
      points[2][1], points[2][2], style_text(style))
    return
  end
  local texts = {}
  for k, p in ipairs(points) do texts[k] = ("%.1f,%.1f"):format(p[1], p[2]) end
  add(self, '<%s points="%s" %s/>', closed and "polygon" or "polyline", table.concat(texts, " "),
    style_text(style))
end

function Sink:circle(center, radius, style)
  add(self, '<circle cx="%.1f" cy="%.1f" r="%.2g" %s/>', center[1], center[2], radius,
    style_text(style))
end

function Sink:write(x, y, text, style)
  local place = ('x="%.1f" y="%.1f"'):format(x, y)
  if style.upwards then place = ('transform="translate(%.1f %.1f) rotate(-90)"'):format(x, y) end
  add(self, '<text %s font-size="%.4g"%s%s %s>%s</text>', place, style.size,
    style.anchor and (' text-anchor="%s"'):format(style.anchor) or "",
    style.bold and ' font-weight="bold"' or "", style_text(style), escaped(text))
end

--- The whole text.
function Sink:finish()
  self:clip()
  add(self, "</svg>")
  return table.concat(self.parts, "\n") .. "\n"
end

return svg
