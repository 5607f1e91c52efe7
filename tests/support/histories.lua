--- histories.lua: artificial histories, and supervisors called with them twice: equal histories
--- must give equal proposals.

local evolution = require "support.evolution"
local limax = require "limax"
local proposals = require "limax.supervise.proposals"

local histories = {}

--- The parameters of the first generation.
histories.FIRST = { mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4,
  elite_fraction = 0.3 }

--- A generation of ten robots with this best score; `fields` replace its other fields.
function histories.entry(generation, best, fields)
  local made = evolution.with({ generation = generation, best = best, mean = best / 2,
    parameters = evolution.with(histories.FIRST), population = { ranked = {} },
    failed = { invalid = 0, diverged = 0, fitness = 0 },
    diversity = { all = { hamming = 0.8 } } }, fields)
  for i = 1, 10 do
    made.population[i] = { id = 10 * generation + i, origin = "bred", parents = {}, fitness = 0 }
    made.population.ranked[i] = i
  end
  return made
end

--- A history of these best scores; `last` replaces fields of the last generation.
function histories.history_of(scores, last)
  local history = {}
  for k, score in ipairs(scores) do
    history[k] = histories.entry(k - 1, score, k == #scores and last or nil)
  end
  return history
end

--- The random numbers of a supervisor.
function histories.stream(individual)
  return limax.engine.random(7, 1, "supervision", 3, individual or 0)
end

--- The proposal and reason of a supervisor, which must be the same twice.
function histories.ask(t, spec, history)
  local supervisor = limax.supervise.get(spec)
  local proposal, reason = supervisor.call(history, histories.stream(), proposals.limits(10))
  local again, same = supervisor.call(history, histories.stream(), proposals.limits(10))
  t:equal({ proposal or {}, reason }, { again or {}, same })
  t:equal(type(reason), "string")
  return proposal, reason
end

return histories
