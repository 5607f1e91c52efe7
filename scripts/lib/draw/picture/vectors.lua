--- vectors.lua: the same drawing calls as pixels.lua, as SVG.

local svg = require "limax.draw.svg"

local vectors = {}

---@class limax.picture.vectors
---@field page limax.svg
---@field name string of its clipping paths
local Canvas = {}
Canvas.__index = Canvas

--- A canvas over a page that is there.
---@param page limax.svg
---@param name string that no other canvas over this page has
---@return limax.picture.vectors
function vectors.over(page, name)
  return setmetatable({ page = page, name = name, clips = 0, open = false }, Canvas)
end

--- An empty page.
---@param width integer px
---@param height integer px
---@param title string
---@param options? { transparent: boolean|nil, millimetres: number|nil, description: string|nil }
--- without a white ground; its width on paper; what a screen reader says of it
---@return limax.picture.vectors
function vectors.new(width, height, title, options)
  return vectors.over(svg.page(width, height, title, 11, "#2b2b2b", options), "clip")
end

-- see pixels.lua
function Canvas:clip(left, top, right, bottom)
  self:close()
  self.clips, self.open = self.clips + 1, true
  self.page:add('<clipPath id="%s%d"><rect x="%.2f" y="%.2f" width="%.2f" height="%.2f"/>'
    .. '</clipPath><g clip-path="url(#%s%d)">', self.name, self.clips, left, top, right - left,
    bottom - top, self.name, self.clips)
end

--- Ends the box of the last clip().
function Canvas:close()
  if self.open then self.page:add "</g>" end
  self.open = false
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

function Canvas:path(points, color, width) self.page:path(points, color, width) end

-- of the lines between faces
local EDGE = 0.5

function Canvas:face(points, fill, edges, color, width, opacity)
  local whole = not opacity
  for k = 1, #points do whole = whole and edges[k] end
  if whole then
    -- one element for the face and its lines
    self.page:polygon(points, ('fill="%s" stroke="%s" stroke-width="%.2g" stroke-opacity="%g"')
      :format(fill, color, width, EDGE))
    return
  end
  self:polygon(points, fill, opacity)
  local parts, at = {}, nil
  for k, p in ipairs(points) do
    local q = points[k % #points + 1]
    if edges[k] then
      parts[#parts + 1] = at == p and "" or ("M%.1f,%.1f"):format(p[1], p[2])
      parts[#parts + 1] = ("L%.1f,%.1f"):format(q[1], q[2])
      at = q
    end
  end
  if #parts > 0 then
    self.page:add('<path d="%s" fill="none" stroke="%s" stroke-width="%.2g" stroke-opacity="%g"/>',
      table.concat(parts), color, width, EDGE)
  end
end

function Canvas:dot(center, radius, color) self.page:dot(center, radius, color) end

function Canvas:text(x, y, text, size, color, anchor)
  -- capitals are 0.73 of a letter's size in DejaVu Sans
  self.page:text(x, y, text, ('font-size="%.4g" fill="%s" text-anchor="%s"'):format(size / 0.73,
    color, anchor or "start"))
end

---@return string
function Canvas:finish()
  self:close()
  return self.page:finish()
end

return vectors
