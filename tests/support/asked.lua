--- asked.lua: supervisors that are asked about histories made by hand, each twice: the same history
--- gives the same proposal.

local ledger = require "limax.supervise.ledger"
local limax = require "limax"

local asked = {}

--- The parameters of the first generation.
asked.FIRST = { mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4,
  elite_fraction = 0.3 }

--- A table of its own with the same fields.
---@param given table
---@return table
function asked.copy(given)
  local made = {}
  for key, value in pairs(given) do made[key] = value end
  return made
end

--- One generation: best score, and what else differs from a quiet one of ten robots.
---@param generation integer
---@param best number
---@param given? table
---@return table
function asked.entry(generation, best, given)
  local made = { generation = generation, best = best, mean = best / 2,
    parameters = asked.copy(asked.FIRST), population = {},
    failed = { invalid = 0, diverged = 0, fitness = 0 }, diversity = { all = { hamming = 0.8 } } }
  for i = 1, 10 do
    made.population[i] = { id = 10 * generation + i, origin = "bred", parents = {}, fitness = 0 }
  end
  for key, value in pairs(given or {}) do made[key] = value end
  return made
end

--- A history of these best scores, generation by generation; `last` is what differs in the last.
---@param scores number[]
---@param last? table
---@return table[]
function asked.history_of(scores, last)
  local history = {}
  for k, score in ipairs(scores) do
    history[k] = asked.entry(k - 1, score, k == #scores and last or nil)
  end
  return history
end

--- The random numbers that a supervisor is given.
---@param individual? integer
---@return limax.random
function asked.stream(individual)
  return limax.engine.random(7, 1, "supervision", 3, individual or 0)
end

--- What a supervisor says, asked twice.
---@param t limax.test_context
---@param spec string|table|function
---@param history table[]
---@return table|nil
---@return string
function asked.ask(t, spec, history)
  local supervisor = limax.supervise.get(spec)
  local proposal, reason = supervisor.call(history, asked.stream(), ledger.limits(10))
  local again, same = supervisor.call(history, asked.stream(), ledger.limits(10))
  t:equal(proposal, again)
  t:equal(reason, same)
  t:equal(type(reason), "string")
  return proposal, reason
end

return asked
