--- probe.lua: what a study will cost, measured by one generation on this machine before it begins.

local cells = require "limax.tools.study.cells"
local evolve = require "limax.evolution.evolve"
local host = require "limax.host"
local model_arms = require "limax.tools.study.model_arms"
local progress = require "limax.tools.console.progress"

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

--- Evaluations, hours and tokens of what is left of a study, in words.
---@param study limax.study
---@return string
function probe.text(study)
  local left, asked, names, seen = 0, 0, {}, {}
  for _, cell in ipairs(study.cells) do
    local done = cells.is_done(study.out .. "/" .. cell.path)
    left = left + (done and 0 or 1)
    asked = asked + (cell.arm.asks and not done and 1 or 0)
    if not seen[cell.arm.name] then
      seen[cell.arm.name] = true
      names[#names + 1] = cell.arm.name
    end
  end
  local evaluations = left * study.evaluations
  local seconds = evaluations * seconds_per_evaluation(study)
  local tokens = "none: no arm asks a language model"
  if asked > 0 then
    -- with the default share of elites
    local bred = math.ceil((1 - study.config.breeding.elite_fraction) * study.config.population)
    local answers = asked * math.ceil((study.evaluations - study.config.population) / bred)
    tokens = ("about %.2g million for %d answers, whose seconds come on top"):format(
      answers * model_arms.TOKENS / 1e6, answers)
  end
  return table.concat({
    ("%d arms (%s), %d repetitions: %d of %d runs left"):format(#names, table.concat(names, " "),
      study.repetitions, left, #study.cells),
    ("evaluations: at most %d, %d a run"):format(evaluations, study.evaluations),
    ("time: about %.2g h (%s) of simulating, by one generation on this machine"):format(
      seconds / 3600, progress.duration(seconds)),
    "tokens: " .. tokens,
    ("folder: %s; stop it at any time, started again there it goes on"):format(study.out),
  }, "\n")
end

return probe
