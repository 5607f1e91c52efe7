--- plot.lua: plots numbers in the terminal: traces over seconds, lists over their index.

local array_text = require "limax.tools.repl.array_text"
local engine = require "limax.engine"
local schema = require "limax.engine.schema"
local terminal = require "limax.base.terminal"
local text_plot = require "limax.draw.text_plot"

local plot = {}

-- of the terminal's 256 colours, distinguishable for the colour-blind: blue, orange, green, ...
local colors = { 33, 208, 35, 175, 94, 110, 178, 66, 244 }

-- names of the columns of a trace, by its kind
local columns_of = {
  center_of_mass = { "x", "y", "z" },
  contact = { "share of masses in contact" },
  energy = { "kinetic", "elastic", "gravitational", "power" },
  strain = { "mean", "largest" },
  ledger = { "kinetic", "elastic", "contact", "gravitational", "muscles", "damping",
    "contact damping", "friction", "other" },
}

local check = schema.fields {
  column = schema.number { unit = "", minimum = 1, integer = true },
  rows = schema.number { unit = "lines", minimum = 2, maximum = 200, integer = true },
  columns = schema.number { unit = "letters", minimum = 10, maximum = 1000, integer = true },
}

-- NaN and infinities have no place on an axis.
local function drawable(value) return value == value and math.abs(value) < math.huge end

-- A line for each column of rows of numbers, over seconds if there is a `rate`.
local function lines_of(rows, names, rate, only)
  local series = {}
  for column = only or 1, only or #rows[1] do
    local points = {}
    for i, row in ipairs(rows) do
      if drawable(row[column]) then
        points[#points + 1] = { rate and (i - 1) / rate or i, row[column] }
      end
    end
    series[#series + 1] = { name = names[column] or "column " .. column, points = points,
      color = colors[(column - 1) % #colors + 1], dotted = column % 2 == 0 }
  end
  return series
end

local function as_rows(list)
  local rows = {}
  for i, value in ipairs(list) do rows[i] = type(value) == "table" and value or { value } end
  return rows
end

local function of_view(view, only)
  local shape, rate = view.shape, view.rate
  if #shape > 2 then
    engine.fail(("plot: %s has %d axes; plot one of its masses: a list of trace[k][mass][3]")
      :format(tostring(view), #shape))
  end
  local what = tostring(view):match "^view of (%S+)" or ""
  local names = columns_of[what] or {}
  local unit = view.unit
  return lines_of(as_rows(view:table()), names, rate, only), rate and "s" or "index",
    ("%s%s"):format(what, unit and unit ~= "1" and ", " .. unit or "")
end

local function of_list(list, only)
  if type(list[1]) == "number" then return lines_of(as_rows(list), { "values" }), "index" end
  if type(list[1]) == "table" and #list[1] == 2 and not only then
    local points = {}
    for _, point in ipairs(list) do
      if drawable(point[1]) and drawable(point[2]) then points[#points + 1] = point end
    end
    return { { name = "values", points = points, color = colors[1] } }, ""
  end
  return lines_of(list, {}, nil, only), "index"
end

-- A list of numbers, or of rows of the same length.
local function is_list_of_numbers(list)
  local shape = type(list) == "table" and array_text.shape(list)
  return shape and #shape <= 2
end

--- The plot as text.
---@param values limax.view|number[]|number[][]
---@param options? { column?: integer, rows?: integer, columns?: integer }
function plot.text(values, options)
  local checked, message = check(options, "plot")
  if not checked then engine.fail(message) end
  local view = engine.is_view(values)
  if not view and not is_list_of_numbers(values) then
    engine.fail("plot: expected a trace, a list of numbers or a list of { x, y }, got "
      .. schema.show(values))
  end
  local width = view and values.shape[2] or type(values[1]) == "table" and #values[1] or 1
  if checked.column and checked.column > (width or 1) then
    engine.fail(("plot: column: there are %d, got %d"):format(width or 1, checked.column))
  end
  local series, x, title
  if view then
    series, x, title = of_view(values, checked.column)
  else
    series, x = of_list(values, checked.column)
  end
  local drawn = text_plot.draw(series, { style = terminal.style(), rows = checked.rows,
    columns = checked.columns, x = x })
  return title and title .. "\n" .. drawn or drawn
end

return plot
