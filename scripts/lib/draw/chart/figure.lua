--- figure.lua: panels for a printed page: as wide as a column or a text, 8 pt throughout, with a
--- sentence on what is drawn below. The same figure as SVG and PDF, and its numbers as rows.

local canvases = require "limax.draw.canvas"
local csv = require "limax.base.csv"
local panel = require "limax.draw.chart.panel"
local source = require "limax.base.source"

local figure = {}

-- Widths in mm: of a column and of a text in most journals.
local WIDTHS = { 85, 175 }

-- px of 1/96 inch in a millimetre.
local PX_PER_MM = 96 / 25.4
-- px of a text of 8 pt.
local TEXT = 8 * 96 / 72

-- px: height of a line of text and of a panel, least width of a panel, and the outer margin
local LINE, HEIGHT, NARROWEST, MARGIN = 14, 205, 300, 6

---@class limax.chart.figure
---@field name string of its files
---@field title string for screen readers and viewers; it is not drawn
---@field panels limax.chart.panel[]
---@field foot string what is drawn, and of how many runs

-- The file of a figure of this width.
local function draw(kind, spec, millimetres)
  local width = math.floor(millimetres * PX_PER_MM + 0.5)
  local columns = math.min(math.max(1, math.floor(width / NARROWEST)),
    math.max(1, #spec.panels))
  local wide = (width - 2 * MARGIN) / columns
  local rows, high = math.ceil(#spec.panels / columns), HEIGHT
  local foot = canvases.wrapped(spec.foot, { size = TEXT }, width - 2 * MARGIN)
  local canvas = canvases.new(kind, width, rows * high + #foot * LINE + 12,
    { title = spec.title, description = spec.foot, millimetres = millimetres })
  for k, each in ipairs(spec.panels) do
    panel.draw(canvas, each, { left = MARGIN + (k - 1) % columns * wide,
      top = math.floor((k - 1) / columns) * high, width = wide, height = high,
      right = panel.room(each, wide, TEXT), size = TEXT })
  end
  local y = rows * high + LINE
  for _, line in ipairs(foot) do
    canvas:text(MARGIN, y, line, { size = TEXT })
    y = y + LINE
  end
  return canvas:finish()
end

-- The numbers of a figure: a row per point of a line or a band.
local function csv_of(spec)
  local rows, columns = {}, { "panel", "x_axis", "y_axis", "curve", "x", "y", "low", "high" }
  local function add(each, name, points, low, high)
    for _, point in ipairs(points) do
      rows[#rows + 1] = { panel = each.title, x_axis = each.x.label, y_axis = each.y.label,
        curve = name, x = point[1], y = not low and point[2] or nil, low = low and point[low],
        high = high and point[high] }
    end
  end
  for _, each in ipairs(spec.panels) do
    for k, curve in ipairs(each.curves) do
      add(each, panel.name_of(curve, k), curve.points)
    end
    for _, mark in ipairs(each.marks and each.marks.list or {}) do
      rows[#rows + 1] = { panel = each.title, x_axis = each.x.label, y_axis = each.y.label,
        curve = "robots", x = mark.x, y = mark.y, value = mark.value }
      columns[9] = "value"
    end
    for k, band in ipairs(each.bands or {}) do
      add(each, band.name or ("band %d"):format(k), band.points, 2, 3)
    end
  end
  return csv.encode(columns, rows)
end

--- Writes a figure as SVG and PDF of both widths, and its numbers as CSV.
function figure.write(folder, spec)
  for _, millimetres in ipairs(WIDTHS) do
    for _, kind in ipairs { "svg", "pdf" } do
      source.write(("%s/%s-%d.%s"):format(folder, spec.name, millimetres, kind),
        draw(kind, spec, millimetres))
    end
  end
  source.write(("%s/%s.csv"):format(folder, spec.name), csv_of(spec))
end

return figure
