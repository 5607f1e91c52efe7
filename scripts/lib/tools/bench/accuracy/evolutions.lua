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

---@class limax.accuracy.evolutions_size
---@field case integer of walkers.CASES
---@field seeds integer
---@field robots integer
---@field generations integer
---@field set string[] overrides
---@field reference number s
---@field settings string[] tiers, and "paper"

local PAPER = { "simulation.integrator=" .. trial.PAPER.integrator,
  "simulation.precision=" .. trial.PAPER.precision,
  ("simulation.time_step=%.17g"):format(trial.PAPER.time_step) }

local function evolved(case, seed, name, size, device)
  local changes = { "population=" .. size.robots, "generations=" .. size.generations,
    "seed=" .. seed }
  for _, list in ipairs { size.set, name == "paper" and PAPER or tiers.overrides(name) } do
    for _, text in ipairs(list) do changes[#changes + 1] = text end
  end
  return walkers.evolved(walkers.experiment(case, changes), device)
end

---@param how { device: limax.device, size: limax.accuracy.evolutions_size,
--- say: fun(text: string) }
---@return { columns: string[], rows: table[] }
function evolutions.run(how)
  local size, rows = how.size, {}
  local case = walkers.CASES[size.case]
  local finest = { integrator = "leapfrog", precision = "double", time_step = size.reference }
  for seed = 1, size.seeds do
    local of_seed, paper = {}, nil
    for _, name in ipairs(size.settings) do
      host.raise_if_interrupted()
      local robots, seconds = evolved(case, seed, name, size, how.device)
      local best = robots.ranked[1]
      local again = rescore.population(robots, finest, { best })
      local row = { case = case.name, seed = seed, setting = name,
        best = robots.records[best].fitness, best_at_finest = again.fitness[best],
        seconds = seconds }
      if name == "paper" then paper = row end
      of_seed[#of_seed + 1] = row
      rows[#rows + 1] = row
      how.say(("%s, seed %d, %s: best %.3f, at the finest setting %.3f; %.1f s"):format(case.name,
        seed, name, row.best, row.best_at_finest or 0 / 0, seconds))
    end
    for _, row in ipairs(paper and of_seed or {}) do
      row.relative_to_paper = row.seconds / paper.seconds
      row.best_relative_to_paper = row.best_at_finest and paper.best_at_finest
        and row.best_at_finest / paper.best_at_finest
    end
  end
  return { columns = evolutions.COLUMNS, rows = rows }
end

function evolutions.text(result, style)
  local lines = {}
  for k, row in ipairs(result.rows) do
    lines[k] = { row.case, row.seed, row.setting, row.best, row.best_at_finest or "-",
      row.best_relative_to_paper or "-", row.seconds, row.relative_to_paper or "-" }
  end
  return "final best of whole evolutions, scored again under the finest setting\n"
    .. terminal.table({ "case", "seed", "evolved under", "best", "at the finest", "of the paper's",
    "seconds", "of the paper's" }, lines, style)
end

return evolutions
