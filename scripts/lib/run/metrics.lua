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
  local failed, status = { invalid = 0, diverged = 0, fitness = 0 }, rows.column(all, "status")
  for i = 1, all.count do
    local name = counter_of[status[i]]
    if name then failed[name] = failed[name] + 1 end
  end
  return failed
end

-- Spread of a value that robots have: the champion's, and mean, least and most over the scored
-- robots that have it; nil if none has it.
---@param fitness number[] of all robots
---@param values number[] of all robots
local function spread(all, champion, fitness, values)
  local sum, count, least, most = 0, 0, math.huge, -math.huge
  for i = 1, all.count do
    local value = fitness[i] and values[i]
    if value then
      sum, count = sum + value, count + 1
      least, most = math.min(least, value), math.max(most, value)
    end
  end
  return count > 0 and { champion = values[champion], mean = sum / count, least = least,
    most = most } or nil
end

-- The spread of a field that robots of some experiments have.
local function spread_of(all, champion, fitness, name)
  return all.layout.places[name]
    and spread(all, champion, fitness, rows.column(all, name)) or nil
end

-- The numbers that the fitness returned besides the score; nil if it returned none.
local function measures_of(all, champion, fitness)
  local measures = {}
  for k, name in ipairs(all.facts.measures or {}) do
    measures[name] = spread(all, champion, fitness, rows.column(all, "measures", k))
  end
  return next(measures) and measures or nil
end

-- Best and mean fitness of each island; nil without islands.
local function islands_of(all)
  if not all.layout.places.island then return nil end
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
  local best, fitness = ranked[1], rows.column(all, "fitness")
  local ascending, sum, quantiles = {}, 0, {}
  for k = #ranked, 1, -1 do ascending[#ascending + 1] = fitness[ranked[k]] end
  -- in the order of the population
  for i = 1, all.count do sum = sum + (fitness[i] or 0) end
  for _, q in ipairs { 10, 25, 50, 75, 90 } do
    quantiles["q" .. q] = sample.quantile(ascending, q / 100)
  end
  return {
    best = fitness[best],
    mean = sum / #ranked,
    median = quantiles.q50,
    worst = ascending[1],
    quantiles = quantiles,
    scored = #ranked,
    failed = count_failed(all),
    coarse = population.coarse,
    diversity = without_nan(population.diversity),
    measures = measures_of(all, best, fitness),
    islands = islands_of(all),
    novelty = spread_of(all, best, fitness, "novelty"),
    age = spread_of(all, best, fitness, "age"),
    step_size = spread_of(all, best, fitness, "step_size"),
    champion = { id = all[best].id, index = best, hash = all[best].body.hash },
  }
end

return metrics
