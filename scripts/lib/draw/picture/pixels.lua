--- pixels.lua: a picture of pixels, drawn without a display: filled polygons, lines and text, each
--- over what is there, at three times the size in both directions and averaged at the end.
--- Coordinates are px of the finished picture, y downwards.

local bit = require "bit"
local ffi = require "ffi"
local letters = require "limax.draw.picture.letters"

local pixels = {}

-- Samples of a pixel along each side: edges have ten shades.
local FINE = 3

---@class limax.picture.pixels
---@field width integer
---@field height integer
local Canvas = {}
Canvas.__index = Canvas

local function rgb(hex)
  local value = tonumber(hex:sub(2), 16)
  return bit.rshift(value, 16), bit.band(bit.rshift(value, 8), 255), bit.band(value, 255)
end

--- An empty picture; without a ground it is transparent.
---@param width integer
---@param height integer
---@param ground string|nil "#rrggbb"
---@return limax.picture.pixels
function pixels.new(width, height, ground)
  local self = setmetatable({ width = width, height = height, wide = width * FINE,
    high = height * FINE }, Canvas)
  -- red, green and blue times opacity, and opacity, of each sample
  self.data = ffi.new("uint8_t[?]", self.wide * self.high * 4)
  self:clip(0, 0, width, height)
  if ground then
    self:polygon({ { 0, 0 }, { width, 0 }, { width, height }, { 0, height } }, ground)
  end
  return self
end

--- Nothing is drawn outside of this box from now on.
---@param left number
---@param top number
---@param right number
---@param bottom number
function Canvas:clip(left, top, right, bottom)
  self.left = math.max(0, math.floor(left * FINE + 0.5))
  self.top = math.max(0, math.floor(top * FINE + 0.5))
  self.right = math.min(self.wide, math.floor(right * FINE + 0.5))
  self.bottom = math.min(self.high, math.floor(bottom * FINE + 0.5))
end

-- One row of samples, from `first` up to but without `last`. The colour is times its opacity, and
-- half a step more, which rounds.
function Canvas:span(row, first, last, r, g, b, opacity)
  local data, rest, full = self.data, 1 - opacity, 255 * opacity + 0.5
  for at = (row * self.wide + first) * 4, (row * self.wide + last - 1) * 4, 4 do
    data[at] = data[at] * rest + r
    data[at + 1] = data[at + 1] * rest + g
    data[at + 2] = data[at + 2] * rest + b
    data[at + 3] = data[at + 3] * rest + full
  end
end

--- A filled polygon; what lies inside an even number of turns is left out.
---@param points number[][]
---@param color string "#rrggbb"
---@param opacity? number 1
function Canvas:polygon(points, color, opacity)
  opacity = opacity or 1
  local r, g, b = rgb(color)
  r, g, b = r * opacity + 0.5, g * opacity + 0.5, b * opacity + 0.5
  local low, high = math.huge, -math.huge
  for _, p in ipairs(points) do low, high = math.min(low, p[2]), math.max(high, p[2]) end
  local count, cuts = #points, {}
  for row = math.max(self.top, math.ceil(low * FINE - 0.5)),
    math.min(self.bottom - 1, math.floor(high * FINE - 0.5)) do
    -- a sample lies in the middle of its square
    local y, n = (row + 0.5) / FINE, 0
    for k = 1, count do
      local p, q = points[k], points[k % count + 1]
      if (p[2] <= y) ~= (q[2] <= y) then
        n = n + 1
        cuts[n] = p[1] + (y - p[2]) / (q[2] - p[2]) * (q[1] - p[1])
      end
    end
    for k = n + 1, #cuts do cuts[k] = nil end
    table.sort(cuts)
    for k = 1, n - 1, 2 do
      local first = math.max(self.left, math.ceil(cuts[k] * FINE - 0.5))
      local last = math.min(self.right, math.ceil(cuts[k + 1] * FINE - 0.5))
      if last > first then self:span(row, first, last, r, g, b, opacity) end
    end
  end
