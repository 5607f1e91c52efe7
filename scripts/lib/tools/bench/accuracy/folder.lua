--- folder.lua: what `limax bench accuracy --out DIR` writes: every figure as SVG and PNG,
--- and all rows as CSV and JSON.

local csv = require "limax.base.csv"
local failure = require "limax.base.failure"
local figure = require "limax.draw.chart.figure"
local figures = require "limax.tools.bench.accuracy.figures"
local host = require "limax.host"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local folder = {}

-- mm, of a figure, and px, of a panel
local WIDTH, HEIGHT = 320, 380

-- Figures of a section.
local FIGURES = {
  work_precision = { "work_precision" },
  ranking = { "elite_regret", "kendall_tau", "distance_error" },
  evolutions = { "evolutions" },
}

--- Makes the folder, or raises before hours of measuring.
function folder.make(path)
  local made, message = host.file.mkdir(path)
  if not made then failure.raise(1, "--out: " .. message) end
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
function folder.write(path, result, sections, device, say)
  local foot, files = about(device), {}
  local function write(name, text)
    source.write(path .. "/" .. name, text)
    files[#files + 1] = name
  end
  for _, section in ipairs(sections) do
    for _, name in ipairs(FIGURES[section]) do
      local plot = figures[name](result.sections[section])
      plot.foot = ("%s. %s (%s)"):format(plot.title, plot.subtitle, foot)
      plot.height, plot.columns = plot.height or HEIGHT, plot.columns or 2
      write(name .. ".svg", figure.draw("svg", plot, WIDTH))
      -- twice the pixels, for screens and slides
      write(name .. ".png", figure.draw("png", plot, WIDTH, { zoom = 2 }))
    end
  end
  write("accuracy.csv", csv.encode(result.columns, result.rows))
  write("accuracy.json", host.json.encode({ schema = "limax.bench/1", bench = "accuracy",
    environment = host.environment(), columns = result.columns, rows = result.rows },
    { indent = 2 }) .. "\n")
  say(("\n%s: %s"):format(shell.path(path), table.concat(files, ", ")))
end

return folder
