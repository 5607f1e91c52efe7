--- text.lua: a panel for a terminal: the same curves that figures and pages draw, in braille dots.

local palette = require "limax.draw.palette"
local text_plot = require "limax.draw.text_plot"

local text = {}

-- The nearest of a terminal's 256 colours: its cube of 6 x 6 x 6.
local function terminal_color(hex)
  local code = 16
  for k, factor in ipairs { 36, 6, 1 } do
    local value = tonumber(hex:sub(2 * k, 2 * k + 1), 16)
    -- the cube's steps are 0, 95, 135, 175, 215, 255
    local step = value < 48 and 0 or value < 115 and 1 or math.floor((value - 35) / 40)
    code = code + factor * step
  end
  return code
end

--- Draws a panel's curves; bands are left out.
---@param given limax.chart.panel
---@param options { style: limax.terminal.style, rows?: integer, columns?: integer }
---@return string
function text.draw(given, options)
  local series = {}
  for _, curve in ipairs(given.curves) do
    if #curve.points > 0 then
      series[#series + 1] = { name = curve.name or curve.title or "", points = curve.points,
        -- lighter: terminals are dark more often than not
        color = terminal_color(palette.shade(curve.color, 1.3)),
        dotted = curve.dash ~= nil and not options.style.ascii }
    end
  end
  return text_plot.draw(series, { style = options.style, rows = options.rows,
    columns = options.columns, x = given.x.label, y = given.y.label })
end

return text
