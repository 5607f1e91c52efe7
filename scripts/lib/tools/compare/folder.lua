--- folder.lua: what `limax compare --out DIR` and a study write: the comparison as text, CSV and
--- JSON, and the figures of a report with the numbers drawn.

local figures = require "limax.tools.report.figures"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local tables = require "limax.tools.compare.tables"

local folder = {}

--- Writes a comparison in every form.
---@param list limax.compare.arm[]
function folder.write(path, result, list)
  local unit = runs.fitness_words(list[1].runs[1].config.fitness)
  figures.write(path, list, ("fitness (%s)"):format(unit or "unit of the script"))
  for ending, text in pairs {
    txt = tables.text(result, { color = false, ascii = true, width = 80 }),
    csv = tables.csv(result), json = tables.json(result),
  } do source.write(("%s/compare.%s"):format(path, ending), text) end
end

return folder
