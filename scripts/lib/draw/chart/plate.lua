--- plate.lua: panels for a printed page: as wide as a column or a text, 8 pt throughout, a key of
--- markers and what the curves mean below. Lengths in px of 1/96 inch unless they say mm.

local panel = require "limax.draw.chart.panel"
local svg = require "limax.draw.svg"

local plate = {}

--- Widths in mm: of a column and of a text in most journals.
plate.WIDTHS = { 85, 175 }

local PX_PER_MM = 96 / 25.4
-- 8 pt
local TEXT = 8 * 96 / 72
-- a letter's mean width, of the text's height: DejaVu Sans is wide
local LETTER = 0.6
local LINE, HEIGHT, LEFT, MARGIN = 14, 205, 58, 6
-- names of curves get no more room than this share of a panel
local MOST_NAMES = 0.4

local function letters(text) return select(2, text:gsub("[^\128-\191]", "")) end

-- A text as lines of at most so many letters.
local function wrapped(text, most)
  local lines, line = {}, ""
  for word in text:gmatch "%S+" do
    if line ~= "" and letters(line) + 1 + letters(word) > most then
      lines[#lines + 1], line = line, word
    else
      line = line == "" and word or line .. " " .. word
    end
  end
  lines[#lines + 1] = line
  return lines
end

-- Room that the names at the ends of curves need.
local function names_room(given, wide)
  local most = 0
  for _, curve in ipairs(given.curves) do
    most = math.max(most, curve.name and letters(curve.name) or 0)
  end
  return most == 0 and 12 or math.min(18 + most * LETTER * TEXT, MOST_NAMES * wide)
end

-- The key as rows that fit: { { entry, x }, ... }.
local function key_rows(key, width)
  local rows, x = { {} }, MARGIN + 6
  for _, entry in ipairs(key) do
    local room = 12 + letters(entry.text) * LETTER * TEXT + 14
    if x + room > width and #rows[#rows] > 0 then
      rows[#rows + 1] = {}
      x = MARGIN + 6
    end
    table.insert(rows[#rows], { entry = entry, x = x })
    x = x + room
  end
  return #key > 0 and rows or {}
end

---@class limax.chart.plate
---@field title string for screen readers and viewers; it is not drawn
---@field panels limax.chart.panel[]
---@field foot string what the curves and bands are, and of how many runs
---@field key { marker: string, color: string, text: string }[]|nil

--- The SVG text of a plate.
---@param given limax.chart.plate
---@param millimetres number its width
---@return string
function plate.svg(given, millimetres)
  local width = math.floor(millimetres * PX_PER_MM + 0.5)
  local columns = math.min(math.max(1, math.floor(width / 300)), #given.panels)
  local wide = (width - 2 * MARGIN) / columns
  local rows = math.ceil(#given.panels / columns)
  local foot = wrapped(given.foot, math.floor((width - 2 * MARGIN) / (LETTER * TEXT)))
  local key = key_rows(given.key or {}, width)
  local height = rows * HEIGHT + (#key + #foot) * LINE + 12
  local out = svg.page(width, height, given.title, TEXT, "#26282b",
    { millimetres = millimetres, description = given.foot })
  for k, each in ipairs(given.panels) do
    local copy = {}
    for name, value in pairs(each) do copy[name] = value end
    copy.right, copy.left, copy.title_size = names_room(each, wide), LEFT, TEXT
    local column, row = (k - 1) % columns, math.floor((k - 1) / columns)
    panel.draw(out, copy, MARGIN + column * wide, row * HEIGHT, wide, HEIGHT)
  end
  local y = rows * HEIGHT + LINE
  for _, row in ipairs(key) do
    for _, at in ipairs(row) do
      panel.marker(out, { at.x, y - 4 }, at.entry.marker, at.entry.color)
      out:text(at.x + 10, y, at.entry.text)
    end
    y = y + LINE
  end
  for _, line in ipairs(foot) do
    out:text(MARGIN, y, line)
    y = y + LINE
  end
  return out:finish()
end

--- What a plate draws, number by number: a row per point of a line or a band.
---@param given limax.chart.plate
---@return string[] columns
---@return table[] rows
function plate.rows(given)
  local rows = {}
  for _, each in ipairs(given.panels) do
    for k, curve in ipairs(each.curves) do
      for _, point in ipairs(curve.points) do
        rows[#rows + 1] = { panel = each.title, x_axis = each.x.label, y_axis = each.y.label,
          curve = curve.name or curve.title or ("line %d"):format(k), x = point[1], y = point[2] }
      end
    end
    for k, band in ipairs(each.bands or {}) do
      for _, point in ipairs(band.points) do
        rows[#rows + 1] = { panel = each.title, x_axis = each.x.label, y_axis = each.y.label,
          curve = band.name or ("band %d"):format(k), x = point[1], low = point[2],
          high = point[3] }
      end
    end
  end
  return { "panel", "x_axis", "y_axis", "curve", "x", "y", "low", "high" }, rows
end

return plate
