--- plot.lua: plots numbers in the terminal: traces over seconds, lists over their index.

local array_text = require "limax.tools.repl.array_text"
local engine = require "limax.engine"
local output = require "limax.base.output"
local schema = require "limax.engine.schema"
local terminal = require "limax.base.terminal"
local text_plot = require "limax.draw.text_plot"

local plot = {}

-- of the terminal's 256 colours, distinguishable for the colour-blind: blue, orange, green, ...
local colors = { 33, 208, 35, 175, 94, 110, 178, 66, 244 }

local check = schema.fields { rows = schema.whole(2, 200), columns = schema.whole(10, 1000) }

-- NaN and infinities have no place on an axis.
local function drawable(value) return value == value and math.abs(value) < math.huge end

-- A curve of the points that can be drawn.
local function curve(name, points, column)
  local series = { name = name, points = {}, color = colors[(column - 1) % #colors + 1],
    dotted = column % 2 == 0 }
  for _, point in ipairs(points) do
    if drawable(point[1]) and drawable(point[2]) then table.insert(series.points, point) end
  end
  return series
end

-- A curve for each column of rows of numbers, over seconds if there is a `rate`.
local function curves(rows, names, rate)
  local series = {}
  for column = 1, #rows[1] do
    local points = {}
    for i, row in ipairs(rows) do points[i] = { rate and (i - 1) / rate or i, row[column] } end
    series[column] = curve(names[column] or "column " .. column, points, column)
  end
  return series
end

-- The curves of a trace or list, the title of the x axis, and that of the plot.
local function drawn_of(values, is_view)
  local list = is_view and values:table() or values
  local rows = {}
  for i, value in ipairs(list) do rows[i] = type(value) == "table" and value or { value } end
  if is_view then
    local what = tostring(values):match "^view of (%S+)" or ""
    local unit = values.unit
    return curves(rows, values.columns or {}, values.rate), values.rate and "s" or "index",
      ("%s%s\n"):format(what, unit and unit ~= "1" and ", " .. unit or "")
  end
  if #rows[1] == 2 then return { curve("values", rows, 1) }, "", "" end
  return curves(rows, type(list[1]) == "number" and { "values" } or {}), "index", ""
end

--- Plots a trace (a line per column) over time, a list of numbers over its index, or a list of
--- { x, y }, in the terminal.
---@param values limax.view|number[]|number[][]
---@param options? { rows?: integer, columns?: integer } the size of the plot in letters
function plot.plot(values, options)
  local size = schema.demand(check, options, "plot")
  local is_view = engine.is_view(values)
  local shape = is_view and values.shape or array_text.shape(values)
  if not shape or #shape > 2 and not is_view then
    schema.refuse("plot", "a trace, a list of numbers or a list of { x, y }", values)
  elseif #shape > 2 then
    engine.fail(("plot: %s has %d axes; plot one of its masses: a list of trace[k][mass][3]")
      :format(tostring(values), #shape))
  end
  local series, x, title = drawn_of(values, is_view)
  output.write(title, text_plot.draw(series, { style = terminal.style(), rows = size.rows,
    columns = size.columns, x = x }), "\n")
end

return plot
