--- marks.lua: robots in a panel: cells of a grid or points, coloured by a value, with a colour bar.

local axis = require "limax.draw.chart.axis"
local palette = require "limax.draw.palette"

local marks = {}

--- px that the colour bar needs to the right of the axes.
marks.ROOM = 82

-- px: the bar and its distance from the axes; between the hatches of empty cells; a point
local BAR, GAP, HATCH, RADIUS = 12, 12, 9, 4.5
-- steps of the bar's colours
local STEPS = 48
-- px: cells as large have a gap between them
local LARGE = 6

---@class limax.chart.mark
---@field x number
---@field y number
---@field ends number[]|nil of a cell: least x, least y, most x, most y
---@field value number
---@field robot { text: string, letters: string|nil }|nil one that can be chosen

---@class limax.chart.marks
---@field list limax.chart.mark[]
---@field label string|nil of the values that colour them; without one the curves draw them
---@field low number|nil the values of the first and the last colour
---@field high number|nil
---@field cells boolean|nil what no cell covers is hatched
---@field colors table<string, string>|nil of the materials, by letter: "#rrggbb"

-- Lines upwards to the right, as far apart from each other along x.
local function hatch(place)
  local left, right, top, bottom = place.left, place.right, place.top, place.bottom
  place.canvas:box(left, top, right - left, bottom - top, "#f1f2f4")
  for start = left + HATCH, right + bottom - top, HATCH do
    -- x + y is the same along a line
    local sum = start + top
    local y, x = math.max(top, sum - right), math.max(left, sum - bottom)
    place.canvas:line({ sum - y, y }, { x, sum - x }, "#d3d7dc", 1)
  end
end

local function bar(place, label, low, high)
  local canvas, left, size = place.canvas, place.right + GAP, place.size
  local high_px = (place.bottom - place.top) / STEPS
  for k = 1, STEPS do
    canvas:box(left, place.bottom - k * high_px, BAR, high_px + (k > 1 and 0.5 or 0),
      palette.scale((k - 0.5) / STEPS))
  end
  local values = axis.new({ low = low, high = high, label = "" }, {})
  for _, tick in ipairs(values.ticks) do
    local y = place.bottom - tick.at * (place.bottom - place.top)
    canvas:line({ left + BAR, y }, { left + BAR + 4, y }, "#9aa0a6", 1)
    place:text(left + BAR + 6, y + 4, tick.text, { fill = "#6b7076", size = size - 1 })
  end
  place:text(place.right + marks.ROOM - 8, (place.top + place.bottom) / 2, label,
    { anchor = "middle", upwards = true })
end

--- Where a mark is, px: left, top, width and height of a cell; of a point its middle, 0 and 0.
function marks.box(place, mark)
  if not mark.ends then return { place:at_x(mark.x), place:at_y(mark.y), 0, 0 } end
  local left, top = place:at_x(mark.ends[1]), place:at_y(mark.ends[4])
  return { left, top, place:at_x(mark.ends[3]) - left, place:at_y(mark.ends[2]) - top }
end

--- Draws the marks of a panel and their colour bar.
function marks.draw(place, all)
  if not all.label then return end
  local low, high = all.low, all.high
  -- equal values have a range too, and an empty archive has one
  if low > high then low, high = 0, 1 end
  if low == high then high = low + math.max(1e-9, math.abs(low) * 1e-3) end
  if all.cells then hatch(place) end
  for _, mark in ipairs(all.list) do
    local fill, box = palette.scale((mark.value - low) / (high - low)), marks.box(place, mark)
    if mark.ends then
      local gap = math.min(box[3], box[4]) > LARGE and 0.5 or 0
      place.canvas:box(box[1] + gap, box[2] + gap, box[3] - 2 * gap, box[4] - 2 * gap, fill)
    else
      place.canvas:circle(box, RADIUS, { fill = fill, stroke = "#9aa0a6", width = 0.6 })
    end
  end
  bar(place, all.label, low, high)
end

return marks
