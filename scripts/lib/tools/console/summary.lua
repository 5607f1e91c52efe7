--- summary.lua: the end of a run, read from its folder: distance and speed of the best robots of
--- the first and the last generation, both bodies in letters, the curves of best and mean, a film
--- strip, and the command that makes a page.

local body_picture = require "limax.draw.body_picture"
local budget = require "limax.experiment.budget"
local choice = require "limax.base.choice"
local curves = require "limax.tools.report.curves"
local failure = require "limax.base.failure"
local output = require "limax.base.output"
local sheet = require "limax.draw.sheet"
local robot = require "limax.robot.robot"
local runs = require "limax.tools.report.runs"
local shell = require "limax.base.shell"
local terminal = require "limax.base.terminal"
local text_plot = require "limax.draw.text_plot"

local summary = {}

-- The champion of one generation and what its simulation measured.
local function champion_of(run, line)
  local description, message = runs.description(run, line)
  if not description then failure.raise(1, message) end
  local made = robot.of(description)
  local best = { generation = line.generation, description = description, robot = made,
    measures = line.measures or {} }
  local outcome = description.outcome
  if outcome and outcome.status == "done" then
    local first, last, size = outcome.center_start, outcome.center_end, made.body.size
    best.distance = math.sqrt((last[1] - first[1]) ^ 2 + (last[2] - first[2]) ^ 2)
    best.speed = best.distance / outcome.time
    best.lengths = best.speed / (math.max(size[1], size[2]) * description.edge)
  end
  return best
end

local function number(value, pattern) return value and pattern:format(value) or "-" end

-- Columns for numbers that a fitness names; more make the table wider than a terminal.
local most_measures = 3

-- `since`: the first generation whose scores can be compared with the last one's.
local function best_table(first, last, since, unit, style)
  local heads = { "best of", "distance, m", "speed, m/s", "body lengths/s",
    unit and unit ~= "1" and "fitness, " .. unit or "fitness" }
  local names, rows = choice.sorted_keys(last.measures), {}
  for k = 1, math.min(#names, most_measures) do heads[#heads + 1] = names[k] end
  for k, best in ipairs { first, last } do
    local before = best.generation < since and ", before the change" or ""
    local row = { ("generation %d%s"):format(best.generation, before),
      number(best.distance, "%.3f"), number(best.speed, "%.3f"), number(best.lengths, "%.2f"),
      number(best.description.score, "%.5g") }
    for m = 1, math.min(#names, most_measures) do
      local measure = best.measures[names[m]]
      row[#row + 1] = number(measure and measure.champion, "%.5g")
    end
    rows[k] = row
  end
  return terminal.table(heads, rows, style)
end

local function bodies(first, last, style)
  local lattice = last.description.lattice
  -- larger bodies are not readable as letters
  if lattice[1] * lattice[2] * lattice[3] > 1000 then
    return ("bodies of %dx%dx%d voxels: in letters in the champion's file"):format(unpack(lattice))
  end
  local function picture(best, title)
    return { title = ("%s, generation %d"):format(title, best.generation),
      layers = best.description.voxels, materials = best.description.materials.materials }
  end
  return body_picture.side_by_side({ picture(first, "best"), picture(last, "champion") }, style)
    .. "\n\n" .. body_picture.legend(last.description.materials.materials, style)
end

local function repetition_table(list, style)
  local rows = {}
  for k, run in ipairs(list) do
    local first, last = run.lines[1], run.lines[#run.lines]
    rows[k] = { run.repetition, #run.lines, runs.score(first), runs.score(last), last.mean,
      last.diversity.all and last.diversity.all.hamming or "-", runs.changed({ run })[1] }
  end
  local heads = { "repetition", "generations", "first best", "last best", "last mean", "diversity" }
  if runs.changed(list)[1] then heads[#heads + 1] = "changed" end
  return terminal.table(heads, rows, style)
end

--- Shows the end of a run, and writes champion.svg into its folder.
---@param options? { color?: boolean, ascii?: boolean, width?: integer, write?: fun(text: string),
--- device?: string|limax.device } columns; standard output; of the film strip
function summary.show(folder, options)
  options = options or {}
  local write = options.write or output.write
  local style = terminal.style(options)
  local found = runs.read(folder)
  if #found.runs == 0 then
    write(("%s: no generation has been scored yet\n"):format(folder))
    return
  end
  local config, run = found.config, runs.leading(found.runs)
  local lines = run.lines
  local result = runs.result(run)
  local first, last = champion_of(run, lines[1]), champion_of(run, result)

  local spent, ending = 0, ""
  for _, line in ipairs(lines) do spent = spent + line.evaluations end
  if #lines < config.generations and not budget.allows_another(config, #lines, spent) then
    ending = ("; evaluations = %d allow %d of %d generations"):format(config.evaluations, #lines,
      config.generations)
  end
  write(("\n%s: %d generations of %d robots, repetition %d, seed %s%s\n\n"):format(
    terminal.bold(config.name, style), #lines, config.population, run.repetition, run.seed, ending))
  if #found.runs > 1 then write(repetition_table(found.runs, style) .. "\n\n") end
  local unit, words = runs.fitness_words(config.fitness)
  local since = runs.comparable(run)[1].generation
  write(best_table(first, last, since, unit, style) .. "\n")
  local changed = runs.changed({ run })[1]
  if changed then
    write(terminal.bold(("changed: %s; scores before and after cannot be compared"):format(changed),
      style) .. "\n")
  end
  write(("fitness: %s\n\n"):format(words))
  local archive = lines[#lines].archive
  if archive and archive.cells then
    write(("archive: robots in %d of %d cells, coverage %.3f, QD score %.5g\n\n"):format(
      archive.filled, archive.cells, archive.coverage, archive.qd_score))
  end
  local failures = runs.supervisor_failures(found.runs)
  if failures then write(terminal.bold("supervisor: " .. failures, style) .. "\n\n") end
  write(bodies(first, last, style) .. "\n\n")
  local curve = curves.learning({ { name = "best", runs = { run } } }, "fitness")
  write(text_plot.panel(curve, { style = style }) .. "\n")

  local path = folder .. "/champion.svg"
  -- a run is complete without its picture
  local fine, drawn, message = failure.attempt(sheet.write_film_strip, path, last.robot,
    { device = options.device,
      title = ("%s: champion of generation %d"):format(config.name, last.generation) })
  write(("\nfilm strip  %s\n"):format(fine and drawn and shell.path(path)
    or tostring(fine and message or drawn)))
  write(("champion    %s\n"):format(shell.path(runs.champion(run, result))))
  write(("a page      %s report %s\n"):format(shell.program(), shell.path(folder)))
end

return summary
