--- ledgers.lua: what the ledgers of an arm's runs show: how much a language model set, and the
--- outcomes of proposals.

local ledgers = {}

--- Share of the generations that a model must have set for a claim about it.
ledgers.WHOLE = 0.95

-- Supervisors that ask a model, or repeat what one proposed.
local ASKS = { llm = true, replay = true }

--- The share of an arm's bred generations that a model set; nil for an arm that asks none.
--- Generations for which the model was not to be asked ("held") do not count.
---@return { share: number, generations: integer }|nil
function ledgers.model(list)
  local supervisor = list[1].config.supervisor
  local name = type(supervisor) == "table" and (supervisor.name or supervisor[1]) or supervisor
  if not ASKS[name] then return nil end
  local all, own = 0, 0
  for _, run in ipairs(list) do
    for _, line in ipairs(run.ledger) do
      -- generation 0 is not set by a supervisor
      if line.generation > 0 and line.source ~= "held" then
        all, own = all + 1, own + (line.source == "model" and 1 or 0)
      end
    end
  end
  return { share = all > 0 and own / all or 0, generations = all }
end

-- outcome in the ledger -> name of its share
local OUTCOMES = { accepted = "accepted", clamped = "clamped", ["rate-limited"] = "rate_limited",
  rejected = "rejected" }

--- Names of the shares, in the order of tables.
ledgers.SHARES = { "accepted", "clamped", "rate_limited", "rejected" }

--- The number of proposed fields over all generations of all runs, and the share of each outcome;
--- no shares where nothing was proposed.
---@return table<string, number>
function ledgers.proposals(list)
  local counts, proposed = {}, 0
  for _, name in ipairs(ledgers.SHARES) do counts[name] = 0 end
  for _, run in ipairs(list) do
    for _, line in ipairs(run.ledger) do
      for _, entry in ipairs(line.entries or {}) do
        local name = OUTCOMES[entry.outcome]
        if name then counts[name], proposed = counts[name] + 1, proposed + 1 end
      end
    end
  end
  local shares = { proposed = proposed }
  for name, count in pairs(counts) do shares[name] = proposed > 0 and count / proposed or nil end
  return shares
end

return ledgers
