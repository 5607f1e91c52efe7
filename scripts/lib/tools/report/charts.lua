--- charts.lua: the charts of a report by section, which the page and the figures for print share.

local archives = require "limax.tools.report.archives"
local curves = require "limax.tools.report.curves"
local parameters = require "limax.tools.report.parameters"
local runs = require "limax.tools.report.runs"

local charts = {}

--- Arms whose populations and parameters are drawn.
charts.MOST_ARMS = 6

---@class limax.report.section
---@field name string of its figure, and of its place on the page
---@field title string
---@field panels limax.chart.panel[] with a `caption` where the page needs one
---@field foot string what lines, bands and markers are
---@field key { marker: string, color: string, text: string }[]|nil

local function count_text(arm, what)
  return ("n = %d %s"):format(#arm.runs, #arm.runs == 1 and "run" or "runs" .. what)
end

local function learning(list, label)
  local panels = { curves.learning(list, label),
    curves.by_evaluations(list, "best, by evaluations", label, runs.score) }
  if #list > 1 then
    panels[3] = curves.panel(list, "mean of the population", label,
      function(line) return line.mean end)
  end
  for k = 1, math.min(#list, charts.MOST_ARMS) do
    local panel = curves.population(list[k], label)
    panel.caption = count_text(list[k], ", the centre of each curve")
    panels[#panels + 1] = panel
  end
  return panels
end

local function first_last(list, label)
  return { curves.first_last(list, "best of generation 0 and of the last", label,
    function(run) return runs.score(run.lines[1]) or 0 end,
    function(run) return runs.score(run.lines[#run.lines]) or 0 end) }
end

-- The parameters that change in any arm, and the key of who set them.
local function supervision(list)
  local panels, seen, key = {}, {}, {}
  for k = 1, math.min(#list, charts.MOST_ARMS) do
    for _, path in ipairs((parameters.fields { list[k] })) do
      local panel, setters = parameters.panel(list[k], path)
      if #list > 1 then panel.title = ("%s: %s"):format(list[k].name, panel.title) end
      panels[#panels + 1] = panel
      for name in pairs(setters) do seen[name] = true end
    end
  end
  for _, setter in ipairs(parameters.SETTERS) do
    if seen[setter.name] then key[#key + 1] = setter end
  end
  return panels, key
end

--- The sections of these arms; one without anything to draw has no panels.
---@param label string of the fitness, with its unit
---@return limax.report.section[]
function charts.of(list, label)
  local meaning, set, key = curves.meaning(list), supervision(list)
  local counts, failed = {}, 0
  for k, arm in ipairs(list) do
    counts[k] = ("%s%d"):format(#list > 1 and arm.name .. " " or "", #arm.runs)
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.lines) do failed = failed + curves.failed(line) end
    end
  end
  local sections = {
    { name = "learning", title = "Learning", panels = learning(list, label),
      foot = meaning .. " Best: of each generation, under the run's first materials." },
    { name = "first_last", title = "Generation 0 against the last",
      panels = first_last(list, label),
      foot = meaning:gsub("; band[^.]*", "") .. " Thin lines: single runs." },
    { name = "measures", title = "Other measures of the fitness", panels = curves.measures(list),
      foot = meaning .. " Of each generation's champion." },
    { name = "diversity", title = "Diversity", panels = curves.diversity(list),
      foot = meaning .. " Over all robots with a score." },
    { name = "parameters", title = "Parameters, and who set them", panels = set, key = key,
      foot = ("Lines: each run (n = %s), as applied. Markers: who set a value; without one it was"
        .. " kept."):format(table.concat(counts, ", ")) },
    { name = "failures", title = "Failures", foot = failed == 0
      and "Every robot of every generation has a score."
      or ("Robots without a score: %d in all. %s"):format(failed, meaning),
      panels = failed > 0 and { curves.failures(list) } or {} },
    { name = "cost", title = "Time and cost", panels = curves.time(list),
      foot = meaning .. " Wall time." },
  }
  local drawn = { unpack(list, 1, charts.MOST_ARMS) }
  for k, each in ipairs(archives.sections(list, drawn, label, meaning)) do
    table.insert(sections, 2 + k, each)
  end
  return sections
end

return charts
