--- proposals.lua: what became of an arm's proposals, over all generations of all its runs: shares
--- of the proposed fields by their outcome in the ledger. An arm whose proposals are mostly bound
--- by the limits tells of the limits.

local proposals = {}

-- outcome in the ledger -> name of its share
local OUTCOMES = { accepted = "accepted", clamped = "clamped", ["rate-limited"] = "rate_limited",
  rejected = "rejected" }

--- Names of the shares, in the order of tables.
proposals.SHARES = { "accepted", "clamped", "rate_limited", "rejected" }

--- The number of proposed fields, and the share of each outcome; no shares where nothing was
--- proposed.
---@param list limax.compare.run[]
---@return table<string, number>
function proposals.shares(list)
  local counts, proposed = {}, 0
  for _, name in ipairs(proposals.SHARES) do counts[name] = 0 end
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

return proposals
