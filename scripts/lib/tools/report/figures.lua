--- figures.lua: `limax report --figures DIR`: the charts of a report for a paper: SVG and PDF of 85
--- and 175 mm, and the numbers drawn as CSV.

local charts = require "limax.tools.report.charts"
local failure = require "limax.base.failure"
local figure = require "limax.draw.chart.figure"
local host = require "limax.host"

local figures = {}

-- Panels of a figure at most.
local MOST_PANELS = 12

--- Writes the charts of arms.
---@param list limax.report.arm[]
---@param label string of the fitness, with its unit
---@return string[] names
function figures.write(folder, list, label)
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

return figures
