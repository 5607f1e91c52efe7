--- figures.lua: `limax report --figures DIR`: learning, diversity, parameters and generation 0
--- against the last, as numbers and as robots, for a paper: SVG and PDF of 85 and 175 mm, and the
--- numbers drawn as CSV.

local csv = require "limax.base.csv"
local curves = require "limax.tools.report.curves"
local failure = require "limax.base.failure"
local figure = require "limax.draw.chart.figure"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local parameters = require "limax.tools.report.parameters"
local robots = require "limax.tools.report.robots"
local runs = require "limax.tools.report.runs"
local sheet = require "limax.draw.sheet"
local view = require "limax.draw.picture.view"

local figures = {}

-- Panels of a figure at most.
local MOST_PANELS = 12

local function learning(list, label)
  return { name = "learning", title = "Learning curves", foot = curves.meaning(list)
    .. " Best: of each generation, under the run's first materials.", panels = {
      curves.panel(list, "best of the generation", label, runs.score),
      curves.by_evaluations(list, "best, by evaluations", label, runs.score),
      curves.panel(list, "mean of the population", label, function(line) return line.mean end),
    } }
end

local function diversity(list)
  return { name = "diversity", title = "Diversity curves", panels = curves.diversity(list),
    foot = curves.meaning(list) .. " Over all robots with a score." }
end

local function measures(list)
  local panels = { unpack(curves.measures(list), 1, MOST_PANELS) }
  if #panels == 0 then return nil end
  return { name = "measures", title = "Other measures of the fitness", panels = panels,
    foot = curves.meaning(list) .. " Of each generation's champion." }
end

local function supervision(list)
  local panels, key, seen = {}, {}, {}
  for _, arm in ipairs(list) do
    for _, path in ipairs((parameters.fields { arm })) do
      local panel, setters = parameters.panel(arm, path)
      if #list > 1 then panel.title = ("%s: %s"):format(arm.name, panel.title) end
      if #panels < MOST_PANELS then
        panels[#panels + 1] = panel
        for name in pairs(setters) do seen[name] = true end
      end
    end
  end
  if #panels == 0 then return nil end
  for _, setter in ipairs(parameters.SETTERS) do
    if seen[setter.name] then
      key[#key + 1] = { marker = setter.marker, color = setter.color,
        text = setter.text or setter.name }
    end
  end
  local counts = {}
  for k, arm in ipairs(list) do
    counts[k] = ("%s%d"):format(#list > 1 and arm.name .. " " or "", #arm.runs)
  end
  return { name = "parameters", title = "Parameters, and who set them", panels = panels, key = key,
    foot = ("Lines: each run (n = %s), as applied. Markers: who set a value; without one it was"
      .. " kept."):format(table.concat(counts, ", ")) }
end

local function first_last(list, label)
  local panel = curves.first_last(list, "best of generation 0 and of the last", label,
    function(run) return runs.score(run.lines[1]) or 0 end,
    function(run) return runs.score(run.lines[#run.lines]) or 0 end)
  return { name = "first_last", title = "Generation 0 against the last", panels = { panel },
    foot = (curves.meaning(list):gsub("; band[^.]*", "")) .. " Thin lines: single runs." }
end

-- mm that a pose needs to be made out, and px of a capital of 8 pt
local POSE, CAPITAL = 21, 0.73 * figure.TEXT

-- The robots, one below the other, to one scale.
local function draw_robots(shown, kind, millimetres)
  local count, films, names = math.floor(millimetres / POSE), {}, {}
  for k, each in ipairs(shown) do
    films[k] = motion.of(each.walked, sheet.evenly(each.walked:duration(), count))
    names[k] = ("%s: %.2f m in %.4g s"):format(each.name, each.walked:distance(),
      each.walked:duration())
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

--- Writes the figures.
---@param label string of the fitness, with its unit
---@return string[] names
function figures.write(folder, folders, label, options)
  local made, message = host.file.mkdir(folder)
  if not made then failure.raise(1, "--figures: " .. message) end
  local list, names = runs.arms(folders), {}
  local all = { learning(list, label), diversity(list), first_last(list, label) }
  all[#all + 1] = measures(list)
  all[#all + 1] = supervision(list)
  for k, each in ipairs(all) do
    names[k] = each.name
    figure.write(folder, each)
  end
  local shown = options.robots == false and {} or robots.simulate(list, options)
  if #shown > 0 then
    names[#names + 1] = "robots"
    figure.write(folder, { name = "robots", csv = robots_csv(shown) },
      function(kind, millimetres) return draw_robots(shown, kind, millimetres) end)
  end
  return names
end

return figures
