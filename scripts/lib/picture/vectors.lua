--- vectors.lua: the same drawing calls as pixels.lua, as SVG.

local svg = require "limax.svg"

local vectors = {}

---@class limax.picture.vectors
---@field page limax.svg
local Canvas = {}
Canvas.__index = Canvas

--- An empty page; without a ground it is transparent.
---@param width integer px
---@param height integer px
---@param ground string|nil "#ffffff"
---@param title string
---@param millimetres? number its width on paper
---@return limax.picture.vectors
function vectors.new(width, height, ground, title, millimetres)
  local page = svg.page(width, height, title, 11, "#2b2b2b",
    { transparent = not ground, millimetres = millimetres })
  return setmetatable({ page = page, clips = 0, open = false }, Canvas)
end

-- see pixels.lua
function Canvas:clip(left, top, right, bottom)
  if self.open then self.page:add "</g>" end
  self.clips, self.open = self.clips + 1, true
  self.page:add('<clipPath id="clip%d"><rect x="%.2f" y="%.2f" width="%.2f" height="%.2f"/>'
    .. '</clipPath><g clip-path="url(#clip%d)">', self.clips, left, top, right - left,
    bottom - top, self.clips)
end

function Canvas:polygon(points, color, opacity)
  -- a thin edge of its own colour closes the seams between neighbours
  local seam = opacity and "" or (' stroke="%s" stroke-width="0.3"'):format(color)
  self.page:polygon(points, ('fill="%s"%s%s'):format(color, seam,
    opacity and (' fill-opacity="%.2f"'):format(opacity) or ""))
end

function Canvas:line(from, to, color, width, opacity)
  self.page:path({ from, to }, color, width, opacity)
end

function Canvas:dot(center, radius, color) self.page:dot(center, radius, color) end

function Canvas:text(x, y, text, size, color, anchor)
  -- capitals are 0.73 of a letter's size in DejaVu Sans
  self.page:text(x, y, text, ('font-size="%.4g" fill="%s" text-anchor="%s"'):format(size / 0.73,
    color, anchor or "start"))
end

---@return string
function Canvas:finish()
  if self.open then self.page:add "</g>" end
  return self.page:finish()
end

return vectors
