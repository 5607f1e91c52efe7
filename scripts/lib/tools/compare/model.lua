--- model.lua: how much of an arm a language model really set. A run whose fallback set the
--- parameters says little about the model.

local model = {}

--- Share of the generations that a model must have set for a claim about it.
model.WHOLE = 0.95

-- Supervisors that ask a model, or repeat what one said.
local ASKS = { llm = true, replay = true }

--- The share of an arm's bred generations that a model set; nil for an arm that asks none. A ledger
--- line says who set it; generations for which the model was not to be asked ("held") do not count.
---@param list limax.compare.run[]
---@return { share: number, generations: integer }|nil
function model.of(list)
  local supervisor = list[1].config.supervisor
  local name = type(supervisor) == "table" and (supervisor.name or supervisor[1]) or supervisor
  if not ASKS[name] then return nil end
  local all, own = 0, 0
  for _, run in ipairs(list) do
    for _, line in ipairs(run.ledger) do
      -- generation 0 is nobody's
      if line.generation > 0 and line.source ~= "held" then
        all, own = all + 1, own + (line.source == "model" and 1 or 0)
      end
    end
  end
  return { share = all > 0 and own / all or 0, generations = all }
end

return model
