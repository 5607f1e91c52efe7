--- figures.lua: `limax report --figures DIR`: the charts of a report and the robots of generation 0
--- and of the last, for a paper: SVG and PDF of 85 and 175 mm, and the numbers drawn as CSV.

local charts = require "limax.tools.report.charts"
local csv = require "limax.base.csv"
local failure = require "limax.base.failure"
local figure = require "limax.draw.chart.figure"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local robots = require "limax.tools.report.robots"
local runs = require "limax.tools.report.runs"
local sheet = require "limax.draw.sheet"
local view = require "limax.draw.picture.view"

local figures = {}

-- Panels of a figure at most.
local MOST_PANELS = 12

-- mm that a pose needs to be made out, and px of a capital of 8 pt
local POSE, CAPITAL = 21, 0.73 * figure.TEXT

-- The robots, one below the other, to one scale.
local function draw_robots(shown, kind, millimetres)
  local count, films, names = math.floor(millimetres / POSE), {}, {}
  for k, each in ipairs(shown) do
    films[k] = motion.of(each.walked, sheet.evenly(each.walked:duration(), count))
    names[k] = ("%s: %s"):format(each.name, each.score)
  end
  return sheet.new(films, { view = view.of.side, text = CAPITAL, names = names,
    width = math.floor(millimetres * figure.PX_PER_MM + 0.5) }):render(kind,
    { title = "Robots of generation 0 and of the last", millimetres = millimetres })
end

-- Where the middles of the robots were: along their path, away from the viewer, up, m.
local function robots_csv(shown)
  local rows = {}
  for _, each in ipairs(shown) do
    local rate = each.walked:trace("position").rate
    for s, at in ipairs(motion.of(each.walked, { 0 }).path) do
      rows[#rows + 1] = { robot = each.name, time = (s - 1) / rate, along = at[1], away = at[2],
        up = at[3] }
    end
  end
  return csv.encode({ "robot", "time", "along", "away", "up" }, rows)
end

--- Writes the charts of arms.
---@param list limax.report.arm[]
---@param label string of the fitness, with its unit
---@return string[] names
function figures.charts(folder, list, label)
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

--- Writes the charts of runs, and their robots.
---@return string[] names
function figures.write(folder, folders, label, options)
  local list = runs.arms(folders)
  local names = figures.charts(folder, list, label)
  local shown = options.robots == false and {} or robots.simulate(list, options)
  if #shown > 0 then
    names[#names + 1] = "robots"
    figure.write(folder, { name = "robots", csv = robots_csv(shown) },
      function(kind, millimetres) return draw_robots(shown, kind, millimetres) end)
  end
  return names
end

return figures
