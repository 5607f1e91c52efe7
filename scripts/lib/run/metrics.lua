--- metrics.lua: one line of numbers per generation, over the robots that were scored. It holds no
--- times, so that two runs can be compared byte for byte.

local rows = require "limax.robot.rows"
local sample = require "limax.base.statistics.sample"
local sorting = require "limax.base.sorting"

local metrics = {}

--- Indices of the scored robots, best first; equal ones in index order.
function metrics.rank(all)
  local ranked, numbers, scores = {}, rows.scored(all)
  for k, place in ipairs(sorting.descending(scores)) do ranked[k] = numbers[place] end
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

-- Numbers of robots that failed, by status.
local function count_failed(all)
  local failed = { invalid = 0, diverged = 0, fitness = 0 }
  for _, row in ipairs(all) do
    local name = counter_of[row.status]
    if name then failed[name] = failed[name] + 1 end
  end
  return failed
end

-- Spread of a value that robots or their measures have: the champion's, and mean, least and most
-- over the scored robots that have it; nil if none has it.
local function spread(all, champion, name, of)
  local sum, count, least, most = 0, 0, math.huge, -math.huge
  for _, row in ipairs(all) do
    local value = row.fitness and (of(row) or {})[name]
    if value then
      sum, count = sum + value, count + 1
      least, most = math.min(least, value), math.max(most, value)
    end
  end
  return count > 0 and { champion = (of(champion) or {})[name], mean = sum / count, least = least,
    most = most } or nil
end

local function itself(row) return row end
local function its_measures(row) return row.measures end

-- The spread of a field that robots of some experiments have.
local function spread_of(all, champion, name)
  return all.layout.places[name] and spread(all, champion, name, itself)
end

-- The numbers that the fitness returned besides the score; nil if it returned none.
local function measures_of(all, champion)
  local measures = {}
  for _, name in ipairs(all.facts.measures or {}) do
    measures[name] = spread(all, champion, name, its_measures)
  end
  return next(measures) and measures or nil
end

-- Best and mean fitness of each island; nil without islands.
local function islands_of(all)
  if not all[1].island then return nil end
  local list = {}
  for _, row in ipairs(all) do
    local each = list[row.island] or { scored = 0 }
    list[row.island] = each
    if row.fitness then
      each.scored, each.mean = each.scored + 1, (each.mean or 0) + row.fitness
      each.best = math.max(each.best or row.fitness, row.fitness)
    end
  end
  for _, each in ipairs(list) do each.mean = each.mean and each.mean / each.scored end
  return list
end

--- The metrics of a scored population: best, mean, median, worst and quantiles of the fitness,
--- diversity, failures, champion, and what the fitness returned besides its score.
function metrics.measure(population)
  local all, ranked = population.rows, population.ranked
  local ascending, sum, quantiles = {}, 0, {}
  for k = #ranked, 1, -1 do ascending[#ascending + 1] = all[ranked[k]].fitness end
  -- in the order of the population
  for _, row in ipairs(all) do sum = sum + (row.fitness or 0) end
  for _, q in ipairs { 10, 25, 50, 75, 90 } do
    quantiles["q" .. q] = sample.quantile(ascending, q / 100)
  end
  local champion = all[ranked[1]]
  return {
    best = champion.fitness,
    mean = sum / #ranked,
    median = quantiles.q50,
    worst = ascending[1],
    quantiles = quantiles,
    scored = #ranked,
    failed = count_failed(all),
    coarse = population.coarse,
    diversity = without_nan(population.diversity),
    measures = measures_of(all, champion),
    islands = islands_of(all),
    novelty = spread_of(all, champion, "novelty"),
    age = spread_of(all, champion, "age"),
    step_size = spread_of(all, champion, "step_size"),
    champion = { id = champion.id, index = ranked[1], hash = champion.body.hash },
  }
end

return metrics
