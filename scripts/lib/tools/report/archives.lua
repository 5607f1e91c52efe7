--- archives.lua: what a run remembers and what it searches for besides its best: maps of archives,
--- Pareto fronts, and their numbers by generation. Of each arm the leading run is drawn.

local curves = require "limax.tools.report.curves"
local palette = require "limax.draw.palette"
local runs = require "limax.tools.report.runs"
local sorting = require "limax.base.sorting"
local stored = require "limax.tools.report.stored"

local archives = {}

-- Robots of a map that can be chosen, the best ones, and points that are drawn.
local MOST_CHOSEN, MOST_POINTS = 2000, 4000

-- ---- maps ---------------------------------------------------------------------------------------

-- "contact (1)"; names of functions have no unit.
local function label_of(measure)
  return ("%s (%s%s)"):format(measure.name, measure.unit or "unit of the script",
    measure.sign == -1 and "; less is better" or "")
end

-- What the page shows of a robot.
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

local function axis_of(measure, fixed)
  local range = fixed and measure.range or {}
  return { label = label_of(measure), linear = true, low = range[1], high = range[2] }
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

-- The best row of each cell of the plane, as marks.
local function cells_of(rows, definition)
  local best, list = {}, {}
  for _, row in ipairs(rows) do
    local number, ends = cell_of(row, definition.axes)
    local mark = best[number]
    if not mark then
      mark = { x = (ends[1] + ends[3]) / 2, y = (ends[2] + ends[4]) / 2, ends = ends }
      best[number], list[#list + 1] = mark, mark
    end
    if not mark.value or row.fitness > mark.value then
      mark.value, mark.robot = row.fitness, robot_of(row, definition.descriptors, row.descriptors)
    end
  end
  return list
end

-- Every second, third, ... of more rows than a page should draw.
local function thinned(rows)
  local every, list = math.ceil(#rows / MOST_POINTS), {}
  for k = 1, #rows, every do list[#list + 1] = rows[k] end
  return list
end

-- Points of rows as marks, over one descriptor or two.
local function points_of(rows, list)
  local made = {}
  for k, row in ipairs(thinned(rows)) do
    local values = row.descriptors
    made[k] = { x = values[1], y = #list > 1 and values[2] or row.fitness, value = row.fitness,
      robot = robot_of(row, list, values) }
  end
  return made
end

-- Only the best can be chosen.
local function limit_chosen(list)
  local values = {}
  for k, mark in ipairs(list) do values[k] = mark.value end
  for place, at in ipairs(sorting.descending(values)) do
    if place > MOST_CHOSEN then list[at].robot = nil end
  end
end

-- The archive of a run: its fitness over one descriptor, or in colours over the first two.
local function map(run, title, label)
  local definition, rows = stored.archive(run)
  if not definition then return nil end
  local list = definition.descriptors
  stored.add_letters(run, rows)
  local panel = { title = "archive of " .. title, x = axis_of(list[1], definition.axes),
    y = #list > 1 and axis_of(list[2], definition.axes) or { label = label, linear = true },
    curves = {}, marks = { list = {}, colors = colors_of(run) } }
  panel.caption = ("%d robots"):format(#rows)
  if #list > 1 then
    panel.marks.label = label
    panel.note = #list > 2 and ("by the first two of %d descriptors%s"):format(#list,
      definition.axes and "; of each cell the best" or "") or nil
  end
  panel.marks.cells = #list > 1 and definition.axes ~= nil
  panel.marks.list = panel.marks.cells and cells_of(rows, definition) or points_of(rows, list)
  limit_chosen(panel.marks.list)
  if #list == 1 then
    local points = {}
    for k, mark in ipairs(panel.marks.list) do points[k] = { mark.x, mark.y } end
    panel.curves[1] = { title = "robots", points = points, color = palette.line(1), dash = "none" }
  end
  return panel
end

-- ---- fronts -------------------------------------------------------------------------------------

-- The ends of what a front of two objectives dominates: a staircase through its points.
local function staircase(points, objectives)
  local steps = {}
  for k, point in ipairs(points) do
    local before = points[k - 1]
    if before then
      steps[#steps + 1] = objectives[1].sign == 1 and { before[1], point[2] }
        or { point[1], before[2] }
    end
    steps[#steps + 1] = point
  end
  return steps
end

-- Adds a front to a panel; more than two objectives have no line.
local function add_front(panel, each, objectives, color, last)
  local points, name = {}, ("generation %d"):format(each.generation)
  for i, row in ipairs(each.rows) do points[i] = { row.objectives[1], row.objectives[2] } end
  if #objectives == 2 then
    table.insert(panel.curves, { name = name, points = staircase(points, objectives),
      color = color, width = last and 2 or 1.2, marker = "none" })
  end
  if last or #objectives > 2 then
    table.insert(panel.curves, { name = #objectives > 2 and name or nil, title = name,
      points = points, color = color, dash = "none" })
  end
end

local EARLIER_COLORS = { "#6b7076", "#cc79a7", "#0072b2" }

-- The front of a run and earlier ones, by the first two objectives.
local function front_panel(run, title)
  local objectives, fronts = stored.fronts(run)
  if not objectives then return nil end
  local panel = { title = "Pareto front of " .. title, x = axis_of(objectives[1]),
    y = axis_of(objectives[2]), curves = {}, marks = { list = {}, colors = colors_of(run) } }
  for k, each in ipairs(fronts) do
    local last = k == #fronts
    add_front(panel, each, objectives, last and palette.line(2) or EARLIER_COLORS[k], last)
  end
  local rows = fronts[#fronts].rows
  stored.add_letters(run, rows)
  for k, row in ipairs(rows) do
    panel.marks.list[k] = { x = row.objectives[1], y = row.objectives[2], value = row.fitness,
      robot = robot_of(row, objectives, row.objectives) }
  end
  panel.caption = ("%d robots of the last front"):format(#rows)
  panel.note = #objectives > 2 and ("by the first two of %d objectives"):format(#objectives) or nil
  return panel
end

-- ---- by generation ------------------------------------------------------------------------------

-- A panel for each row of title, label and value: of the arms that have the value.
local function by_generation(list, rows)
  local panels = {}
  for _, row in ipairs(rows) do
    local having = {}
    for k, arm in ipairs(list) do
      local has = false
      for _, run in ipairs(arm.runs) do has = has or row[3](run.lines[#run.lines]) ~= nil end
      having[#having + 1] = has and { name = arm.name, runs = arm.runs, line = arm.line or k }
        or nil
    end
    if #having > 0 then
      local panel = curves.panel(having, row[1], row[2], row[3])
      panel.y.whole = row[2] == "robots"
      panels[#panels + 1] = panel
    end
  end
  return panels
end

-- Reads a field of an object of a line of metrics.
local function field(object, name)
  return function(line) return line[object] and line[object][name] end
end

-- The best of each island of a run.
local function islands(run, title, label)
  local last = run.lines[#run.lines].islands
  if not last then return nil end
  local panel = curves.panel({}, "islands of " .. title, label)
  for k in ipairs(last) do
    local one = { name = ("island %d"):format(k), runs = { run }, line = k }
    panel.curves[k] = curves.panel({ one }, "", "", function(line)
      return line.islands and line.islands[k] and line.islands[k].best
    end).curves[1]
  end
  return panel
end

-- Panels that `make` draws of the leading run of each arm.
local function of_arms(list, make, ...)
  local panels = {}
  for _, arm in ipairs(list) do
    local run = runs.leading(arm.runs)
    panels[#panels + 1] = make(run, runs.title(arm, run), ...)
  end
  return panels
end

-- Gives the maps of several arms the same colours for the same values.
local function share_colors(panels)
  local low, high = math.huge, -math.huge
  for _, panel in ipairs(panels) do
    for _, mark in ipairs(panel.marks.list) do
      low, high = math.min(low, mark.value), math.max(high, mark.value)
    end
  end
  for _, panel in ipairs(panels) do panel.marks.low, panel.marks.high = low, high end
  return panels
end

local function joined(panels, more)
  for _, panel in ipairs(more) do panels[#panels + 1] = panel end
  return panels
end

--- The sections that these arms have anything for.
---@param list limax.report.arm[]
---@param drawn limax.report.arm[] of them, whose runs are drawn one by one
---@param label string of the fitness, with its unit
---@param meaning string of lines and bands
---@return limax.report.section[]
function archives.sections(list, drawn, label, meaning)
  local of = label:match "%(.*%)$" or ""
  return {
    { name = "archive", title = "Archive", foot = "Maps: the run of an arm whose champion is"
        .. " the best; hatched cells are empty. " .. meaning,
      panels = joined(share_colors(of_arms(drawn, map, label)), by_generation(list, {
        { "coverage", "share of the cells (1)", field("archive", "coverage") },
        { "QD score", "QD score " .. of, field("archive", "qd_score") },
        { "robots in the archive", "robots", field("archive", "filled") },
        { "best in the archive", label, field("archive", "best") } })) },
    { name = "front", title = "Pareto front", foot = "Fronts: the run of an arm whose"
        .. " champion is the best. " .. meaning,
      panels = joined(of_arms(drawn, front_panel), by_generation(list, {
        { "hypervolume", "product of the objectives", field("front", "hypervolume") },
        { "robots of the front", "robots", field("front", "size") } })) },
    { name = "search", title = "Novelty, age and step size", foot = meaning
        .. " Over all robots with a score.",
      panels = by_generation(list, {
        { "mean novelty", "distance (1)", field("novelty", "mean") },
        { "mean age", "generations", field("age", "mean") },
        { "greatest age", "generations", field("age", "most") },
        { "mean step size", "standard deviation (1)", field("step_size", "mean") } }) },
    { name = "islands", title = "Islands", foot = "Lines: the best of each island, of the run of"
        .. " an arm whose champion is the best.", panels = of_arms(drawn, islands, label) },
  }
end

return archives
