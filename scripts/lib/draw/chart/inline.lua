--- inline.lua: a panel as SVG within a page, with its numbers: as JSON for the page's script, and
--- as rows for a table.

local canvases = require "limax.draw.canvas"
local host = require "limax.host"
local marks = require "limax.draw.chart.marks"
local panel = require "limax.draw.chart.panel"

local inline = {}

-- px
local WIDTH, HEIGHT, TEXT, TITLE, RIGHT = 560, 320, 12, 13.5, 120

-- Rows of a table, and places at which a curve can be read: of a longer one every second, third,
-- ... is kept, and the last. More would make a page of megabytes.
local MOST_ROWS = 500

-- The numbers of a panel as rows: one for each x of any curve or band, in their order.
local function table_of(spec)
  local columns, by_x, rows = { spec.x.label }, {}, {}
  local function put(x, value)
    if not by_x[x] then
      by_x[x] = { x }
      rows[#rows + 1] = by_x[x]
    end
    by_x[x][#columns] = by_x[x][#columns] or value
  end
  for k, curve in ipairs(spec.curves) do
    columns[#columns + 1] = panel.name_of(curve, k)
    for _, point in ipairs(curve.points) do put(point[1], point[2]) end
  end
  for _, band in ipairs(spec.bands or {}) do
    columns[#columns + 1] = (band.name or "band") .. ", band"
    for _, point in ipairs(band.points) do
      put(point[1], ("%.4g to %.4g"):format(point[2], point[3]))
    end
  end
  for _, row in ipairs(rows) do
    for c = 1, #columns do
      if row[c] == nil then row[c] = "" end
    end
  end
  table.sort(rows, function(a, b) return a[1] < b[1] end)
  return columns, rows
end

-- The robots of a panel: as rows, and where they are on the page with what it shows of them.
local function robots_of(spec, place)
  local columns, rows = { "robot", spec.x.label, spec.y.label }, {}
  local list = host.json.array {}
  columns[4] = spec.marks.label
  for _, mark in ipairs(spec.marks.list) do
    if mark.robot then
      rows[#rows + 1] = { mark.robot.text, mark.x, mark.y, spec.marks.label and mark.value }
      local box = marks.box(place, mark)
      for c = 1, 4 do box[c] = tonumber(("%.1f"):format(box[c])) end
      list[#list + 1] = { box = box, text = mark.robot.text, letters = mark.robot.letters }
    end
  end
  return columns, rows, { list = list, colors = spec.marks.colors }
end

---@class limax.chart.inline
---@field svg string
---@field data { x: string, y: string, left: number, right: number, top: number, bottom: number,
--- low: number, high: number, curves: { name: string, points: number[][] }[],
--- robots: table|nil } where the axes lie on the page (px), the ends of x, the curves, and robots
--- that can be chosen
---@field columns string[]
---@field rows (string|number)[][] a row for each x of any curve, at most MOST_ROWS
---@field left_out integer rows that are not there

--- Draws a panel.
---@param description string for screen readers
function inline.draw(spec, description)
  local canvas = canvases.new("svg", WIDTH, HEIGHT,
    { title = spec.title, description = description })
  local place = panel.draw(canvas, spec, { left = 0, top = 0, width = WIDTH, height = HEIGHT,
    right = spec.right or spec.marks and spec.marks.label and marks.ROOM
      or math.max(RIGHT, panel.room(spec, WIDTH, TEXT)), size = TEXT,
    title = TITLE })
  local columns, all, robots
  if spec.marks then
    columns, all, robots = robots_of(spec, place)
  else
    columns, all = table_of(spec)
  end
  local rows, kept, every = {}, {}, math.ceil(#all / MOST_ROWS)
  for k, row in ipairs(all) do
    if (k - 1) % every == 0 or k == #all then rows[#rows + 1], kept[row[1]] = row, true end
  end
  local curves = host.json.array {}
  -- robots are read instead
  for k, curve in ipairs(robots and {} or spec.curves) do
    local points = {}
    for _, point in ipairs(curve.points) do
      if kept[point[1]] then points[#points + 1] = point end
    end
    curves[k] = { name = panel.name_of(curve, k), points = points }
  end
  return { svg = canvas:finish(), columns = columns, rows = rows, left_out = #all - #rows,
    data = { x = spec.x.label, y = spec.y.label, left = place.left, right = place.right,
      top = place.top, bottom = place.bottom, low = place.x.low, high = place.x.high,
      curves = curves, robots = robots } }
end

return inline