end

---@param from number[]
---@param to number[]
---@param color string
---@param width number
---@param opacity? number
function Canvas:line(from, to, color, width, opacity)
  local dx, dy = to[1] - from[1], to[2] - from[2]
  local length = math.sqrt(dx * dx + dy * dy)
  if length == 0 then return end
  local x, y = -dy / length * width / 2, dx / length * width / 2
  self:polygon({ { from[1] + x, from[2] + y }, { to[1] + x, to[2] + y },
    { to[1] - x, to[2] - y }, { from[1] - x, from[2] - y } }, color, opacity)
end

--- A line through points.
---@param points number[][]
---@param color string
---@param width number
function Canvas:path(points, color, width)
  for k = 2, #points do self:line(points[k - 1], points[k], color, width) end
end

-- of the lines between faces
local EDGE = 0.5

--- A filled polygon with lines along some of its edges.
---@param points number[][]
---@param fill string "#rrggbb"
---@param edges boolean[] has the k-th edge a line?
---@param color string of the lines
---@param width number
---@param opacity? number of the filling, 1
function Canvas:face(points, fill, edges, color, width, opacity)
  self:polygon(points, fill, opacity)
  for k, edge in ipairs(edges) do
    if edge then self:line(points[k], points[k % #points + 1], color, width, EDGE) end
  end
end

-- Corners of a disc: rounder than a pixel shows.
local ROUND = 16

---@param center number[]
---@param radius number
---@param color string
function Canvas:dot(center, radius, color)
  local points = {}
  for k = 1, ROUND do
    local angle = 2 * math.pi * k / ROUND
    points[k] = { center[1] + radius * math.cos(angle), center[2] + radius * math.sin(angle) }
  end
  self:polygon(points, color)
end

--- A text of so many px from base line to cap, its left end, middle or right end at x.
---@param x number
---@param y number of the base line
---@param text string
---@param size number
---@param color string
---@param anchor? "start"|"middle"|"end"
function Canvas:text(x, y, text, size, color, anchor)
  -- whole samples: no gaps between the dots
  local dot = math.max(1, math.floor(size / letters.HEIGHT * FINE + 0.5)) / FINE
  local wide = letters.columns(text) * dot
  if anchor == "middle" then x = x - wide / 2 elseif anchor == "end" then x = x - wide end
  x, y = math.floor(x * FINE + 0.5) / FINE, math.floor(y * FINE + 0.5) / FINE
  size = dot * letters.HEIGHT
  letters.draw(text, function(column, row)
    local left, top = x + column * dot, y - size + row * dot
    self:polygon({ { left, top }, { left + dot, top }, { left + dot, top + dot },
      { left, top + dot } }, color)
  end)
end

--- The picture as bytes: red, green, blue, opacity of each pixel.
---@return string
function Canvas:finish()
  local out = ffi.new("uint8_t[?]", self.width * self.height * 4)
  local data, wide, samples = self.data, self.wide, FINE * FINE
  for y = 0, self.height - 1 do
    for x = 0, self.width - 1 do
      local r, g, b, a = 0, 0, 0, 0
      for row = y * FINE, y * FINE + FINE - 1 do
        for at = (row * wide + x * FINE) * 4, (row * wide + x * FINE + FINE - 1) * 4, 4 do
          r, g, b, a = r + data[at], g + data[at + 1], b + data[at + 2], a + data[at + 3]
        end
      end
      local to = (y * self.width + x) * 4
      if a > 0 then
        out[to], out[to + 1] = math.min(r / a * 255 + 0.5, 255), math.min(g / a * 255 + 0.5, 255)
        out[to + 2] = math.min(b / a * 255 + 0.5, 255)
        out[to + 3] = math.min(a / samples + 0.5, 255)
      end
    end
  end
  return ffi.string(out, self.width * self.height * 4)
end

return pixels
