--- metrics.lua: one line of numbers per generation, over the robots that were scored. It holds no
--- times, so that two runs can be compared byte for byte.

local diversity = require "limax.run.diversity"
local sample = require "limax.base.statistics.sample"
local sorting = require "limax.base.sorting"

local metrics = {}

--- Indices of the scored robots, best first; equal ones in index order.
---@return integer[]
function metrics.rank(records)
  local ranked, scored, values = {}, {}, {}
  for i, record in ipairs(records) do
    local score = record.fitness
    if score then
      scored[#scored + 1], values[#values + 1] = i, score
    end
  end
  for k, place in ipairs(sorting.descending(values)) do ranked[k] = scored[place] end
  return ranked
end

-- JSON has no NaN: such a number is left out.
local function without_nan(value)
  if type(value) ~= "table" then return value == value and value or nil end
  local copy = {}
  for key, entry in pairs(value) do copy[key] = without_nan(entry) end
  return copy
end

-- The counter of a robot that failed, by its status.
local counter_of = { invalid = "invalid", diverged = "diverged", failed = "fitness" }

-- Number of robots that failed, by what they failed at, and of those whose step was coarse: one of
-- their masses moved farther than a tenth of an edge in one step.
local function count_problems(all)
  local failed, coarse = { invalid = 0, diverged = 0, fitness = 0 }, 0
  for i = 1, all.count do
    local name = counter_of[all.status[i]]
    if name then failed[name] = failed[name] + 1 end
    if all:is_coarse(i) then coarse = coarse + 1 end
  end
  return failed, coarse
end

-- Of a number that records or their measures have: the champion's, and mean, least and most over
-- the scored robots that have it. nil if none has it.
local function spread(records, champion, name, of)
  local sum, count, least, most = 0, 0, math.huge, -math.huge
  for _, record in ipairs(records) do
    local value = record.fitness and (of(record) or {})[name]
    if value then
      sum, count = sum + value, count + 1
      least, most = math.min(least, value), math.max(most, value)
    end
  end
  return count > 0 and { champion = (of(champion) or {})[name], mean = sum / count, least = least,
    most = most } or nil
end

local function itself(record) return record end
local function its_measures(record) return record.measures end

-- The numbers that the fitness returned besides the score; nil if it returned none.
local function measures_of(records, champion)
  local measures = {}
  for _, record in ipairs(records) do
    for name in pairs(record.fitness and record.measures or {}) do
      measures[name] = measures[name] or spread(records, champion, name, its_measures)
    end
  end
  return next(measures) and measures or nil
end

-- Best and mean fitness of each island; nil without islands.
local function islands_of(records)
  if not records[1].island then return nil end
  local list = {}
  for _, record in ipairs(records) do
    local each = list[record.island] or { scored = 0 }
    list[record.island] = each
    if record.fitness then
      each.scored, each.mean = each.scored + 1, (each.mean or 0) + record.fitness
      each.best = math.max(each.best or record.fitness, record.fitness)
    end
  end
  for _, each in ipairs(list) do each.mean = each.mean and each.mean / each.scored end
  return list
end

--- The metrics of a scored population: best, mean, median, worst and quantiles of the fitness,
--- diversity, failures, champion, and what the fitness returned besides its score.
---@param population table a scored population
---@return table
function metrics.measure(population)
  local records, ranked = population.records, population.ranked
  local ascending, sum, quantiles = {}, 0, {}
  for k = #ranked, 1, -1 do ascending[#ascending + 1] = records[ranked[k]].fitness end
  -- in the order of the population
  for _, record in ipairs(records) do sum = sum + (record.fitness or 0) end
  for _, q in ipairs { 10, 25, 50, 75, 90 } do
    quantiles["q" .. q] = sample.quantile(ascending, q / 100)
  end
  local champion = records[ranked[1]]
  local failed, coarse = count_problems(population.columns)
  return {
    best = champion.fitness,
    mean = sum / #ranked,
    median = quantiles.q50,
    worst = ascending[1],
    quantiles = quantiles,
    scored = #ranked,
    failed = failed,
    coarse = coarse,
    diversity = without_nan(diversity.measure(population.engine, ranked, population.materials)),
    measures = measures_of(records, champion),
    islands = islands_of(records),
    novelty = spread(records, champion, "novelty", itself),
    age = spread(records, champion, "age", itself),
    step_size = spread(records, champion, "step_size", itself),
    champion = { id = champion.id, index = ranked[1], hash = champion.body.hash },
  }
end

return metrics
