--- charts.lua: the charts of a report by section, for its page, and as the figures of a paper: SVG
--- and PDF of 85 and 175 mm, and the numbers drawn as CSV.

local archives = require "limax.tools.report.archives"
local choice = require "limax.base.choice"
local curves = require "limax.tools.report.curves"
local failure = require "limax.base.failure"
local figure = require "limax.draw.chart.figure"
local host = require "limax.host"
local parameters = require "limax.tools.report.parameters"
local runs = require "limax.tools.report.runs"

local charts = {}

--- Arms whose populations, parameters and archives are drawn.
charts.MOST_ARMS = 6
-- Panels of a figure at most.
local MOST_PANELS = 12

---@class limax.report.section
---@field name string of its figure, and of its place on the page
---@field title string
---@field panels limax.chart.panel[] with a `caption` where the page needs one
---@field foot string what lines, bands and markers are

-- Reads a field of an object of a line of metrics.
local function field(object, name)
  return function(line) return line[object] and line[object][name] end
end

local function diversity(name)
  return function(line) return line.diversity.all and line.diversity.all[name] end
end

-- Seconds that a generation took: those of one part, or all.
local function seconds(part)
  return function(_, k, run)
    local parts, sum = run.timing[k] and run.timing[k].seconds, 0
    for name, value in pairs(parts or {}) do
      if not part or part == name then sum = sum + value end
    end
    return parts and sum
  end
end

--- The names of the numbers that the fitness of any run returns beside its score, sorted.
function charts.measure_names(list)
  local named = {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.lines) do
        for name in pairs(line.measures or {}) do named[name] = true end
      end
    end
  end
  return choice.sorted_keys(named)
end

-- Panels of values by generation, by section: title, label with the unit, and value. A panel that
-- no arm has anything for is left out.
local VALUES = {
  diversity = {
    { "voxels in which two robots differ", "share of voxels (1)", diversity "hamming" },
    { "different bodies", "bodies", diversity "distinct" },
    { "spread of the genes", "standard deviation (1)", diversity "genotype" },
    { "spread of the genes of control", "standard deviation (1)", diversity "control" } },
  search = {
    { "mean novelty", "distance (1)", field("novelty", "mean") },
    { "mean age", "generations", field("age", "mean") },
    { "greatest age", "generations", field("age", "most") },
    { "mean step size", "standard deviation (1)", field("step_size", "mean") } },
  archive = {
    { "coverage", "share of the cells (1)", field("archive", "coverage") },
    { "QD score", "sum of the fitness", field("archive", "qd_score") },
    { "robots in the archive", "robots", field("archive", "filled") } },
  front = {
    { "hypervolume", "product of the objectives", field("front", "hypervolume") },
    { "robots of the front", "robots", field("front", "size") } },
  cost = {
    { "time of a generation", "seconds (s)", seconds() },
    { "of which simulation", "seconds (s)", seconds "simulate" } },
}

-- Adds the panels of some rows.
local function add_values(panels, list, rows)
  for _, row in ipairs(rows) do
    local panel = curves.panel(list, unpack(row))
    if #panel.curves > 0 then panels[#panels + 1] = panel end
  end
  return panels
end

local function learning(list, drawn, label)
  local panels = { curves.learning(list, label) }
  if #list > 1 then
    panels[2] = curves.panel(list, "mean of the population", label,
      function(line) return line.mean end)
  end
  for _, arm in ipairs(drawn) do
    local panel = curves.population(arm, label)
    panel.caption = #arm.runs == 1 and "n = 1 run"
      or ("n = %d runs, the centre of each curve"):format(#arm.runs)
    panels[#panels + 1] = panel
  end
  return panels
end

local function measures(list)
  local rows = {}
  for k, name in ipairs(charts.measure_names(list)) do
    rows[k] = { name .. " of the champion", name,
      function(line) return runs.measure(line, name) end }
  end
  return add_values({}, list, rows)
end

-- The parameters that change in an arm.
local function set(drawn)
  local panels = {}
  for _, arm in ipairs(drawn) do
    for _, path in ipairs(parameters.changed(arm)) do
      local panel = parameters.panel(arm, path)
      if #drawn > 1 then panel.title = ("%s: %s"):format(arm.name, panel.title) end
      panels[#panels + 1] = panel
    end
  end
  return panels
end

-- Robots that failed; of one arm by how they failed.
local function failures(list)
  if #list > 1 then
    return curves.panel(list, "robots without a score", "robots", curves.failed)
  end
  local kinds = {}
  for k, name in ipairs { "invalid", "diverged", "fitness" } do
    kinds[k] = { name, field("failed", name) }
  end
  return curves.values(list[1], "robots without a score", "robots", kinds)
end

local function failed_in(list)
  local failed = 0
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.lines) do failed = failed + curves.failed(line) end
    end
  end
  return failed
end

--- The sections of these arms; one without anything to draw has no panels.
---@param label string of the fitness, with its unit
function charts.of(list, label)
  local meaning, failed = curves.meaning(list), failed_in(list)
  local drawn = { unpack(list, 1, charts.MOST_ARMS) }
  local leading = "The run of an arm whose champion is the best."
  return {
    { name = "learning", title = "Learning", panels = learning(list, drawn, label),
      foot = meaning .. " Best: of each generation, under the run's first materials." },
    { name = "measures", title = "Other measures of the fitness", panels = measures(list),
      foot = meaning .. " Of each generation's champion." },
    { name = "archive", title = "Archive", foot = "Maps: hatched cells are empty. " .. leading
        .. " " .. meaning,
      panels = add_values(archives.maps(drawn, label), list, VALUES.archive) },
    { name = "front", title = "Pareto front", foot = leading .. " " .. meaning,
      panels = add_values(archives.fronts(drawn), list, VALUES.front) },
    { name = "search", title = "Novelty, age and step size",
      foot = meaning .. " Over all robots with a score.",
      panels = add_values({}, list, VALUES.search) },
    { name = "islands", title = "Islands", foot = "The best of each island. " .. leading,
      panels = archives.islands(drawn, label) },
    { name = "diversity", title = "Diversity", foot = meaning .. " Over all robots with a score.",
      panels = add_values({}, list, VALUES.diversity) },
    { name = "parameters", title = "Parameters, and who set them", panels = set(drawn),
      foot = "Lines: each run, as applied. Markers: who set a value; without one it was kept. "
        .. parameters.MARKERS },
    { name = "failures", title = "Failures", panels = failed > 0 and { failures(list) } or {},
      foot = failed == 0 and "Every robot of every generation has a score."
        or ("Robots without a score: %d in all. %s"):format(failed, meaning) },
    { name = "cost", title = "Time and cost", foot = meaning .. " Wall time.",
      panels = add_values({}, list, VALUES.cost) },
  }
end

--- Writes the charts of arms as figures.
function charts.write(folder, list, label)
  local made, message = host.file.mkdir(folder)
  if not made then failure.raise(1, message) end
  local names = {}
  for _, each in ipairs(charts.of(list, label)) do
    if #each.panels > 0 then
      names[#names + 1], each.panels = each.name, { unpack(each.panels, 1, MOST_PANELS) }
      figure.write(folder, each)
    end
  end
  return names
end

return charts
