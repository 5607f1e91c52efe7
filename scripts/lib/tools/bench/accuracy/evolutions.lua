--- evolutions.lua: whole evolutions under cheap settings: the final best of each, scored again
--- under the finest setting. With one seed every setting starts from the same genomes. SI units.

local host = require "limax.host"
local rescore = require "limax.evolution.rescore"
local terminal = require "limax.base.terminal"
local tiers = require "limax.settings.tiers"
local trial = require "limax.tools.bench.accuracy.trial"
local walkers = require "limax.tools.bench.accuracy.walkers"

local evolutions = {}

evolutions.COLUMNS = { "case", "seed", "setting", "best", "best_at_finest", "seconds",
  "relative_to_paper", "best_relative_to_paper" }

local PAPER = { "simulation.integrator=" .. trial.PAPER.integrator,
  "simulation.precision=" .. trial.PAPER.precision,
  ("simulation.time_step=%.17g"):format(trial.PAPER.time_step) }

function evolutions.run(how)
  local size, rows = how.size, {}
  local case = walkers.CASES[size.case]
  for seed = 1, size.seeds do
    local first, paper = #rows + 1, nil
    for _, name in ipairs(size.settings) do
      host.raise_if_interrupted()
      local experiment = walkers.experiment(case, { "population=" .. size.robots,
        "generations=" .. size.generations, "seed=" .. seed }, size.set,
        name == "paper" and PAPER or tiers.overrides(name))
      local robots, seconds = walkers.evolved(experiment, how.device)
      local best = robots.ranked[1]
      local again = rescore.population(robots, trial.finest(size.reference), { best })
      local row = { case = case.name, seed = seed, setting = name,
        best = robots.rows[best].fitness, best_at_finest = again.fitness[best],
        seconds = seconds }
      rows[#rows + 1], paper = row, name == "paper" and row or paper
      how.say(("%s, seed %d, %s: best %.3f, at the finest setting %.3f; %.1f s"):format(case.name,
        seed, name, row.best, row.best_at_finest or 0 / 0, seconds))
    end
    for k = first, paper and #rows or 0 do
      local row = rows[k]
      row.relative_to_paper = row.seconds / paper.seconds
      row.best_relative_to_paper = row.best_at_finest and paper.best_at_finest
        and row.best_at_finest / paper.best_at_finest
    end
  end
  return { columns = evolutions.COLUMNS, rows = rows }
end

function evolutions.text(result, style)
  return "final best of whole evolutions, scored again under the finest setting\n"
    .. terminal.rows({ { "case" }, { "seed" }, { "evolved under", "setting" }, { "best" },
    { "at the finest", "best_at_finest" }, { "of the paper's", "best_relative_to_paper" },
    { "seconds" }, { "of the paper's", "relative_to_paper" } }, result.rows, style)
end

return evolutions
