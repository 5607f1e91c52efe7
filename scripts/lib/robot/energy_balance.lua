--- energy_balance.lua: the energy of a robot, the works on it, and the error of their balance.

local engine = require "limax.engine"

local energy_balance = {}

local accounts = engine.names.trace_columns.ledger
local first_work = 5

---@class limax.robot.energy_balance
---@field kinetic number energy at the end, J, with that of a block; this and the following
---@field springs number
---@field contact number
---@field gravitational number from the world's origin
---@field muscles number work from t = 0 to the end, J, positive into the body; this and the next
---@field damping number of the dashpots along springs
---@field contact_damping number
---@field friction number
---@field other number of every effect without an entry of its own
---@field change number of the energy since t = 0, J
---@field closure number 1: the largest balance error of any sample (energy since t = 0 less all
--- works) over the energy turned over: the largest energy and the absolute works at the end

--- The balance of a trace "ledger".
---@param trace limax.view [sample][9] J
function energy_balance.of(trace)
  local last, first_energy, worst, largest = trace:size(), nil, 0, 0
  local result = {}
  for sample = 1, last do
    local row = trace[sample]
    local energy, works = 0, 0
    for k = 1, #accounts do
      if k < first_work then energy = energy + row[k] else works = works + row[k] end
    end
    -- gravity's zero is a convention: only its change counts as turned over
    largest = math.max(largest, row[1] + row[2] + row[3] + math.abs(row[4] - trace[1][4]))
    first_energy = first_energy or energy
    result.change = energy - first_energy
    worst = math.max(worst, math.abs(result.change - works))
  end
  local turned_over = largest
  for k, name in ipairs(accounts) do
    result[name] = trace[last][k]
    if k >= first_work then turned_over = turned_over + math.abs(result[name]) end
  end
  result.closure = turned_over > 0 and worst / turned_over or 0
  return result
end

return energy_balance
