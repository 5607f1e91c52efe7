--- pages.lua: the folder that `limax bench accuracy --out DIR` writes: every figure as SVG and PNG;
--- all rows as CSV and JSON; and accuracy.html, one page of figures and tables that needs nothing
--- else.

local csv = require "limax.base.csv"
local failure = require "limax.base.failure"
local figure = require "limax.draw.chart.figure"
local figures = require "limax.tools.bench.accuracy.figures"
local host = require "limax.host"
local html = require "limax.tools.report.html"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local pages = {}

-- mm, of a figure, and px, of a panel
local WIDTH, HEIGHT = 320, 380

-- Title and figures of a section.
local SECTIONS = {
  work_precision = { "Work and precision", "work_precision" },
  rounding = { "Rounding", "rounding" },
  conservation = { "Conservation", "conservation" },
  ranking = { "Order of the robots", "elite_regret", "kendall_tau" },
  evolutions = { "Whole evolutions", "evolutions" },
}

local STYLE = [[
body { font: 15px/1.5 "DejaVu Sans", Verdana, Helvetica, sans-serif; color: #26282b;
  background: #ffffff; max-width: 1240px; margin: 32px auto; padding: 0 16px; }
h1 { font-size: 26px; margin-bottom: 4px; } h2 { font-size: 20px; margin: 40px 0 8px; }
p.about { color: #6b7076; margin-top: 0; } svg { max-width: 100%; height: auto; }
details { margin: 8px 0 24px; } summary { cursor: pointer; color: #1a6fae; }
table { border-collapse: collapse; font-size: 12.5px; margin-top: 8px; }
th, td { text-align: left; padding: 3px 10px 3px 0; border-bottom: 1px solid #e4e6e9; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
]]

--- Makes the folder, or raises before hours of measuring.
function pages.folder(path)
  local made, message = host.file.mkdir(path)
  if not made then failure.raise(1, "--out: " .. message) end
end

-- The rows of a section, without columns that are empty in all of them.
local function html_table(result, caption)
  local columns, titles, rows = {}, {}, {}
  for _, name in ipairs(result.columns) do
    for _, row in ipairs(result.rows) do
      if row[name] ~= nil then
        columns[#columns + 1], titles[#titles + 1] = name, name:gsub("_", " ")
        break
      end
    end
  end
  for r, row in ipairs(result.rows) do
    rows[r] = {}
    for c, name in ipairs(columns) do rows[r][c] = row[name] end
  end
  return html.table(titles, rows, caption)
end

-- The machine and build of the measurement.
local function about(device)
  local facts, environment = device:describe(), host.environment()
  local on = facts.gpus and ("%d x %s"):format(#facts.gpus, facts.gpus[1].name)
    or ("%s, %s, %d threads"):format(facts.cpu, facts.isa, device.threads)
  return ("limax %s, %s build by %s, on %s"):format(host.version, environment.build,
    environment.compiler, on)
end

--- Writes the folder.
---@param result limax.bench_result with `sections`
function pages.write(folder, result, sections, device, say)
  local foot, files = about(device), { "accuracy.html", "accuracy.csv", "accuracy.json" }
  local parts = { '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">',
    "<title>What accuracy costs</title><style>", STYLE, "</style></head><body>",
    "<h1>What accuracy costs</h1>", ('<p class="about">%s</p>'):format(html.escaped(foot)) }
  local function add(text) parts[#parts + 1] = text end
  local function write(name, text)
    source.write(folder .. "/" .. name, text)
    files[#files + 1] = name
  end
  for _, name in ipairs(sections) do
    local section = result.sections[name]
    add(("<h2>%s</h2>"):format(SECTIONS[name][1]))
    for k = 2, #SECTIONS[name] do
      local plot = figures[SECTIONS[name][k]](section)
      plot.foot = ("%s. %s (%s)"):format(plot.title, plot.subtitle, foot)
      plot.height, plot.columns = plot.height or HEIGHT, plot.columns or 2
      add(figure.draw("svg", plot, WIDTH))
      write(plot.name .. ".svg", parts[#parts])
      -- twice the pixels, for screens and slides
      write(plot.name .. ".png", figure.draw("png", plot, WIDTH, { zoom = 2 }))
    end
    add(html.details(#section.rows .. " rows", html_table(section, SECTIONS[name][1])))
  end
  add "</body></html>\n"
  source.write(folder .. "/accuracy.html", table.concat(parts, "\n"))
  source.write(folder .. "/accuracy.csv", csv.encode(result.columns, result.rows))
  source.write(folder .. "/accuracy.json", host.json.encode({ schema = "limax.bench/1",
    bench = "accuracy", environment = host.environment(), columns = result.columns,
    rows = result.rows }, { indent = 2 }) .. "\n")
  say(("\n%s: %s"):format(shell.path(folder), table.concat(files, ", ")))
end

return pages
