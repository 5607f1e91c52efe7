--- compare.lua: `limax compare RUN...`: do the arms of these runs differ? One outcome, exact tests,
--- and the power of this many runs.

local arms = require "limax.tools.report.arms"
local choice = require "limax.base.choice"
local engine = require "limax.engine"
local outcome = require "limax.tools.compare.outcome"
local output = require "limax.base.output"
local recorded = require "limax.tools.compare.recorded"
local runs = require "limax.tools.report.runs"
local tables = require "limax.tools.compare.tables"
local terminal = require "limax.base.terminal"
local verdict = require "limax.tools.compare.verdict"

local command = {
  summary = "compare finished runs: what can be claimed, and what cannot",
  usage = "limax compare RUN... [options]",
  text = [[
Each RUN is a run folder, or the folder of a study. Runs are grouped into arms by their
configuration without seed and repetition; a pair is equal seed and repetition. Fitness, lattice,
materials, scene, simulation (except its tier), population, generations and evaluations must be
equal in all; what moves the muscles, scene.control and scene.actuation, is part of the answer and
may differ. A run that --changed continued with fields that change what a score means is refused.

The one outcome is best_standard of the last generation: its champion, under the run's first
materials, simulated again at the tier publish; or what --outcome names in the metrics of the last
generation: coverage or QD score of archives with equal cells, the archive's best fitness, or the
hypervolume of fronts with equal objectives and reference point. Choose it before the runs. A
fitness that is a function of a script is run from its copy in the run folder, with your rights: the
folder must be sealed with your key (limax trust --help).

Where the arm and the baseline have the same pairs, the test is Wilcoxon's exact signed-rank test
with a bootstrap of the paired differences, else Mann and Whitney's exact test; p values are
adjusted by Holm over all arms. There is no claim about an arm whose evaluations differ from the
baseline's by more than one population, or whose model set less than 95 % of the generations.
Everything else is exploratory.]],
  positional = { least = 1, name = "RUN" },
  exclusive = { { "csv", "json" } },
  options = {
    { name = "outcome", argument = "NAME", value = "best_standard",
      choices = { "best_standard", unpack(choice.sorted_keys(recorded.entries)) },
      text = "what is compared" },
    { name = "baseline", argument = "ARM",
      text = "the arm that others are compared with; fixed if there is one, else the first" },
    { name = "target", argument = "VALUE", kind = "number",
      text = "target of the exploratory evaluations; the baseline's centre if left out" },
    { name = "out", argument = "DIR",
      text = "write text, CSV, JSON and the figures of a report there" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "cpu",
      text = "that simulates the champions again" },
    { name = "csv", text = "print CSV" },
    { name = "json", text = "print JSON" },
  },
}

function command.run(arguments)
  local list = runs.finished(runs.read_all(arguments, true))
  local groups = arms.group(list)
  local entry, outcomes = recorded.entries[arguments.outcome]
  if entry then
    outcomes = recorded.measure(list, arguments.outcome)
  else
    outcomes = outcome.measure(list, engine.device(arguments.device))
  end
  local result = verdict.compare(groups, outcomes, { baseline = arguments.baseline,
    target = arguments.target, outcome = entry and entry.text })
  if arguments.out then tables.write(arguments.out, result, groups) end
  local form = arguments.csv and "csv" or arguments.json and "json"
  output.write(tables[form or "text"](result, terminal.style()))
  return 0
end

return command
