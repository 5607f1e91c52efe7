--- summary.lua: the end of a run, read from its folder alone: how far the best of the first and of
--- the last generation came, both bodies in letters, the course of best and mean, a film strip, and
--- what to do next.

local body_picture = require "limax.draw.body_picture"
local choice = require "limax.base.choice"
local engine = require "limax.engine"
local film_strip = require "limax.draw.film_strip"
local fitness = require "limax.fitness"
local host = require "limax.host"
local robot = require "limax.robot.robot"
local run_folder = require "limax.run.run_folder"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"
local text_plot = require "limax.draw.text_plot"
local shell = require "limax.base.shell"

local summary = {}

local best_color, mean_color = 214, 67

-- ---- reading ------------------------------------------------------------------------------------

local function read_all(path)
  local text, message = source.read(path)
  if not text then engine.fail(message) end
  return text
end

local function decoded(text, origin)
  local value, message = host.json.decode(text, origin)
  if value == nil then engine.fail(message) end
  return value
end

-- Lines of metrics by repetition, in the order of the file: { [repetition] = list }, and the
-- repetitions.
local function read_metrics(folder)
  local path = folder .. "/metrics.jsonl"
  local by_repetition, repetitions = {}, {}
  for line in read_all(path):gmatch "[^\n]+" do
    local entry = decoded(line, path)
    if not by_repetition[entry.repetition] then
      by_repetition[entry.repetition] = {}
      repetitions[#repetitions + 1] = entry.repetition
    end
    table.insert(by_repetition[entry.repetition], entry)
  end
  return by_repetition, repetitions
end

local function score_of(entry) return entry.best_standard or entry.best end

---@class limax.summary.best one generation's champion
---@field generation integer
---@field description limax.robot.description
---@field robot limax.robot
---@field distance number|nil m
---@field speed number|nil m/s
---@field lengths number|nil body lengths per second
---@field path string

-- The champion of one generation and what its simulation measured.
local function champion_of(folder, repetition, generation)
  local path = folder .. "/" .. run_folder.place(repetition, "champions", generation, ".json")
  local description = decoded(read_all(path), path)
  local made = robot.of(description)
  local best = { generation = generation, description = description, path = path, robot = made }
  local outcome = description.outcome
  if outcome and outcome.status == "done" then
    local walked = scored_robot.new({ id = description.id, status = "done", outcome = outcome,
      body = made.body }, { options = { edge = description.edge } })
    best.distance, best.speed = walked:distance(), walked:speed()
    best.lengths = best.speed / walked:length()
  end
  return best
end

-- ---- what to type next --------------------------------------------------------------------------

-- The name of a folder that does not exist yet: the run's own with a word at its end.
local function beside(folder, word)
  local base = folder:gsub("/+$", "") .. "-" .. word
  local name, n = base, 2
  while host.file.exists(name) do name, n = base .. "-" .. n, n + 1 end
  return name
end

-- Three commands that work as they stand.
local function next_commands(folder, config)
  local limax, commands = shell.program(), {}
  local script = config.run and config.run.path
  local function add(command, why) commands[#commands + 1] = { command, why } end
  if script and host.file.exists(script) == "file" then
    -- the same changes, but for the one that a command makes itself
    local function again(field, value, word)
      local words = { limax, "run", shell.path(script) }
      for _, change in ipairs(config.run.overrides or {}) do
        if change:match "^[^=]*" ~= field then
          words[#words + 1] = "--set " .. shell.quoted(change)
        end
      end
      words[#words + 1] = ("--set %s=%d --out %s"):format(field, value,
        shell.path(beside(folder, word)))
      return table.concat(words, " ")
    end
    local seed = (tonumber(config.seed) or 0) % 1000 + 1
    add(again("seed", seed, "seed" .. seed), "another seed: is it luck?")
    local limit = config.evaluations and "evaluations" or "generations"
    add(again(limit, 2 * config[limit], "longer"), "twice as long")
  end
  local examples = {
    { "run ", "jump.lua", "evolve jumping" },
    { "run ", "walk.lua", "evolve walking" },
    { "", "by_hand.lua", "drop a robot that is described by hand" },
  }
  for _, example in ipairs(examples) do
    local path = host.home .. "/scripts/experiments/" .. example[2]
    if #commands < 3 and host.file.exists(path) == "file" and path ~= script then
      add(("%s %s%s"):format(limax, example[1], shell.path(path)), example[3])
    end
  end
  return commands
end

-- ---- showing ------------------------------------------------------------------------------------

local function number(value, pattern) return value and pattern:format(value) or "-" end

--- What the fitness of a configuration is: its unit, and a sentence. A script's own function says
--- neither.
---@param given any `fitness` of config.json
---@return string|nil unit
---@return string words
function summary.fitness_words(given)
  local options = type(given) == "table" and given or {}
  local name = options.name or given
  local entry = type(name) == "string" and fitness.entries[name]
  if not entry then return nil, "a function of the script" end
  -- "m/s; with body_lengths = true, body lengths per second"
  local unit, condition, other = entry.unit:match "^(.-); with ([%w_]+) = true, (.*)$"
  unit = condition and options[condition] and other or unit or entry.unit
  local chosen = {}
  for _, option in ipairs(schema.names(options, "fitness") or {}) do
    if option ~= "name" then
      chosen[#chosen + 1] = ("%s = %s"):format(option, tostring(options[option]))
    end
  end
  local which = #chosen > 0 and (" (%s)"):format(table.concat(chosen, ", ")) or ""
  return unit, ("%s%s, %s: %s"):format(name, which, unit == "1" and "no unit" or unit,
    entry.formula)
end

-- Columns for numbers that a fitness names; more make the table wider than a terminal.
local most_measures = 3

local function best_table(lines, first, last, unit, style)
  local heads = { "best of", "distance, m", "speed, m/s", "body lengths/s",
    unit and unit ~= "1" and "fitness, " .. unit or "fitness" }
  local names = choice.sorted_keys(lines[#lines].measures or {})
  for k = 1, math.min(#names, most_measures) do heads[#heads + 1] = names[k] end
  local rows = {}
  for k, best in ipairs { first, last } do
    local d = best.description
    local row = { ("generation %d"):format(best.generation), number(best.distance, "%.3f"),
      number(best.speed, "%.3f"), number(best.lengths, "%.2f"), number(d.score, "%.5g") }
    local measures = (k == 1 and lines[1] or lines[#lines]).measures or {}
    for m = 1, math.min(#names, most_measures) do
      row[#row + 1] = number(measures[names[m]] and measures[names[m]].champion, "%.5g")
    end
    rows[k] = row
  end
  return terminal.table(heads, rows, style)
end

local function bodies(first, last, style)
  local lattice = last.description.lattice
  -- more letters than this are no picture any more
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

local function plot(lines, style)
  local best, mean = {}, {}
  for k, entry in ipairs(lines) do
    best[k], mean[k] = { entry.generation, score_of(entry) }, { entry.generation, entry.mean }
  end
  local series = {
    { name = "mean", points = mean, color = mean_color, dotted = not (style.color or style.ascii) },
    { name = "best", points = best, color = best_color },
  }
  return text_plot.draw(series, { style = style, x = "generation", y = "fitness" })
end

-- One line per repetition, where there are several.
local function repetition_table(by_repetition, repetitions, style)
  local rows = {}
  for _, repetition in ipairs(repetitions) do
    local lines = by_repetition[repetition]
    local first, last = lines[1], lines[#lines]
    rows[#rows + 1] = { repetition, #lines, score_of(first), score_of(last), last.mean,
      last.diversity.all and last.diversity.all.hamming or "-" }
  end
  return terminal.table({ "repetition", "generations", "first best", "last best", "last mean",
    "diversity" }, rows, style)
end

-- The repetition whose last generation has the best score: its champion is shown.
local function leading(by_repetition, repetitions)
  local found
  for _, repetition in ipairs(repetitions) do
    local lines = by_repetition[repetition]
    local score = score_of(lines[#lines])
    if not found or score > score_of(by_repetition[found][#by_repetition[found]]) then
      found = repetition
    end
  end
  return found
end

---@class limax.summary.options
---@field color? boolean
---@field ascii? boolean
---@field width? integer columns
---@field write? fun(text: string) standard output if absent
---@field film? boolean false leaves the film strip out
---@field device? string|limax.device for the film strip

--- Shows the end of a run, and writes champion.svg into its folder.
---@param folder string
---@param options? limax.summary.options
function summary.show(folder, options)
  options = options or {}
  local write = options.write or function(text) io.stdout:write(text) end
  local style = terminal.style(options)
  local config = decoded(read_all(folder .. "/config.json"), folder .. "/config.json")
  local by_repetition, repetitions = read_metrics(folder)
  if #repetitions == 0 then
    write(("%s: no generation has been scored yet\n"):format(folder))
    return
  end
  local repetition = leading(by_repetition, repetitions)
  local lines = by_repetition[repetition]
  local first = champion_of(folder, repetition, lines[1].generation)
  local last = champion_of(folder, repetition, lines[#lines].generation)

  write(("\n%s: %d generations of %d robots, repetition %d, seed %s\n\n"):format(
    terminal.bold(config.name, style), #lines, config.population, repetition,
      tostring(config.seed)))
  if #repetitions > 1 then write(repetition_table(by_repetition, repetitions, style) .. "\n\n") end
  local unit, words = summary.fitness_words(config.fitness)
  write(best_table(lines, first, last, unit, style) .. "\n")
  write(("fitness: %s\n\n"):format(words))
  write(bodies(first, last, style) .. "\n\n")
  write(plot(lines, style) .. "\n")

  if options.film ~= false then
    local path = folder .. "/champion.svg"
    local walked, message = film_strip.write(path, last.robot,
      { device = options.device, title = ("%s: champion of generation %d"):format(config.name,
        last.generation) })
    write(("\nfilm strip  %s\n"):format(walked and shell.path(path) or message))
  end
  write(("champion    %s\n"):format(shell.path(last.path)))
  write(("a page      %s report %s\n"):format(shell.program(), shell.path(folder)))

  write "\nnext:\n"
  for _, command in ipairs(next_commands(folder, config)) do
    write(("  %s\n      %s\n"):format(command[1], terminal.dim(command[2], style)))
  end
end

return summary
