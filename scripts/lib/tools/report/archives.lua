--- archives.lua: what a run remembers and what it searches for besides its best: maps of archives,
--- Pareto fronts, and their numbers by generation. Of each arm the leading run is drawn.

local archive = require "limax.archive"
local archived = require "limax.evolution.archived"
local curves = require "limax.tools.report.curves"
local front = require "limax.experiment.front"
local palette = require "limax.draw.palette"
local run_files = require "limax.settings.run_files"
local runs = require "limax.tools.report.runs"
local sorting = require "limax.base.sorting"
local source = require "limax.base.source"
local survival = require "limax.survival"
local verify = require "limax.run.verify"

local archives = {}

-- Letters of the bodies of one map: half a megabyte of a page.
local MOST_LETTERS = 5e5
-- Robots of a map that can be chosen, the best ones, and points that are drawn.
local MOST_CHOSEN, MOST_POINTS = 2000, 4000
-- Earlier fronts that are drawn, besides the last.
local EARLIER = 3

-- ---- what is in the folder ----------------------------------------------------------------------

-- A part of a configuration as an experiment names it. Functions of a script are not called here.
local function spec_of(value)
  if type(value) ~= "table" then return value end
  local spec = {}
  for key, entry in pairs(value) do
    if key ~= "function" and key ~= "name" then spec[key] = spec_of(entry) end
  end
  if value["function"] then
    spec[1], spec.name = function() return 0 end, value.name
  else
    spec[1] = value.name or spec[1]
  end
  return spec
end

local function definition_of(run, field, library)
  local value = run.config[field]
  if type(value) ~= "table" or value["function"] then return nil end
  return run_files.about(run.path .. "/config.json", library.get, spec_of(value))
end

local function file_of(run, kind, generation)
  local path = run.path .. "/" .. verify.place(kind, run.repetition, generation)
  return source.read(path) or "", path
end

-- The archive after each generation that `visit` is called with.
local function replay(run, definition, visit)
  local kept = archived.new(definition, run.config.seed, run.repetition)
  for _, line in ipairs(run.lines) do
    kept:replay(line.generation, file_of(run, "archive", line.generation))
    visit(line.generation, kept.rows)
  end
  return kept.rows
end

-- Adds to rows the letters of their bodies, of the best first, while there is room.
local function add_letters(run, rows)
  local scores, files, count = {}, {}, 0
  for k, row in ipairs(rows) do scores[k] = row.fitness end
  for _, at in ipairs(sorting.descending(scores)) do
    local row = rows[at]
    if count > MOST_LETTERS then return end
    files[row.generation] = files[row.generation]
      or run_files.robots(file_of(run, "population", row.generation))
    local record = files[row.generation][row.index]
    row.letters = record and record.id == row.id and record.body.letters or nil
    count = count + #(row.letters or "")
  end
end

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
  local definition = definition_of(run, "archive", archive)
  local list = definition and definition.descriptors
  if not list then return nil end
  local rows = replay(run, definition, function() end)
  add_letters(run, rows)
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

-- The generations whose fronts are drawn: some earlier ones and the last.
local function shown_generations(run)
  local shown, last = {}, #run.lines
  for k = 0, EARLIER do
    shown[run.lines[1 + math.floor((last - 1) * k / EARLIER)].generation] = true
  end
  return shown
end

-- Rows that no other row dominates, by the first objective.
local function best_of(rows, objectives)
  local list, sorted, firsts = {}, {}, {}
  for k, at in ipairs(front.of(front.points(rows, objectives))) do list[k] = rows[at] end
  for k, row in ipairs(list) do firsts[k] = row.objectives[1] end
  for k, at in ipairs(sorting.ascending(firsts)) do sorted[k] = list[at] end
  return sorted
end

-- The scored robots of a generation as rows.
local function population_rows(run, generation)
  local rows = {}
  for k, record in ipairs(run_files.robots(file_of(run, "population", generation))) do
    if record.objectives and record.fitness then
      rows[#rows + 1] = { id = record.id, generation = generation, index = k,
        fitness = record.fitness, objectives = record.objectives }
    end
  end
  return rows
end

-- Objectives of a run, and its fronts: { generation, rows }, the last one last.
local function fronts_of(run)
  local definition = definition_of(run, "archive", archive)
  local shown, fronts = shown_generations(run), {}
  local function add(objectives, generation, rows)
    if shown[generation] then
      fronts[#fronts + 1] = { generation = generation, rows = best_of(rows, objectives) }
    end
  end
  if definition and definition.objectives then
    replay(run, definition, function(generation, rows)
      add(definition.objectives, generation, rows)
    end)
    return definition.objectives, fronts
  end
  local scheme = definition_of(run, "survival", survival)
  if not scheme or not scheme.objectives then return nil, {} end
  for _, line in ipairs(run.lines) do
    add(scheme.objectives, line.generation,
      shown[line.generation] and population_rows(run, line.generation) or {})
  end
  return scheme.objectives, fronts
end

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
  local objectives, fronts = fronts_of(run)
  if not objectives then return nil end
  local panel = { title = "Pareto front of " .. title, x = axis_of(objectives[1]),
    y = axis_of(objectives[2]), curves = {}, marks = { list = {}, colors = colors_of(run) } }
  for k, each in ipairs(fronts) do
    local last = k == #fronts
    add_front(panel, each, objectives, last and palette.line(2) or EARLIER_COLORS[k], last)
  end
  local rows = fronts[#fronts].rows
  add_letters(run, rows)
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
    { name = "archive", title = "Archive", foot = "Maps: the run of an arm whose last champion is"
        .. " the best; hatched cells are empty. " .. meaning,
      panels = joined(of_arms(drawn, map, label), by_generation(list, {
        { "coverage", "share of the cells (1)", field("archive", "coverage") },
        { "QD score", "QD score " .. of, field("archive", "qd_score") },
        { "robots in the archive", "robots", field("archive", "filled") },
        { "best in the archive", label, field("archive", "best") } })) },
    { name = "front", title = "Pareto front", foot = "Fronts: the run of an arm whose last"
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
        .. " an arm whose last champion is the best.", panels = of_arms(drawn, islands, label) },
  }
end

return archives
