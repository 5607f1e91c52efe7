--- study.lua: does supervision help? Every arm of plan.lua in every repetition, with equal budgets
--- of evaluations and equal first populations, and at the end the comparison of `limax compare`. A
--- study is a folder; started again there it goes on where it was stopped.

local arms = require "limax.tools.compare.arms"
local budget = require "limax.experiment.budget"
local cells = require "limax.tools.study.cells"
local engine = require "limax.engine"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local model_arms = require "limax.tools.study.model_arms"
local options = require "limax.base.options"
local outcome = require "limax.tools.compare.outcome"
local pages = require "limax.tools.compare.pages"
local plan = require "limax.tools.study.plan"
local probe = require "limax.tools.study.probe"
local runs = require "limax.tools.compare.runs"
local source = require "limax.base.source"
local tables = require "limax.tools.compare.tables"
local terminal = require "limax.base.terminal"
local tuning = require "limax.tools.study.tuning"
local verdict = require "limax.tools.compare.verdict"

local study = {}

---@class limax.study
---@field out string folder
---@field given table the experiment as given
---@field config table resolved
---@field fitness function
---@field repetitions integer
---@field evaluations integer of each cell
---@field generations integer that no cell reaches: evaluations end it
---@field cells limax.study.cell[]
---@field tuned table<integer, { breeding: table, evaluations: integer }> by repetition
---@field endpoints table<string, table> what runs learnt of endpoints, for those that follow
---@field device limax.device
---@field quick boolean
---@field say fun(text: string)
---@field hear fun(text: string) the warnings of runs

-- Evaluations end a run, never this many generations.
local NO_LIMIT = 1e6

-- At once: whoever reads a file of it wants to know where it stands.
local function print_line(text)
  io.stdout:write(text, "\n")
  io.stdout:flush()
end

---@class limax.study.given
---@field experiment table as for `limax.experiment`, without name, supervisor, supervision,
--- generations, evaluations and repetitions
---@field out string folder
---@field repetitions integer
---@field evaluations integer of each arm and repetition
---@field device? limax.device
---@field arms? string[] all if left out
---@field quick? boolean
---@field with_model? boolean whether there is an endpoint, if left out
---@field say? fun(text: string) hears a line per run; standard output if left out

--- A study of an experiment, not begun.
---@param given limax.study.given
---@return limax.study
function study.new(given)
  if given.repetitions < 2 then
    failure.raise(2, "a study needs two repetitions at least: arms borrow from another one")
  end
  local with_model = given.with_model
  if with_model == nil then with_model = model_arms.available() end
  local base = source.copy(given.experiment)
  base.generations, base.repetitions = NO_LIMIT, given.repetitions
  local config = experiments.new(base).config
  local population = config.population
  local least = tuning.LEAST_POPULATIONS * population
  if given.evaluations < least then
    failure.raise(2, ("a study needs evaluations for %d populations at least, %d, got %d"):format(
      tuning.LEAST_POPULATIONS, least, given.evaluations))
  end
  config.evaluations = given.evaluations
  base.generations, base.evaluations = budget.most_generations(config), given.evaluations
  local experiment = experiments.new(base)
  local self = { out = given.out:gsub("(.)/+$", "%1"), given = given.experiment,
    config = experiment.config, fitness = experiment.fitness.call, repetitions = given.repetitions,
    evaluations = given.evaluations, generations = base.generations, tuned = {},
    endpoints = {},
    device = given.device or engine.device "auto", quick = given.quick or false,
    say = given.say or print_line }
  -- what every run of an arm has to say is said once
  local said = {}
  self.hear = function(text)
    if not said[text] then self.say(text) end
    said[text] = true
  end
  self.cells = plan.cells(plan.choose(plan.arms(self.config, with_model), given.arms),
    self.repetitions)
  return self
end

