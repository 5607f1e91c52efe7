--- panel.lua: one pair of axes with curves, each named where it ends, and bands around curves.

local axis = require "limax.draw.chart.axis"
local canvases = require "limax.draw.canvas"
local marks = require "limax.draw.chart.marks"

local panel = {}

local ink = { faint = canvases.faint, grid = "#e4e6e9", frame = "#9aa0a6" }

-- px around the axes, and of a line of text
local LEFT, TOP, BOTTOM, LINE = 62, 34, 44, 13.5
-- names of curves get no more room than this share of a panel
local MOST_NAMES = 0.4
-- more markers than these on one curve are drawn at half the size
local MANY = 200

---@class limax.chart.curve
---@field name string|nil written at the curve's last point
---@field title string|nil its name in tables of the numbers
---@field points number[][] { x, y }
---@field color string
---@field dash number[]|"none"|nil px drawn and left out; "none" has markers only
---@field width number|nil px
---@field marker "dot"|"ring"|"square"|"diamond"|"wide ring"|"none"|nil

---@class limax.chart.band
---@field points number[][] { x, low, high }
---@field color string
---@field opacity number|nil of a band without lines along its ends
---@field name string|nil for tables of the numbers

---@class limax.chart.panel
---@field title string
---@field x table see axis.new
---@field y table
---@field curves limax.chart.curve[]
---@field bands limax.chart.band[]|nil behind the curves
---@field note string|nil a line below the title
---@field changes { x: number, text: string }[]|nil vertical lines where the values change meaning
---@field marks limax.chart.marks|nil robots
---@field right number|nil px, the room for the names of the curves in a page

-- The axes of a panel on a canvas: where values are, px, and the size of texts.
---@class limax.chart.place
---@field canvas limax.canvas
---@field size number px of texts
---@field left number
---@field right number
---@field top number
---@field bottom number
---@field x limax.chart.axis
---@field y limax.chart.axis
local Place = {}
Place.__index = Place

function Place:at_x(value) return self.left + self.x.place(value) * (self.right - self.left) end

function Place:at_y(value) return self.bottom - self.y.place(value) * (self.bottom - self.top) end

function Place:at(point) return { self:at_x(point[1]), self:at_y(point[2]) } end

function Place:text(x, y, text, style)
  style = style or {}
  style.size = style.size or self.size
  self.canvas:text(x, y, text, style)
end

