--- task.lua: `limax task`: lists the tasks, runs one, and scores the champions of a run on worlds
--- that no run has seen.

local bootstrap = require "limax.base.statistics.bootstrap"
local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local output = require "limax.base.output"
local run = require "limax.commands.run"
local runs = require "limax.tools.report.runs"
local sample = require "limax.base.statistics.sample"
local script = require "limax.base.script"
local scripts = require "limax.run.scripts"
local source = require "limax.base.source"
local task = require "limax.experiment.task"

local FOLDER = host.home .. "/scripts/tasks"

local command = {
  summary = "list tasks with a score to reach for, run one, or score a run",
  usage = "limax task list\n       limax task run NAME|FILE [options]\n       limax task score DIR",
  text = [[
A task is an experiment whose score others can reach for: scripts/TASKS.md. `run` takes all options
of `limax run`. `score` simulates the champion of the last generation at `publish`, on 32 worlds
that no run has seen where a task draws its worlds, all together, and writes the mean of its
scores.]],
  positional = { least = 1, most = 2, name = "list, run or score" },
  options = {
    { name = "small", text = "run: the task's small budget, for a first look" },
    { name = "controller", argument = "NAME",
      text = "run: sine, reflex, network, central or oscillators instead of the muscles' sine" },
  },
}
for _, option in ipairs(run.options) do
  if option.name ~= "resume" and option.name ~= "from" and option.name ~= "changed" then
    table.insert(command.options, option)
  end
end

local function path_of(name)
  return name:find "[/.]" and name or ("%s/%s.lua"):format(FOLDER, name)
end

-- The experiment of a task, and what makes it one.
local function task_of(path)
  local value = script.run(path)
  local facts = experiments.is(value) and task.of(value)
  if not facts then
    failure.raise(2, ("%s returns no task: it should end in `return limax.task { ... }`"):format(
      path))
  end
  return value, facts
end

local function names()
  local list = {}
  for _, file in ipairs(host.file.list(FOLDER)) do
    list[#list + 1] = file:match "^(.*)%.lua$"
  end
  table.sort(list)
  return list
end

local function list()
  for _, name in ipairs(names()) do
    local _, facts = task_of(path_of(name))
    output.write(("%-10s version %d. %s\n"):format(name, facts.version, facts.about.measured),
      ("%-10s A passive body: %s\n"):format("", facts.about.passive),
      ("%-10s A fixed gait: %s\n"):format("", facts.about.fixed))
  end
end

local function start(arguments)
  local path, changes = path_of(arguments[2]), {}
  if host.file.exists(path) ~= "file" then
    failure.raise(2, ("there is no task %q; the tasks are %s"):format(arguments[2],
      table.concat(names(), ", ")))
  end
  local _, facts = task_of(path)
  for _, text in ipairs(arguments.small and facts.small or {}) do changes[#changes + 1] = text end
  if arguments.controller then changes[#changes + 1] = "scene.control=" .. arguments.controller end
  for _, text in ipairs(arguments.set or {}) do changes[#changes + 1] = text end
  local own = source.copy(arguments)
  own[1], own[2], own.set = path, nil, changes
  return run.run(own)
end

-- The champion of a run's last generation.
local function champion_of(one)
  local description, message = runs.description(one, one.lines[#one.lines])
  if not description then failure.raise_damaged(message) end
  description.materials = one.config.materials
  return description
end

local function score(arguments)
  local folder = runs.read(arguments[2])
  local config = folder.runs[1].config
  local experiment = scripts.run_copy(folder.runs[1].folder)
  if not experiments.is(experiment) or not task.of(experiment) then
    failure.raise(2, arguments[2] .. " is no run of a task")
  end
  local version = task.of(experiment).version
  experiment = experiment:override(config.run.overrides)
  local begun, champions = {}, {}
  for _, one in ipairs(folder.runs) do
    if #one.lines > 0 then
      begun[#begun + 1], champions[#champions + 1] = one, champion_of(one)
    end
  end
  if not begun[1] then return end
  local scores, wrong = task.scores(experiment, champions, task.worlds(experiment),
    engine.device(arguments.device or "auto"))
  for k, one in ipairs(begun) do
    if wrong[k] then
      failure.raise(1, ("%s: its champion has no score in a world: %s"):format(
        runs.champion(one, one.lines[#one.lines]), wrong[k]))
    end
    local spread = "1 world"
    if #scores[k] > 1 then
      local low, high = bootstrap.interval(scores[k], sample.mean)
      spread = ("95 %% interval %.4g to %.4g, %d worlds"):format(low, high, #scores[k])
    end
    output.write(("%s, version %d, repetition %d: %.4g (%s)\n"):format(config.name, version,
      one.repetition, sample.mean(scores[k]), spread))
  end
end

--- Runs the command.
function command.run(arguments)
  local action = arguments[1]
  for _, option in ipairs(action ~= "run" and command.options or {}) do
    local value = arguments[(option.name:gsub("-", "_"))]
    local is_set = value and (type(value) ~= "table" or #value > 0)
    if is_set and not (action == "score" and option.name == "device") then
      failure.raise(2, ("--%s belongs to limax task run"):format(option.name))
    end
  end
  if action == "list" and not arguments[2] then return list() end
  if (action == "run" or action == "score") and arguments[2] then
    return (action == "run" and start or score)(arguments)
  end
  failure.raise(2, "limax task: expected list, run NAME or score DIR")
end

return command
