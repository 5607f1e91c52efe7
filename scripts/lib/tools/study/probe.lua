--- probe.lua: the cost of a study, estimated before it begins from one generation on this machine.

local cells = require "limax.tools.study.cells"
local evolve = require "limax.evolution.evolve"
local host = require "limax.host"
local model_arms = require "limax.tools.study.model_arms"
local duration = require "limax.base.duration"

local probe = {}

-- Wall time of one evaluation: the first generation of the first cell, simulated and scored.
local function seconds_per_evaluation(study)
  local run = evolve.start(cells.experiment(study, study.cells[1]), { repetition = 1,
    device = study.device, say = function() end })
  local began = host.clock()
  local robots = run:generations()()
  robots:simulate():score()
  return (host.clock() - began) / #robots
end

--- Evaluations, hours and tokens of the remaining runs of a study, in words.
function probe.text(study)
  local left, asking, names, seen = 0, 0, {}, {}
  for _, cell in ipairs(study.cells) do
    local arm = cell.arm
    if not cells.is_done(study.out .. "/" .. cell.path) then
      left, asking = left + 1, asking + (arm.asks and 1 or 0)
    end
    if not seen[arm.name] then seen[arm.name], names[#names + 1] = true, arm.name end
  end
  local evaluations = left * study.evaluations
  local seconds = evaluations * seconds_per_evaluation(study)
  local tokens = "none: no arm asks a language model"
  if asking > 0 then
    -- with the default share of elites
    local bred = math.ceil((1 - study.config.breeding.elite_fraction) * study.config.population)
    local answers = asking * math.ceil((study.evaluations - study.config.population) / bred)
    tokens = ("about %.2g million for %d answers, whose time is not included"):format(
      answers * model_arms.TOKENS / 1e6, answers)
  end
  return table.concat({
    ("%d arms (%s), %d repetitions: %d of %d runs left"):format(#names, table.concat(names, " "),
      study.repetitions, left, #study.cells),
    ("evaluations: at most %d, %d a run"):format(evaluations, study.evaluations),
    ("time: about %.2g h (%s) of simulating, measured on one generation"):format(seconds / 3600,
      duration(seconds)),
    "tokens: " .. tokens,
    ("folder: %s; the study can be stopped at any time and started again"):format(study.out),
  }, "\n")
end

return probe