-- The list of runs that `limax compare` reads; written before the first run, and when tuning has
-- told what it spent.
local function write_list(self)
  local list = host.json.array {}
  for k, cell in ipairs(self.cells) do
    local tuned = cell.arm.tuned and self.tuned[cell.repetition]
    list[k] = { path = cell.path, arm = cell.arm.name, repetition = cell.repetition,
      tuning_evaluations = tuned and tuned.evaluations or nil,
      donor = cell.donor and ("%s of another repetition of %s"):format(
        cell.arm.blind and "history" or "parameters", cell.donor.arm.name) or nil,
      donor_repetition = cell.donor and cell.donor.repetition or nil }
  end
  local made, message = host.file.mkdir(self.out)
  local text = host.json.encode({ schema = "limax.study/1", evaluations = self.evaluations,
    repetitions = self.repetitions, quick = self.quick, runs = list }, { indent = 2 }) .. "\n"
  if made then made, message = host.file.write_atomic(self.out .. "/" .. runs.STUDY, text) end
  if not made then failure.raise(1, message) end
end

--- Runs what is left of a study, and compares.
---@param self limax.study
---@return table result of verdict.compare
function study.run(self)
  self.say(probe.text(self))
  write_list(self)
  for k, cell in ipairs(self.cells) do
    local began, spent = host.clock(), ""
    if cell.arm.tuned then
      self.tuned[cell.repetition] = tuning.run(self, cell.repetition)
      write_list(self)
      spent = (", %d more in tuning"):format(self.tuned[cell.repetition].evaluations)
    end
    local result = cells.run { experiment = cells.experiment(self, cell), device = self.device,
      repetition = cell.repetition, path = self.out .. "/" .. cell.path, say = self.hear }
    local best = result.best and ("%.4g"):format(result.best) or "-"
    self.say(("[%d/%d] %s, repetition %d: %d generations, %d evaluations%s, best %s, %.1f s")
      :format(k, #self.cells, cell.arm.name, cell.repetition, result.generations,
      result.evaluations, spent, best, host.clock() - began))
  end
  local groups = arms.group(runs.read(runs.expand { self.out }))
  local list = {}
  for _, group in ipairs(groups) do
    for _, run in ipairs(group.runs) do list[#list + 1] = run end
  end
  -- as `limax compare` does, so that it repeats the same numbers wherever the study ran
  local outcomes = outcome.measure(list, engine.device "cpu", self.fitness)
  local result = verdict.compare(groups, outcomes)
  pages.write(self.out .. "/compare", result, groups, outcomes)
  return result
end

-- ---- as a script --------------------------------------------------------------------------------

local command = {
  name = "supervision_study.lua", summary = "does supervision help? every arm under equal budgets",
  usage = "limax scripts/experiments/supervision_study.lua [options]",
  options = {
    { name = "out", argument = "DIR", value = "studies/supervision",
      text = "the study's folder; one that was stopped goes on" },
    { name = "repetitions", argument = "N", kind = "integer", minimum = 2, maximum = 1000,
      text = "of each arm; 10, or 3 with --quick" },
    { name = "evaluations", argument = "N", kind = "integer", minimum = 8, maximum = 1e9,
      text = "budget of each arm and repetition" },
    { name = "arms", argument = "A,B,...", text = "these alone; fixed is the baseline" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "auto",
      text = "auto, cpu or cuda" },
    { name = "quick", text = "two minutes on two cores, too small for any claim" },
  },
}

--- Runs a study from the words of a script.
---@param given { experiment: table, evaluations: integer, repetitions: integer, quick: table }
--- `quick` has the same fields, for --quick
---@param words string[]
function study.main(given, words)
  local arguments = options.parse(command, words)
  if arguments.help then
    io.stdout:write(options.help(command))
    return
  end
  local chosen = arguments.quick and given.quick or given
  local out = arguments.out
  if arguments.quick and out == "studies/supervision" then out = out .. "-quick" end
  local chosen_arms
  for name in (arguments.arms or ""):gmatch "[^,%s]+" do
    chosen_arms = chosen_arms or {}
    chosen_arms[#chosen_arms + 1] = name
  end
  local self = study.new { experiment = chosen.experiment, out = out, quick = arguments.quick,
    arms = chosen_arms,
    repetitions = arguments.repetitions or chosen.repetitions,
    evaluations = arguments.evaluations or chosen.evaluations,
    device = engine.device(arguments.device) }
  local result = study.run(self)
  io.stdout:write("\n", tables.text(result, terminal.style()), "\n")
  if self.quick then print_line "--quick: too small for any claim" end
  print_line(("Tables, figures and their data: %s/compare"):format(out))
end

return study
