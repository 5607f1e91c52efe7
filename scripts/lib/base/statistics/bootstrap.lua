--- bootstrap.lua: percentile intervals of a statistic by resampling.
--- Source: Efron, "Bootstrap methods: another look at the jackknife" (1979).

local engine = require "limax.engine"
local sample = require "limax.base.statistics.sample"

local bootstrap = {}

-- enough that percentiles vary by less than a hundredth of the interval's width
local RESAMPLES = 50000
-- fixed, so that the same data give the same interval
local SEED = 19790101

--- The interval that contains `share` of the statistic over resamples drawn with replacement.
---@param list number[] not empty
---@param statistic fun(list: number[]): number
---@param share? number 0.95 if left out
---@param resamples? integer 50 000 if left out
---@return number low
---@return number high
function bootstrap.interval(list, statistic, share, resamples)
  local values, drawn, n = {}, {}, #list
  local random = engine.random(SEED, 1, "user", 0, 0)
  for k = 1, resamples or RESAMPLES do
    for i = 1, n do drawn[i] = list[random:integer(n)] end
    values[k] = statistic(drawn)
  end
  table.sort(values)
  local tail = (1 - (share or 0.95)) / 2
  return sample.quantile(values, tail), sample.quantile(values, 1 - tail)
end

return bootstrap
