--- timing.lua: comparable times on a busy machine: the cases alternate for several rounds, and each
--- keeps its best one.

local host = require "limax.host"

local timing = {}

--- Runs every case once per round and returns the best rate of each.
---@param cases { run: fun(): number }[] run does its work and returns how much it was
---@param clock? fun(): number s, of the wall if left out
---@return number[] rates work per second, by case
function timing.best_rates(cases, rounds, clock)
  clock = clock or host.clock
  local best = {}
  for _ = 1, rounds do
    for i, case in ipairs(cases) do
      local start = clock()
      local work = case.run()
      best[i] = math.max(best[i] or 0, work / (clock() - start))
    end
  end
  return best
end

return timing
