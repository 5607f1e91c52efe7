--- study.lua: a study of whether supervision helps. It runs every arm of plan.lua in every
--- repetition, with equal budgets of evaluations and equal first populations, and then compares as
--- `limax compare` does. A study is a folder, and continues if it is started there again.

local arms = require "limax.tools.report.arms"
local budget = require "limax.experiment.budget"
local cells = require "limax.tools.study.cells"
local duration = require "limax.base.duration"
local engine = require "limax.engine"
local evolve = require "limax.evolution.evolve"
local exchange = require "limax.base.exchange"
local experiments = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local options = require "limax.base.options"
local outcome = require "limax.tools.compare.outcome"
local output = require "limax.base.output"
local plan = require "limax.tools.study.plan"
local rank_share = require "limax.tools.study.rank_share"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local study_file = require "limax.run.study_file"
local sweep = require "limax.tools.study.sweep"
local tables = require "limax.tools.compare.tables"
local terminal = require "limax.base.terminal"
local tuning = require "limax.tools.study.tuning"
local verdict = require "limax.tools.compare.verdict"

local study = {}

-- Flushed, so that a redirected output can be followed.
local function print_line(text)
  output.write(text, "\n")
  io.stdout:flush()
end

-- The experiment with its budget, and as many generations as the budget allows.
local function resolve(settings)
  local base = source.copy(settings.experiment)
  base.generations, base.repetitions = 1e6, settings.repetitions
  local config = experiments.new(base).config
  local least = tuning.MIN_STUDY_POPULATIONS * config.population
  if settings.evaluations < least then
    failure.raise(2, ("a study needs evaluations for at least %d populations, %d, got %d"):format(
      tuning.MIN_STUDY_POPULATIONS, least, settings.evaluations))
  end
  config.evaluations = settings.evaluations
  base.generations, base.evaluations = budget.most_generations(config), settings.evaluations
  return experiments.new(base), base.generations
end

--- A study of an experiment, not started.
---@param settings { experiment: table, out: string, repetitions: integer, evaluations: integer,
--- device: limax.device|nil, arms: string[]|nil, quick: boolean|nil, with_model: boolean|nil,
--- say: nil|fun(text: string) } `experiment` is without name, supervisor, supervision, generations,
--- evaluations and repetitions; `evaluations` of each arm and repetition; `arms`: all if left out;
--- `with_model`: whether an endpoint is configured, if left out; `say` receives a line per run
function study.new(settings)
  if settings.repetitions < 2 then
    failure.raise(2, "a study needs at least two repetitions: some arms read another one")
  end
  local with_model = settings.with_model
  if with_model == nil then with_model = (os.getenv "LIMAX_LLM_URL" or "") ~= "" end
  local experiment, generations = resolve(settings)
  local arms_of_study = plan.choose(plan.arms(experiment.config, with_model), settings.arms)
  local say, warned = settings.say or print_line, {}
  ---@class limax.study
  ---@field tuned table<integer, { breeding: table, evaluations: integer }> by repetition
  ---@field generations integer an upper bound: evaluations end a run first
  ---@field warn fun(text: string) prints each warning of the runs once
  return { out = settings.out:gsub("(.)/+$", "%1"), options = settings.experiment,
    config = experiment.config, fitness = experiment.fitness.call,
    repetitions = settings.repetitions, evaluations = settings.evaluations,
    generations = generations, tuned = {}, quick = settings.quick or false,
    device = settings.device or engine.device "auto", say = say,
    warn = function(text)
      if not warned[text] then say(text) end
      warned[text] = true
    end,
    arms = arms_of_study, cells = plan.cells(arms_of_study, settings.repetitions) }
end

-- Wall time of one evaluation: the first generation of the first cell, simulated and scored.
local function seconds_per_evaluation(self)
  local run = evolve.start(cells.experiment(self, self.cells[1]), { repetition = 1,
    device = self.device, say = function() end })
  local began = host.clock()
  local robots = run:generations()()
  robots:simulate():score()
  return (host.clock() - began) / #robots
end

