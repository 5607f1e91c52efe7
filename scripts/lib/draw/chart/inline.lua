--- inline.lua: a panel as SVG that stands in a page, with its numbers beside it: as JSON for the
--- page's script, and as rows for readers without eyes or scripts.

local panel = require "limax.draw.chart.panel"
local svg = require "limax.draw.svg"

local inline = {}

-- px; text of 12 px
local WIDTH, HEIGHT, TEXT, RIGHT = 560, 320, 12, 120

-- Rows of a table, and places at which a curve can be read: of a longer one every second, third,
-- ... is kept, and the last. More make a page of megabytes that nobody reads.
local MOST_ROWS = 500

local function name_of(curve, k) return curve.name or curve.title or ("line %d"):format(k) end

-- px of a line of a key
local LINE = 20

--- Markers with what they mean, one below the other, as SVG.
---@param entries { marker: string, color: string, name: string, text: string|nil }[]
---@param title string
---@return string
function inline.key(entries, title)
  local out = svg.page(WIDTH, LINE * #entries + 6, title, TEXT, "#26282b")
  for k, entry in ipairs(entries) do
    panel.marker(out, { 16, LINE * k - 5 }, entry.marker, entry.color)
    out:text(32, LINE * k, entry.text or entry.name)
  end
  return out:finish()
end

---@class limax.chart.inline
---@field svg string
---@field data { x: string, y: string, left: number, right: number, top: number, bottom: number,
--- low: number, high: number, curves: { name: string, points: number[][] }[] } where the axes lie
--- on the page (px), the ends of x, and the curves
---@field columns string[]
---@field rows (string|number)[][] a row for each x of any curve, but no more than MOST_ROWS
---@field left_out integer rows that are not there

--- Draws a panel.
---@param given limax.chart.panel
---@param description string for screen readers
---@return limax.chart.inline
function inline.draw(given, description)
  local roomy = {}
  for name, value in pairs(given) do roomy[name] = value end
  roomy.right = given.right or RIGHT
  local out = svg.page(WIDTH, HEIGHT, given.title, TEXT, "#26282b", { description = description })
  local place = panel.draw(out, roomy, 0, 0, WIDTH, HEIGHT)
  local data = { x = given.x.label, y = given.y.label, left = place.box.left,
    right = place.box.right, top = place.box.top, bottom = place.box.bottom, low = place.x.low,
    high = place.x.high, curves = {} }
  local columns, by_x, xs = { given.x.label }, {}, {}
  local function put(k, x, text)
    if not by_x[x] then
      by_x[x] = { x }
      xs[#xs + 1] = x
    end
    by_x[x][k + 1] = by_x[x][k + 1] or text
  end
  for k, curve in ipairs(given.curves) do
    columns[k + 1] = name_of(curve, k)
    data.curves[k] = { name = name_of(curve, k), points = curve.points }
    for _, point in ipairs(curve.points) do put(k, point[1], point[2]) end
  end
  for _, band in ipairs(given.bands or {}) do
    columns[#columns + 1] = (band.name or "band") .. ", band"
    for _, point in ipairs(band.points) do
      put(#columns - 1, point[1], ("%.4g to %.4g"):format(point[2], point[3]))
    end
  end
  table.sort(xs)
  local rows, kept, every = {}, {}, math.ceil(#xs / MOST_ROWS)
  for k, x in ipairs(xs) do
    if (k - 1) % every == 0 or k == #xs then
      local row = by_x[x]
      for c = 1, #columns do
        if row[c] == nil then row[c] = "" end
      end
      rows[#rows + 1], kept[x] = row, true
    end
  end
  for _, curve in ipairs(every > 1 and data.curves or {}) do
    local points = {}
    for _, point in ipairs(curve.points) do
      if kept[point[1]] then points[#points + 1] = point end
    end
    curve.points = points
  end
  return { svg = out:finish(), data = data, columns = columns, rows = rows,
    left_out = #xs - #rows }
end

return inline
