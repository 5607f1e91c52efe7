--- report.lua: `limax report RUN...`: one self-contained page about runs, done or in progress.

local activity = require "limax.tools.console.activity"
local charts = require "limax.tools.report.charts"
local failure = require "limax.base.failure"
local output = require "limax.base.output"
local page = require "limax.tools.report.page"
local runs = require "limax.tools.report.runs"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local command = {
  summary = "write one page about runs: curves, robots in 3D, comparison, lineage, cost",
  usage = "limax report RUN... [options]",
  text = [[
Each RUN is a run folder, or the folder of a study. The page is one file that opens from disk and
loads nothing: report.html in the folder of the first RUN, or where --out says. Runs in progress are
read as they are. A run with an archive or objectives has its map or its Pareto front: click a
robot, or choose it with the arrow keys, to see its numbers and its body. With --figures the figures
of a paper are written instead: SVG and PDF of 85 and 175 mm, and the numbers drawn as CSV. Where
the fitness is a function of a script, the comparison of several arms needs runs that are yours, as
`limax compare` does. Standard error shows what is being done: on a terminal at once, else every 10
s.]],
  positional = { least = 1, name = "RUN" },
  options = {
    { name = "out", argument = "FILE", text = "write the page there" },
    { name = "figures", argument = "DIR",
      text = "write figures for print there; no page without --out" },
    { name = "no-robots", text = "leave robots and the comparison out: nothing is simulated" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "cpu",
      text = "that simulates the robots for their replays" },
  },
}

-- The page's file, whose name must not promise another format.
local function page_path(out, folder)
  if not out then return folder .. "/report.html" end
  if not out:lower():match "%.html?$" then
    failure.raise(2, ("--out %s: the page is HTML: its name must end in .html; --figures DIR"
      .. " writes figures"):format(out))
  end
  return out
end

-- Writes figures and page; returns a line about each.
local function write(arguments, show)
  local folders, lines = runs.read_all(arguments, false, show), {}
  local any = false
  for _, folder in ipairs(folders) do
    any = any or #folder.runs > 0
  end
  if not any then failure.raise(1, "no generation has been scored yet: nothing to report") end
  local options = { device = arguments.device, robots = not arguments.no_robots,
    progress = show,
    say = function(line)
      show()
      output.warn(line, "\n")
    end }
  if arguments.figures then
    show "drawing figures"
    local names = charts.write(arguments.figures, (runs.arms(folders)),
      (page.fitness_label(folders)))
    lines[1] = ("%s: %s\n"):format(shell.path(arguments.figures), table.concat(names, ", "))
    if not arguments.out then return lines end
  end
  local path = page_path(arguments.out, (arguments[1]:gsub("(.)/+$", "%1")))
  local text = page.text(folders, options)
  source.write(path, text)
  lines[#lines + 1] = ("%s: %.0f kB\n"):format(shell.path(path), #text / 1000)
  return lines
end

function command.run(arguments)
  page_path(arguments.out, "")
  local show, lines = activity.new(), nil
  failure.finally(show, function() lines = write(arguments, show) end)
  output.write(table.concat(lines))
  return 0
end

return command
