--- archives.lua: maps of archives, Pareto fronts and islands. The leading run of each arm is drawn.

local curves = require "limax.tools.report.curves"
local palette = require "limax.draw.palette"
local runs = require "limax.tools.report.runs"
local sorting = require "limax.base.sorting"
local stored = require "limax.tools.report.stored"

local archives = {}

-- Robots of a chart, the best ones: more would make a page of megabytes.
local MOST_DRAWN = 2000

-- "contact (1)"; names of functions have no unit.
local function label_of(measure)
  return ("%s (%s%s)"):format(measure.name, measure.unit or "unit of the script",
    measure.sign == -1 and "; less is better" or "")
end

local function axis_of(measure, range)
  return { label = label_of(measure), low = range and range[1],
    high = range and range[2] }
end

-- A robot as the page shows it.
local function robot_of(row, list, values)
  local parts = {}
  for k, measure in ipairs(list) do
    parts[k] = ("%s %.4g%s"):format(measure.name, values[k],
      (measure.unit or "1") ~= "1" and #measure.unit < 6 and " " .. measure.unit or "")
  end
  return { letters = row.letters, text = ("robot %d of generation %d: fitness %.4g, %s"):format(
    row.id, row.generation, row.fitness, table.concat(parts, ", ")) }
end

local function colors_of(run)
  local hex = {}
  for letter, color in pairs(palette.of(run.config.materials.materials)) do
    hex[letter] = color.hex
  end
  return hex
end

-- The best of more rows than a page should draw, best first.
local function best_of(rows)
  local scores, list = {}, {}
  for k, row in ipairs(rows) do scores[k] = row.fitness end
  for place, at in ipairs(sorting.descending(scores)) do
    if place <= MOST_DRAWN then list[place] = rows[at] end
  end
  return list
end

-- The cell of a row in the plane of the first two axes of a grid: its number and its ends.
local function cell_of(row, axes)
  local number, ends = 0, {}
  for k = 1, 2 do
    local axis = axes[k]
    local at = math.floor((row.cell - 1) / axis.stride) % axis.cells
    local size = (axis.most - axis.least) / axis.cells
    number = number + at * (k == 1 and 1 or axes[1].cells)
    ends[k], ends[k + 2] = axis.least + at * size, axis.least + (at + 1) * size
  end
  return number, ends
end

-- Rows as marks: over one descriptor and fitness, or over the first two; of each cell of a grid the
-- best.
local function marks_of(rows, definition)
  local list, seen, axes = {}, {}, definition.axes
  local names = definition.descriptors
  for _, row in ipairs(best_of(rows)) do
    local at = row.descriptors
    local mark = { x = at[1], y = #names > 1 and at[2] or row.fitness, value = row.fitness }
    local cell
    if axes and #names > 1 then
      cell, mark.ends = cell_of(row, axes)
      mark.x, mark.y = (mark.ends[1] + mark.ends[3]) / 2, (mark.ends[2] + mark.ends[4]) / 2
    end
    if not cell or not seen[cell] then
      mark.robot = robot_of(row, names, at)
      list[#list + 1] = mark
      seen[cell or row] = true
    end
  end
  return list
end

-- Marks without a colour by value are drawn as points of a curve.
local function add_points(panel, title)
  local points = {}
  for k, mark in ipairs(panel.marks.list) do points[k] = { mark.x, mark.y } end
  panel.curves[1] = { title = title, points = points, color = palette.line(1), dash = "none" }
end

-- The archive of a run: its fitness over one descriptor, or in colours over the first two.
local function map(run, title, label)
  local definition, rows = stored.archive(run)
  if not definition then return nil end
  local list, axes = definition.descriptors, definition.axes
  stored.add_letters(run, rows)
  local panel = { title = "archive of " .. title, caption = ("%d robots"):format(#rows),
    x = axis_of(list[1], axes and list[1].range), curves = {},
    y = #list > 1 and axis_of(list[2], axes and list[2].range) or { label = label },
    marks = { list = marks_of(rows, definition), colors = colors_of(run),
      cells = #list > 1 and axes ~= nil, label = #list > 1 and label or nil } }
  panel.marks.low, panel.marks.high = math.huge, -math.huge
  for _, row in ipairs(rows) do
    panel.marks.low = math.min(panel.marks.low, row.fitness)
    panel.marks.high = math.max(panel.marks.high, row.fitness)
  end
  if #list == 1 then add_points(panel, "archive") end
  if #list > 2 then
    panel.note = ("by the first two of %d descriptors%s"):format(#list,
      axes and "; of each cell the best" or "")
  end
  return panel
end

-- The last front of a run, by the first two objectives.
local function front(run, title)
  local objectives, rows = stored.front(run)
  if not objectives then return nil end
  stored.add_letters(run, rows)
  local panel = { title = "Pareto front of " .. title, x = axis_of(objectives[1]),
    y = axis_of(objectives[2]), curves = {}, marks = { list = {}, colors = colors_of(run) },
    caption = ("%d robots of the last front"):format(#rows) }
  for k, row in ipairs(rows) do
    local at = row.objectives
    panel.marks.list[k] = { x = at[1], y = at[2], value = row.fitness,
      robot = robot_of(row, objectives, at) }
  end
  add_points(panel, "front")
  panel.note = #objectives > 2 and ("by the first two of %d objectives"):format(#objectives) or nil
  return panel
end

-- The best of each island of a run.
local function islands(run, title, label)
  local last, values = run.lines[#run.lines].islands, {}
  if not last then return nil end
  for k in ipairs(last) do
    values[k] = { ("island %d"):format(k), function(line)
      return line.islands and line.islands[k] and line.islands[k].best
    end }
  end
  return curves.values({ runs = { run } }, "islands of " .. title, label, values)
end

-- Draws the leading run of each arm.
local function of_arms(make)
  return function(list, label)
    local panels = {}
    for _, arm in ipairs(list) do
      local run = runs.leading(arm.runs)
      panels[#panels + 1] = make(run, runs.title(arm, run), label)
    end
    return panels
  end
end

archives.maps, archives.fronts, archives.islands = of_arms(map), of_arms(front), of_arms(islands)

return archives
