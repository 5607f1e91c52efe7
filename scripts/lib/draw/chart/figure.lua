--- figure.lua: panels side by side on one page of SVG, with a title, what it shows in a sentence,
--- and where it was measured.

local panel = require "limax.draw.chart.panel"
local svg = require "limax.draw.svg"

local figure = {}

-- px; text of 11 px is 8.25 pt
local MARGIN, HEAD, FOOT, TEXT = 22, 62, 34, 11

---@class limax.chart.figure
---@field name string of its files
---@field title string
---@field subtitle string
---@field foot string
---@field panels limax.chart.panel[]
---@field columns integer|nil 2
---@field width integer|nil of a panel, px
---@field height integer|nil of a panel, px

--- The SVG text of a figure.
---@param given limax.chart.figure
---@return string
function figure.svg(given)
  local columns = math.min(given.columns or 2, #given.panels)
  local wide, high = given.width or 590, given.height or 380
  local rows = math.ceil(#given.panels / columns)
  local width = 2 * MARGIN + columns * wide
  local height = HEAD + rows * high + FOOT
  local out = svg.page(width, height, given.title, TEXT, "#26282b")
  out:text(MARGIN + 8, 28, given.title, 'font-size="17" font-weight="bold"')
  out:text(MARGIN + 8, 48, given.subtitle, 'font-size="12" fill="#6b7076"')
  for k, each in ipairs(given.panels) do
    panel.draw(out, each, MARGIN + (k - 1) % columns * wide,
      HEAD + math.floor((k - 1) / columns) * high, wide, high)
  end
  out:text(MARGIN + 8, height - 14, given.foot, 'font-size="10" fill="#6b7076"')
  return out:finish()
end

return figure
