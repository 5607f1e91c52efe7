--- watch.lua: `limax watch RUN`: the progress of a run in the terminal: curves, the current best,
--- failed robots. It only reads the run's files, without a lock, so it does not affect the run.

local body_picture = require "limax.draw.body_picture"
local curves = require "limax.tools.report.curves"
local host = require "limax.host"
local output = require "limax.base.output"
local page = require "limax.tools.report.page"
local runs = require "limax.tools.report.runs"
local sample = require "limax.base.statistics.sample"
local terminal = require "limax.base.terminal"
local text_plot = require "limax.draw.text_plot"

local command = {
  summary = "watch a run in progress: curves and the current best",
  usage = "limax watch RUN [options]",
  text = [[
Reads the files of a run folder after each generation until the run ends, or until Ctrl-C, which
does not affect the run. If the output is not a terminal, it prints once.]],
  positional = { least = 1, most = 1, name = "RUN" },
  options = {
    { name = "every", argument = "SECONDS", kind = "number", minimum = 0.1, maximum = 3600,
      value = 1, text = "interval" },
    { name = "once", text = "print once" },
  },
}

-- Letters of a body that is shown.
local MOST_LETTERS = 1000
-- Generations over which the pace is measured.
local LATEST = 10

-- Mean seconds of the last generations; nil before the first.
local function pace(folder)
  local sum, count = 0, 0
  for _, run in ipairs(folder.runs) do
    for k = math.max(1, #run.timing - LATEST + 1), #run.timing do
      for _, value in pairs(run.timing[k].seconds) do sum = sum + value end
      count = count + 1
    end
  end
  return count > 0 and sum / count or nil
end

-- The state of the run, and how fast it goes on.
local function state_line(folder, style)
  local each = pace(folder)
  local parts = { terminal.bold(folder.config.name, style), folder.state,
    ("generation %d of %s"):format(runs.generations(folder)) }
  if folder.state == "running" and each then parts[#parts + 1] = ("%.3g s each"):format(each) end
  return table.concat(parts, "   ")
end

-- The layers of a run's champion as letters; nil if its file is missing or it is large.
local function letters(run, style)
  local description = runs.description(run, runs.result(run))
  local lattice = description and description.lattice
  if not lattice or lattice[1] * lattice[2] * lattice[3] > MOST_LETTERS then return nil end
  local materials = description.materials.materials
  return "\n" .. body_picture.side_by_side({ { layers = description.voxels, materials = materials,
    title = ("champion of repetition %d, lowest layer first"):format(run.repetition) } }, style)
    .. "\n" .. body_picture.legend(materials, style)
end

--- The text that is shown of a folder.
function command.text_of(folder, style)
  local parts = { state_line(folder, style) }
  for _, text in ipairs(runs.changed(folder.runs)) do
    parts[#parts + 1] = ("changed: %s; scores before and after cannot be compared"):format(text)
  end
  local list = runs.arms { folder }
  if #list == 0 then
    parts[#parts + 1] = "no generation has been scored yet"
    return table.concat(parts, "\n") .. "\n"
  end
  local label = (page.fitness_label { folder })
  local leading = runs.leading(folder.runs)
  local last, failed = leading.lines[#leading.lines], 0
  for _, run in ipairs(folder.runs) do
    for _, line in ipairs(run.lines) do failed = failed + curves.failed(line) end
  end
  local all = last.diversity.all
  parts[#parts + 1] = ("best %s   mean %s   diversity %s   failed robots %d"):format(
    runs.score(last) and ("%.4g"):format(runs.score(last)) or "-",
    last.mean and ("%.4g"):format(last.mean) or "-", all and ("%.3f"):format(all.hamming) or "-",
    failed)
  parts[#parts + 1] = ""
  local count = #folder.runs
  parts[#parts + 1] = count == 1 and label
    or ("%s, the %s of %d repetitions; the best is that of repetition %d"):format(label,
    count >= sample.LEAST_FOR_MEAN and "interquartile mean" or "median", count,
    leading.repetition)
  local drawn = curves.learning(list, "")
  parts[#parts + 1] = text_plot.panel(drawn, { style = style, rows = 10 })
  parts[#parts + 1] = letters(leading, style)
  return table.concat(parts, "\n") .. "\n"
end

-- A text that changes with each new generation and with the state.
local function mark_of(folder)
  local texts = { folder.state }
  for _, run in ipairs(folder.runs) do
    texts[#texts + 1] = ("%d:%d"):format(run.repetition, #run.lines)
  end
  return table.concat(texts, " ")
end

function command.run(arguments)
  local path = arguments[1]
  local folder = runs.read(path)
  local style = terminal.style()
  if arguments.once or not host.terminal().stdout then
    output.write(command.text_of(folder, style))
    return 0
  end
  local shown
  while true do
    local mark = mark_of(folder)
    if mark ~= shown then
      shown = mark
      -- from the top of a cleared screen; the width may have changed
      io.stdout:write "\27[H\27[2J"
      output.write(command.text_of(folder, terminal.style()))
      io.stdout:flush()
    end
    if folder.state ~= "running" then return 0 end
    host.wait(arguments.every)
    host.raise_if_interrupted()
    folder = runs.read(path)
  end
end

return command
