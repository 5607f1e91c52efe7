--- pages.lua: the folder that `limax bench accuracy --out DIR` leaves: every figure as SVG and PNG;
--- all rows as CSV and JSON; and accuracy.html, one page of figures and tables that needs nothing
--- else.

local csv = require "limax.base.csv"
local failure = require "limax.base.failure"
local figure = require "limax.draw.chart.figure"
local figures = require "limax.tools.bench.accuracy.figures"
local host = require "limax.host"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local pages = {}

-- mm, of a figure, and px, of a panel
local WIDTH, HEIGHT = 320, 380

-- Figures by section.
local FIGURES = {
  work_precision = { "work_precision" }, rounding = { "rounding" },
  conservation = { "conservation" }, ranking = { "elite_regret", "kendall_tau" },
  evolutions = { "evolutions" },
}

local TITLES = {
  work_precision = "Work and precision", rounding = "Rounding", conservation = "Conservation",
  ranking = "What a researcher pays", evolutions = "Whole evolutions",
}

local STYLE = [[
body { font: 15px/1.5 "DejaVu Sans", Verdana, Helvetica, sans-serif; color: #26282b;
  background: #ffffff; max-width: 1240px; margin: 32px auto; padding: 0 16px; }
h1 { font-size: 26px; margin-bottom: 4px; } h2 { font-size: 20px; margin: 40px 0 8px; }
p.about { color: #6b7076; margin-top: 0; } svg { max-width: 100%; height: auto; }
details { margin: 8px 0 24px; } summary { cursor: pointer; color: #1a6fae; }
table { border-collapse: collapse; font-size: 12.5px; margin-top: 8px; }
th, td { text-align: left; padding: 3px 10px 3px 0; border-bottom: 1px solid #e4e6e9; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
]]

local function escaped(value)
  local entities = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;" }
  return (tostring(value):gsub("[&<>\"]", entities))
end

--- Makes the folder, or says why not, before hours are spent.
function pages.folder(path)
  local made, message = host.file.mkdir(path)
  if not made then failure.raise(1, "--out: " .. message) end
end

local function cell(value)
  if value == nil then return "<td></td>" end
  if type(value) == "number" then
    return ('<td class="number">%s</td>'):format(("%.4g"):format(value))
  end
  return ("<td>%s</td>"):format(escaped(value))
end

local function html_table(result)
  local used, parts = {}, { "<table><tr>" }
  for _, row in ipairs(result.rows) do
    for name in pairs(row) do used[name] = true end
  end
  for _, name in ipairs(result.columns) do
    if used[name] then parts[#parts + 1] = ("<th>%s</th>"):format(name:gsub("_", " ")) end
  end
  parts[#parts + 1] = "</tr>\n"
  for _, row in ipairs(result.rows) do
    parts[#parts + 1] = "<tr>"
    for _, name in ipairs(result.columns) do
      if used[name] then parts[#parts + 1] = cell(row[name]) end
    end
    parts[#parts + 1] = "</tr>\n"
  end
  parts[#parts + 1] = "</table>"
  return table.concat(parts)
end

-- The machine and build of the measurement.
local function about(device)
  local facts, environment = device:describe(), host.environment()
  local on = facts.gpus and ("%d x %s"):format(#facts.gpus, facts.gpus[1].name)
    or ("%s, %s, %d threads"):format(facts.cpu, facts.isa, device.threads)
  return ("limax %s, %s build by %s, on %s"):format(host.version, environment.build,
    environment.compiler, on)
end

-- Every figure of a section, as files; its SVG texts.
local function draw(folder, section, result, about_machine, made)
  local texts = {}
  for _, name in ipairs(FIGURES[section] or {}) do
    local plot = figures[name](result)
    plot.foot = ("%s. %s (%s)"):format(plot.title, plot.subtitle, about_machine)
    plot.height, plot.columns = plot.height or HEIGHT, plot.columns or 2
    local text = figure.draw("svg", plot, WIDTH)
    texts[#texts + 1] = text
    source.write(("%s/%s.svg"):format(folder, plot.name), text)
    -- twice the pixels, for screens and slides
    source.write(("%s/%s.png"):format(folder, plot.name),
      figure.draw("png", plot, WIDTH, { zoom = 2 }))
    made[#made + 1] = plot.name .. ".svg"
    made[#made + 1] = plot.name .. ".png"
  end
  return texts
end

--- Writes the folder.
---@param result limax.bench_result with `sections`
---@param sections string[]
---@param say fun(text: string)
function pages.write(folder, result, sections, device, say)
  local foot, made = about(device), {}
  local parts = { "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">",
    "<title>What accuracy costs</title><style>", STYLE, "</style></head><body>",
    "<h1>What accuracy costs</h1>", ('<p class="about">%s</p>'):format(escaped(foot)) }
  for _, name in ipairs(sections) do
    local section = result.sections[name]
    parts[#parts + 1] = ("<h2>%s</h2>"):format(TITLES[name])
    for _, text in ipairs(draw(folder, name, section, foot, made)) do
      parts[#parts + 1] = text
    end
    parts[#parts + 1] = ("<details><summary>%d rows</summary>%s</details>"):format(#section.rows,
      html_table(section))
  end
  parts[#parts + 1] = "</body></html>\n"
  source.write(folder .. "/accuracy.html", table.concat(parts, "\n"))
  source.write(folder .. "/accuracy.csv", csv.encode(result.columns, result.rows))
  local document = { schema = "limax.bench/1", bench = "accuracy",
    environment = host.environment(), columns = result.columns, rows = result.rows }
  source.write(folder .. "/accuracy.json", host.json.encode(document, { indent = 2 }) .. "\n")
  say(("\n%s: accuracy.html, accuracy.csv, accuracy.json, %s"):format(shell.path(folder),
    table.concat(made, ", ")))
end

return pages
