--- text_plot.lua: lines over generations in a terminal, in braille dots (2 x 4 to a letter) or in
--- ASCII. Returns text.

local bit = require "bit"
local palette = require "limax.draw.palette"
local terminal = require "limax.base.terminal"

local text_plot = {}

---@class limax.text_plot.series
---@field name string
---@field points number[][] { x, y }, x rising
---@field color integer of the terminal's 256
---@field dotted? boolean every other dot, so that lines differ without colour

-- Bit of each dot of a braille letter, [row][column].
local dots = { { 0x01, 0x08 }, { 0x02, 0x10 }, { 0x04, 0x20 }, { 0x40, 0x80 } }

local function braille(bits)
  local code = 0x2800 + bits
  return string.char(0xe0 + bit.rshift(code, 12), 0x80 + bit.band(bit.rshift(code, 6), 0x3f),
    0x80 + bit.band(code, 0x3f))
end

-- Smallest and largest of one coordinate over all series; widened if they are equal.
local function range(series, k)
  local low, high = math.huge, -math.huge
  for _, line in ipairs(series) do
    for _, point in ipairs(line.points) do
      low, high = math.min(low, point[k]), math.max(high, point[k])
    end
  end
  if low > high then return 0, 1 end
  if low == high then
    local room = math.max(math.abs(low) * 0.1, 1e-9)
    if k == 2 then return low - room, high + room end
    return low, low + 1
  end
  return low, high
end

-- Calls mark(x, y) for each dot of a line of dots between two dots.
local function draw_line(x0, y0, x1, y1, mark)
  local steps = math.max(math.abs(x1 - x0), math.abs(y1 - y0), 1)
  for k = 0, steps do
    mark(math.floor(x0 + (x1 - x0) * k / steps + 0.5), math.floor(y0 + (y1 - y0) * k / steps + 0.5))
  end
end

-- A canvas of letters, each a set of dots and the colour of the last line that crossed it.
local function rasterize(series, columns, rows, across, down)
  local bits, colors, symbol = {}, {}, {}
  local x_low, x_high = range(series, 1)
  local y_low, y_high = range(series, 2)
  local wide, high = columns * across - 1, rows * down - 1
  for s, line in ipairs(series) do
    local before_x, before_y
    for _, point in ipairs(line.points) do
      local x = math.floor((point[1] - x_low) / (x_high - x_low) * wide + 0.5)
      local y = math.floor((y_high - point[2]) / (y_high - y_low) * high + 0.5)
      draw_line(before_x or x, before_y or y, x, y, function(dot_x, dot_y)
        if line.dotted and (dot_x + dot_y) % 2 == 1 then return end
        local cell = math.floor(dot_y / down) * columns + math.floor(dot_x / across)
        local dot = dots[dot_y % down + 1][dot_x % across + 1]
        bits[cell] = bit.bor(bits[cell] or 0, dot)
        colors[cell], symbol[cell] = line.color, s
      end)
      before_x, before_y = x, y
    end
  end
  return { bits = bits, colors = colors, symbol = symbol, x_low = x_low, x_high = x_high,
    y_low = y_low, y_high = y_high }
end

local ascii_marks = { "*", "o", "+", "x" }

--- Lines over a common pair of axes; a later series is drawn over an earlier one.
---@param options { style: limax.terminal.style, rows?: integer, columns?: integer, x?: string,
--- y?: string, changes?: { x: number, text: string }[] } x and y name the axes; changes are
--- vertical lines
function text_plot.draw(series, options)
  local style, rows, margin = options.style, options.rows or 10, 9
  local columns = options.columns or math.max(20, math.min(style.width, 100) - margin - 3)
  local across, down, bar, corner, dash, broken = 2, 4, "│", "└", "─", "┆"
  if style.ascii then across, down, bar, corner, dash, broken = 1, 1, "|", "+", "-", ":" end
  local canvas = rasterize(series, columns, rows, across, down)

  local lines, legend = {}, {}
  for s, line in ipairs(series) do
    local mark = style.ascii and ascii_marks[s] or braille(line.dotted and 0x21 or 0x24)
    legend[s] = terminal.paint(mark .. mark .. " " .. line.name, line.color, style)
  end
  local changed = {}
  for _, change in ipairs(options.changes or {}) do
    local share = (change.x - canvas.x_low) / (canvas.x_high - canvas.x_low)
    changed[math.floor(share * (columns - 1) + 0.5)] = true
    legend[#legend + 1] = ("%s %s from %g on"):format(broken, change.text, change.x)
  end
  lines[1] = terminal.pad(options.y or "", margin, true) .. "   " .. table.concat(legend, "   ")
  for row = 0, rows - 1 do
    local label, share = "", row / math.max(rows - 1, 1)
    if row == 0 or row == rows - 1 or row == math.floor(rows / 2) then
      label = ("%.4g"):format(canvas.y_high - share * (canvas.y_high - canvas.y_low))
    end
    local parts = { terminal.pad(label, margin, true), " ", bar }
    for column = 0, columns - 1 do
      local cell, text = row * columns + column, changed[column] and broken or " "
      local bits = canvas.bits[cell]
      if bits then
        text = style.ascii and ascii_marks[canvas.symbol[cell]] or braille(bits)
        text = terminal.paint(text, canvas.colors[cell], style)
      end
      parts[#parts + 1] = text
    end
    lines[#lines + 1] = (table.concat(parts):gsub("%s+$", ""))
  end
  lines[#lines + 1] = (" "):rep(margin + 1) .. corner .. dash:rep(columns)
  local first, last = ("%g"):format(canvas.x_low), ("%g"):format(canvas.x_high)
  local middle, room = options.x or "", columns - #first - #last
  local left = math.max(1, math.floor((room - #middle) / 2))
  lines[#lines + 1] = (" "):rep(margin + 2) .. first .. (" "):rep(left) .. middle
    .. (" "):rep(math.max(1, room - left - #middle)) .. last
  return table.concat(lines, "\n")
end

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

--- Draws the curves of a panel; bands are left out.
---@param options { style: limax.terminal.style, rows?: integer }
function text_plot.panel(panel, options)
  local series = {}
  for _, curve in ipairs(panel.curves) do
    if #curve.points > 0 then
      series[#series + 1] = { name = curve.name or curve.title or "", points = curve.points,
        -- lighter: most terminals are dark
        color = terminal_color(palette.shade(curve.color, 1.3)),
        dotted = curve.dash ~= nil and not options.style.ascii }
    end
  end
  return text_plot.draw(series, { style = options.style, rows = options.rows, x = panel.x.label,
    y = panel.y.label, changes = panel.changes })
end

return text_plot