-- All values that an axis has to hold.
local function values_of(spec, k)
  local values = {}
  local function add(value) values[#values + 1] = value end
  for _, curve in ipairs(spec.curves) do
    for _, point in ipairs(curve.points) do add(point[k]) end
  end
  for _, mark in ipairs(spec.marks and spec.marks.list or {}) do
    add(k == 1 and mark.x or mark.y)
  end
  for _, band in ipairs(spec.bands or {}) do
    for _, point in ipairs(band.points) do
      add(point[k])
      if k == 2 then add(point[3]) end
    end
  end
  return values
end

-- Fills a band between its lows and highs. Overlapping bands mix their colours, so that the ends of
-- several bands are lines and their fill is faint.
local function draw_band(place, band, several)
  local outline, count = {}, #band.points
  if count < 2 then return end
  for k, point in ipairs(band.points) do
    outline[k] = place:at { point[1], point[3] }
    outline[2 * count + 1 - k] = place:at { point[1], point[2] }
  end
  place.canvas:polygon(outline, { fill = band.color,
    fill_opacity = band.opacity or several and 0.07 or 0.16 })
  if band.opacity or not several then return end
  for _, ends in ipairs { { unpack(outline, 1, count) }, { unpack(outline, count + 1) } } do
    place.canvas:path(ends, { stroke = band.color, width = 0.9, opacity = 0.6 })
  end
end

local function draw_axes(place, far_left)
  local canvas, left, right, top, bottom = place.canvas, place.left, place.right, place.top,
    place.bottom
  for _, tick in ipairs(place.y.ticks) do
    local at = bottom - tick.at * (bottom - top)
    canvas:line({ left, at }, { right, at }, ink.grid, 1)
    place:text(left - 7, at + 4, tick.text, { anchor = "end", fill = ink.faint })
  end
  for _, tick in ipairs(place.x.ticks) do
    local at = left + tick.at * (right - left)
    canvas:line({ at, top }, { at, bottom }, ink.grid, 1)
    canvas:line({ at, bottom }, { at, bottom + 5 }, ink.frame, 1)
    place:text(at, bottom + 17, tick.text, { anchor = "middle", fill = ink.faint })
  end
  canvas:line({ left, bottom }, { right, bottom }, ink.frame, 1)
  canvas:line({ left, top }, { left, bottom }, ink.frame, 1)
  place:text((left + right) / 2, bottom + 35, place.x.label, { anchor = "middle" })
  -- a label that is longer than the axis has its unit in a line of its own
  local lines = { place.y.label }
  if canvases.text_width(place.y.label, { size = place.size }) > bottom - top + TOP then
    lines = { place.y.label:match "^(.-) (%(.*%))$" }
    lines[1] = lines[1] or place.y.label
  end
  for k, line in ipairs(lines) do
    place:text(far_left + (#lines == 1 and 15 or -1 + 12 * k), (top + bottom) / 2, line,
      { anchor = "middle", upwards = true })
  end
end

-- Draws a marker at { x, y }, a dot if left out.
local function draw_marker(canvas, at, kind, color, size)
  if kind == "none" then return end
  if kind == "wide ring" then
    -- around other markers, so that several series show at one place
    canvas:circle(at, 5.5, { stroke = color, width = 1.2 })
  elseif kind == "ring" then
    canvas:circle(at, size, { fill = "#ffffff", stroke = color, width = 1.4 })
  elseif kind == "square" or kind == "diamond" then
    local corners, r = {}, kind == "square" and size * math.sqrt(2) or size * 1.35
    for k = 1, 4 do
      local angle = math.pi / 2 * (k + (kind == "square" and 0.5 or 0))
      corners[k] = { at[1] + r * math.cos(angle), at[2] + r * math.sin(angle) }
    end
    canvas:polygon(corners, { fill = color, stroke = "#ffffff", width = 0.8 })
  else
    canvas:circle(at, size, { fill = color, stroke = "#ffffff", width = 0.9 })
  end
end

-- Moves labels as little as keeps them apart and between `low` and `high`.
local function spread(labels, low, high)
  table.sort(labels, function(a, b) return a.wanted < b.wanted end)
  local gap = math.min(LINE, (high - low) / math.max(#labels - 1, 1))
  for k, label in ipairs(labels) do
    label.y = math.max(label.wanted, k > 1 and labels[k - 1].y + gap or low)
  end
  local most = high
  for k = #labels, 1, -1 do
    labels[k].y = math.min(labels[k].y, most)
    most = labels[k].y - gap
  end
end

local function draw_names(place, labels)
  spread(labels, place.top + 4, place.bottom)
  for _, label in ipairs(labels) do
    place.canvas:path({ { label.from[1] + 4, label.from[2] }, { place.right + 2, label.y },
      { place.right + 8, label.y } }, { stroke = label.color, width = 0.8, opacity = 0.55 })
    place:text(place.right + 11, label.y + 4, label.name, { fill = label.color })
  end
end

-- Draws curves; returns the labels of those with a name.
local function draw_curves(place, curves)
  local labels = {}
  for _, curve in ipairs(curves) do
    local path, line = {}, curve.dash ~= "none"
    for k, point in ipairs(curve.points) do path[k] = place:at(point) end
    if line then
      place.canvas:path(path, { stroke = curve.color, width = curve.width or 1.7,
        dash = curve.dash })
    end
    for _, at in ipairs(path) do
      draw_marker(place.canvas, at, curve.marker, curve.color, #path > MANY and 1.5 or 3)
    end
    if curve.name and #path > 0 then
      labels[#labels + 1] = { name = curve.name, color = curve.color, wanted = path[#path][2],
        from = path[#path] }
    end
  end
  return labels
end

-- Dashed vertical lines, each with its text along it.
local function draw_changes(place, list)
  for _, change in ipairs(list) do
    local x = place:at_x(change.x)
    place.canvas:path({ { x, place.top }, { x, place.bottom } },
      { stroke = ink.faint, width = 1, dash = { 4, 3 } })
    place:text(x + 12, (place.top + place.bottom) / 2, change.text,
      { anchor = "middle", upwards = true, fill = ink.faint, size = place.size - 2 })
  end
end

--- The name of the k-th curve in tables.
function panel.name_of(curve, k) return curve.name or curve.title or ("line %d"):format(k) end

--- px that a colour bar, or the names at the ends of curves, need to the right of the axes.
---@param wide number px of the panel
---@param size number px of texts
function panel.room(spec, wide, size)
  if spec.marks and spec.marks.label then return marks.ROOM end
  local most = 0
  for _, curve in ipairs(spec.curves) do
    most = math.max(most, curve.name and canvases.text_width(curve.name, { size = size }) or 0)
  end
  return most == 0 and 12 or math.min(18 + most, MOST_NAMES * wide)
end

--- Draws a panel.
---@param box { left: number, top: number, width: number, height: number, right: number,
--- size: number, title: number|nil } px; `right` of the axes, `size` of texts, `title` of the title
---@return limax.chart.place where values are on the page
function panel.draw(canvas, spec, box)
  local place = setmetatable({ canvas = canvas, size = box.size, left = box.left + LEFT,
    right = box.left + box.width - box.right, top = box.top + TOP + (spec.note and 14 or 0),
    bottom = box.top + box.height - BOTTOM, x = axis.new(spec.x, values_of(spec, 1)),
    y = axis.new(spec.y, values_of(spec, 2)) }, Place)
  place:text(box.left + 8, box.top + 17, spec.title, { size = box.title, bold = true })
  if spec.note then
    place:text(box.left + 8, box.top + 33, spec.note, { fill = ink.faint })
  end
  draw_axes(place, box.left)
  if spec.marks then marks.draw(place, spec.marks) end
  local bands = spec.bands or {}
  for _, band in ipairs(bands) do draw_band(place, band, #bands > 1) end
  draw_names(place, draw_curves(place, spec.curves))
  draw_changes(place, spec.changes or {})
  return place
end

return panel
