--- bootstrap.lua: how far a statistic of a sample could have been off: the percentile interval over
--- samples drawn again from it. Source: Efron, "Bootstrap methods: another look at the jackknife"
--- (1979).

local engine = require "limax.engine"
local metrics = require "limax.run.metrics"

local bootstrap = {}

--- Samples drawn again: the percentiles move by less than a hundredth of the interval's width.
bootstrap.RESAMPLES = 50000
-- any fixed seed: the same data give the same interval
local SEED = 19790101

--- The interval that holds `share` of the statistic over samples drawn again, with replacement.
---@param list number[] not empty
---@param statistic fun(list: number[]): number
---@param share? number 0.95
---@param resamples? integer 50 000
---@return number low
---@return number high
function bootstrap.interval(list, statistic, share, resamples)
  local values, drawn, n = {}, {}, #list
  local random = engine.random(SEED, 1, "user", 0, 0)
  for k = 1, resamples or bootstrap.RESAMPLES do
    for i = 1, n do drawn[i] = list[random:integer(n)] end
    values[k] = statistic(drawn)
  end
  table.sort(values)
  local tail = (1 - (share or 0.95)) / 2
  return metrics.quantile(values, tail), metrics.quantile(values, 1 - tail)
end

return bootstrap
