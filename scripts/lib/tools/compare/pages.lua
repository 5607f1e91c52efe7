--- pages.lua: the folder that `limax compare --out DIR` and a study leave: the comparison as text,
--- CSV, JSON and LaTeX, and every figure as SVG with its data as CSV.

local failure = require "limax.base.failure"
local figures = require "limax.tools.compare.figures"
local host = require "limax.host"
local source = require "limax.base.source"
local tables = require "limax.tools.compare.tables"

local pages = {}

--- Writes a comparison in every form, with the figures and their data.
---@param result table of verdict.compare
---@param outcomes table<limax.compare.run, number>
function pages.write(folder, result, list, outcomes)
  local made, message = host.file.mkdir(folder)
  if not made then failure.raise(2, message) end
  local texts = figures.files(list, outcomes)
  texts["compare.txt"] = tables.text(result, { color = false, ascii = true, width = 80 })
  texts["compare.csv"], texts["compare.json"] = tables.csv(result), tables.json(result)
  texts["compare.tex"] = tables.latex(result)
  for name, text in pairs(texts) do
    source.write(folder .. "/" .. name, text)
  end
end

return pages
