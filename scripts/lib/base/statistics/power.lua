--- power.lua: statistical power of the exact tests, by simulating normal samples with a fixed seed.
--- The effect d is a shift in standard deviations: of the differences for paired samples, of the
--- values for independent samples.

local engine = require "limax.engine"
local midranks = require "limax.base.statistics.midranks"
local rank_sum = require "limax.base.statistics.rank_sum"
local signed_rank = require "limax.base.statistics.signed_rank"

local power = {}

-- Simulated experiments for each n: the standard error of a power of 0.8 is 0.006.
local SIMULATED = 4000
local SEED = 20111111
-- largest n that is considered
local MAX_RUNS = 100

local function normals(random, n, shift, into)
  for i = 1, n do into[i] = random:normal() + shift end
  return into
end

-- Share of the simulated experiments with n runs in which `rejects(random)`.
local function share_of(n, rejects)
  local count = 0
  for k = 1, SIMULATED do
    if rejects(engine.random(SEED, n, "user", k, 0)) then count = count + 1 end
  end
  return count / SIMULATED
end

--- Power of the exact signed-rank test of n pairs.
---@param level number two-sided
function power.signed_rank(n, d, level)
  local critical, differences, sizes = signed_rank.critical(n, level), {}, {}
  if not critical then return 0 end
  return share_of(n, function(random)
    normals(random, n, d, differences)
    for i = 1, n do sizes[i] = math.abs(differences[i]) end
    local doubled, negative = midranks.doubled(sizes), 0
    for i = 1, n do negative = negative + (differences[i] < 0 and doubled[i] / 2 or 0) end
    return math.min(negative, n * (n + 1) / 2 - negative) <= critical
  end)
end

--- Power of the exact rank-sum test of n and n.
---@param level number two-sided
function power.rank_sum(n, d, level)
  local critical, first, second = rank_sum.critical(n, n, level), {}, {}
  if not critical then return 0 end
  return share_of(n, function(random)
    normals(random, n, d, first)
    normals(random, n, 0, second)
    local larger = 0
    for i = 1, n do
      for j = 1, n do larger = larger + (first[i] > second[j] and 1 or 0) end
    end
    return math.min(larger, n * n - larger) <= critical
  end)
end

--- The smallest n with a power of at least 0.8, by bisection; nil if it is above 100.
---@param test "signed_rank"|"rank_sum"
function power.runs_needed(test, d, level)
  local low, high = 1, 2
  while power[test](high, d, level) < 0.8 do
    if high == MAX_RUNS then return nil end
    low, high = high, math.min(2 * high, MAX_RUNS)
  end
  while high - low > 1 do
    local middle = math.floor((low + high) / 2)
    if power[test](middle, d, level) < 0.8 then low = middle else high = middle end
  end
  return high
end

return power