-- Evaluations, hours and tokens of the remaining runs, estimated from one generation on this
-- machine.
local function cost_of(self)
  local left, asking, names = 0, 0, {}
  for k, arm in ipairs(self.arms) do names[k] = arm.name end
  for _, cell in ipairs(self.cells) do
    if not cells.is_done(self.out .. "/" .. cell.path) then
      left, asking = left + 1, asking + (cell.arm.asks and 1 or 0)
    end
  end
  local evaluations = left * self.evaluations
  local seconds = evaluations * seconds_per_evaluation(self)
  local tokens = "none: no arm asks a language model"
  if asking > 0 then
    local population = self.config.population
    -- with the default share of elites
    local bred = math.ceil((1 - self.config.breeding.elite_fraction) * population)
    local answers = asking * math.ceil((self.evaluations - population) / bred)
    tokens = ("about %.2g million for %d answers, whose time is not included"):format(
      answers * plan.TOKENS / 1e6, answers)
  end
  return table.concat({
    ("%d arms (%s), %d repetitions: %d of %d runs left"):format(#names, table.concat(names, " "),
      self.repetitions, left, #self.cells),
    ("evaluations: at most %d, %d a run"):format(evaluations, self.evaluations),
    ("time: about %.2g h (%s) of simulating, measured on one generation"):format(seconds / 3600,
      duration(seconds)),
    "tokens: " .. tokens,
    ("folder: %s; the study can be stopped at any time and started again"):format(self.out),
  }, "\n")
end

-- Writes the list of runs that `limax compare` reads.
local function write_list(self)
  local list = host.json.array {}
  for k, cell in ipairs(self.cells) do
    local tuned = cell.arm.tuned and self.tuned[cell.repetition]
    list[k] = { path = cell.path, arm = cell.arm.name, repetition = cell.repetition,
      tuning_evaluations = tuned and tuned.evaluations or nil,
      donor = cell.donor
        and ("parameters of another repetition of %s"):format(cell.donor.arm.name) or nil,
      donor_repetition = cell.donor and cell.donor.repetition or nil }
  end
  local made, message = host.file.mkdir(self.out)
  if not made then failure.raise(1, message) end
  study_file.write(self.out, { evaluations = self.evaluations, repetitions = self.repetitions,
    quick = self.quick, runs = list })
end

local function run_cell(self, k, cell)
  local began, spent = host.clock(), ""
  if cell.arm.tuned then
    local tuned = tuning.run(self, cell.repetition)
    self.tuned[cell.repetition] = tuned
    write_list(self)
    spent = (", %d more in tuning"):format(tuned.evaluations)
  end
  local result = cells.run { experiment = cells.experiment(self, cell), device = self.device,
    repetition = cell.repetition, path = self.out .. "/" .. cell.path, say = self.warn }
  local best = result.best and ("%.4g"):format(result.best) or "-"
  self.say(("[%d/%d] %s, repetition %d: %d generations, %d evaluations%s, best %s, %.1f s"):format(
    k, #self.cells, cell.arm.name, cell.repetition, result.generations, result.evaluations, spent,
    best, host.clock() - began))
end

-- s between looks at cells that other processes compute
local LOOK = 0.2

-- Computes the cells that no other process has, and waits for the others. The first rank also reads
-- those.
local function compute(self, is_first)
  local handled = {}
  repeat
    local left = 0
    for k, cell in ipairs(self.cells) do
      local done = handled[k] or cells.is_done(self.out .. "/" .. cell.path)
      local ready = not cell.donor or cells.is_done(self.out .. "/" .. cell.donor.path)
      local lock = not done and ready and sweep.claim(self, k)
      if lock or done and not handled[k] and is_first then run_cell(self, k, cell) end
      if lock then lock:free() end
      handled[k] = lock ~= nil and lock or done
      if not handled[k] then left = left + 1 end
    end
    if left > 0 then host.wait(LOOK) end
  until left == 0
end

--- Runs the remaining cells of a study, and compares. Several processes may compute one study.
---@param is_first? boolean false in all of them but one, which reports and compares
---@return table|nil comparison
function study.run(self, is_first)
  is_first = is_first ~= false
  if is_first then
    self.say(cost_of(self))
    write_list(self)
  end
  local made, message = host.file.mkdir(self.out .. "/.locks")
  if not made then failure.raise(1, message) end
  compute(self, is_first)
  if not is_first then return nil end
  write_list(self) -- others do not know what was spent on tuning here
  local groups = arms.group(runs.finished(runs.read_all({ self.out }, true)))
  -- on the CPU as in `limax compare`, so that it gives the same numbers wherever the study ran
  local outcomes = outcome.measure(runs.of(groups), engine.device "cpu",
    { fitness = self.fitness })
  local result = verdict.compare(groups, outcomes)
  tables.write(self.out .. "/compare", result, groups)
  return result
end

local command = {
  name = "supervision_study.lua", summary = "does supervision help? every arm under equal budgets",
  usage = "limax scripts/experiments/supervision_study.lua [options]",
  options = {
    { name = "out", argument = "DIR", text = "the study's folder, in which a stopped study"
      .. " continues; studies/supervision, or studies/supervision-quick" },
    { name = "repetitions", argument = "N", kind = "integer", minimum = 2, maximum = 1000,
      text = "of each arm; 10, or 3 with --quick" },
    { name = "evaluations", argument = "N", kind = "integer", minimum = 8, maximum = 1e9,
      text = "budget of each arm and repetition" },
    { name = "arms", argument = "A,B,...", text = "only these; fixed is the baseline" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "auto",
      text = "auto, cpu or cuda" },
    { name = "quick", text = "two minutes on two cores, too small for any claim" },
  },
}

--- Runs a study from the words of a script.
---@param settings { experiment: table, evaluations: integer, repetitions: integer, quick: table }
--- `quick` has the same fields, for --quick
function study.main(settings, words)
  local arguments = options.parse(command, words)
  if arguments.help then
    output.write(options.help(command))
    return
  end
  local chosen = arguments.quick and settings.quick or settings
  local out = arguments.out or "studies/supervision" .. (arguments.quick and "-quick" or "")
  local names
  for name in (arguments.arms or ""):gmatch "[^,%s]+" do
    names = names or {}
    names[#names + 1] = name
  end
  local is_first, threads = exchange.is_first, rank_share.take()
  -- of mpirun: ranks share the cells
  exchange.work_apart()
  local self = study.new { experiment = chosen.experiment, out = out, quick = arguments.quick,
    arms = names, repetitions = arguments.repetitions or chosen.repetitions,
    evaluations = arguments.evaluations or chosen.evaluations,
    device = engine.device(arguments.device, { threads = threads }) }
  local result = study.run(self, is_first)
  if not result then return end
  output.write("\n", tables.text(result, terminal.style()), "\n")
  if self.quick then print_line "--quick: too small for any claim" end
  print_line(("Tables, figures and their data: %s/compare"):format(out))
end

return study
