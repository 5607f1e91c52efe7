--- metrics.lua: one line of numbers per generation, over the robots that were scored. No clock
--- reaches it, so that two runs can be compared byte for byte.

local diversity = require "limax.run.diversity"
local sample = require "limax.base.statistics.sample"

local metrics = {}

--- Indices of the scored robots, best first; equal ones in index order.
---@param records table[]
---@return integer[]
function metrics.rank(records)
  local ranked = {}
  for i, record in ipairs(records) do
    if record.fitness then ranked[#ranked + 1] = i end
  end
  table.sort(ranked, function(a, b)
    local first, second = records[a].fitness, records[b].fitness
    if first ~= second then return first > second end
    return a < b
  end)
  return ranked
end

-- NaN has no place in JSON: a number that means nothing is absent.
local function without_nan(value)
  if type(value) ~= "table" then return value == value and value or nil end
  local copy = {}
  for key, entry in pairs(value) do copy[key] = without_nan(entry) end
  return copy
end

--- Numbers of robots that failed, by what they failed at.
---@param records table[]
---@return { invalid: integer, diverged: integer, fitness: integer }
function metrics.failures(records)
  local failed = { invalid = 0, diverged = 0, fitness = 0 }
  local key = { invalid = "invalid", diverged = "diverged", failed = "fitness" }
  for _, record in ipairs(records) do
    local name = key[record.status]
    if name then failed[name] = failed[name] + 1 end
  end
  return failed
end

--- Number of robots of which a mass was seen to move farther than a tenth of an edge in one step:
--- their step is coarse for what they do.
---@param records table[]
---@return integer
function metrics.coarse(records)
  local count = 0
  for _, record in ipairs(records) do
    if record.outcome and record.outcome.coarse then count = count + 1 end
  end
  return count
end

-- Of each number that the fitness named beside the score: the champion's, and mean, least and most
-- over the scored robots that have it. nil where it named none.
local function measures_of(records, ranked)
  local measures
  for i, record in ipairs(records) do
    if record.fitness and record.measures then
      measures = measures or {}
      for name, value in pairs(record.measures) do
        local each = measures[name] or { sum = 0, count = 0, least = value, most = value }
        measures[name] = each
        each.sum, each.count = each.sum + value, each.count + 1
        each.least, each.most = math.min(each.least, value), math.max(each.most, value)
        if i == ranked[1] then each.champion = value end
      end
    end
  end
  for name, each in pairs(measures or {}) do
    measures[name] = { champion = each.champion, mean = each.sum / each.count, least = each.least,
      most = each.most }
  end
  return measures
end

--- The metrics of a scored population: best, mean, median, worst and quantiles of the fitness,
--- diversity, failures, champion, and what the fitness named beside its score.
---@param population table a scored population
---@return table
function metrics.measure(population)
  local records, ranked = population.records, population.ranked
  local ascending, sum = {}, 0
  for k = #ranked, 1, -1 do ascending[#ascending + 1] = records[ranked[k]].fitness end
  for _, record in ipairs(records) do sum = sum + (record.fitness or 0) end
  local champion = records[ranked[1]]
  local quantiles = {}
  for _, q in ipairs { 10, 25, 50, 75, 90 } do
    quantiles["q" .. q] = sample.quantile(ascending, q / 100)
  end
  return {
    best = champion.fitness,
    mean = sum / #ranked,
    median = quantiles.q50,
    worst = ascending[1],
    quantiles = quantiles,
    scored = #ranked,
    failed = metrics.failures(records),
    coarse = metrics.coarse(records),
    diversity = without_nan(diversity.measure(population.engine, ranked, population.materials)),
    measures = measures_of(records, ranked),
    champion = { id = champion.id, index = ranked[1], hash = champion.body.hash },
  }
end

return metrics
