--- metrics.lua: one line of numbers per generation, over the robots that were scored. It holds no
--- times, so that two runs can be compared byte for byte.

local ffi = require "ffi"
local new_table = require "table.new"

local row = require "limax.robot.row"
local rows = require "limax.robot.rows"
local sample = require "limax.base.statistics.sample"
local sorting = require "limax.base.sorting"

local metrics = {}

--- Indices of the scored robots, best first; equal ones in index order.
---@param share? limax.share only those of this rank
---@return integer[]
function metrics.rank(all, share)
  local data, size, count = (share and all or rows.scored(all)).data, (share or all).count, 0
  local scores, numbers = ffi.new("double[?]", size), ffi.new("int32_t[?]", size)
  for i = 1, size do
    local score = data[i - 1].fitness
    if score == score then
      scores[count], numbers[count] = score, share and share:number(i) or i
      count = count + 1
    end
  end
  sorting.sort(scores, numbers, count, true)
  local ranked = new_table(count, 0)
  for k = 1, count do ranked[k] = numbers[k - 1] end
  return ranked
end

-- JSON has no NaN: such a number is left out.
local function without_nan(value)
  if type(value) ~= "table" then return value == value and value or nil end
  local copy = {}
  for key, entry in pairs(value) do copy[key] = without_nan(entry) end
  return copy
end

-- A number of the struct of a robot, or value k of a list of these; nil if it has none.
local function value_of(each, name, k, all)
  if not k then return row.read(each, name, all) end
  local value = each[name][k - 1]
  return value == value and value or nil
end

-- Spread of a value that robots have: the champion's, and mean, least and most over the scored
-- robots that have it; nil if none has it.
local function spread(all, champion, name, k)
  local data, sum, count, least, most = rows.scored(all).data, 0, 0, math.huge, -math.huge
  for i = 0, all.count - 1 do
    local each = data[i]
    local value = each.fitness == each.fitness and value_of(each, name, k, all)
    if value then
      sum, count = sum + value, count + 1
      least, most = math.min(least, value), math.max(most, value)
    end
  end
  return count > 0 and { champion = value_of(data[champion - 1], name, k, all), mean = sum / count,
    least = least, most = most } or nil
end

-- The spread of a field that robots of some experiments have.
local function spread_of(all, champion, name)
  return all.layout.places[name] and spread(all, champion, name) or nil
end

-- The numbers that the fitness returned besides the score; nil if it returned none.
local function measures_of(all, champion)
  local measures = {}
  for k, name in ipairs(all.facts.measures or {}) do
    measures[name] = spread(all, champion, "measures", k)
  end
  return next(measures) and measures or nil
end

-- Best and mean fitness of each island; nil without islands.
local function islands_of(all)
  if not all.layout.places.island then return nil end
  local data, list = rows.scored(all).data, {}
  for i = 0, all.count - 1 do
    local home, score = tonumber(data[i].island), data[i].fitness
    local each = list[home] or { scored = 0 }
    list[home] = each
    if score == score then
      each.scored, each.mean = each.scored + 1, (each.mean or 0) + score
      each.best = math.max(each.best or score, score)
    end
  end
  for _, each in ipairs(list) do each.mean = each.mean and each.mean / each.scored end
  return list
end

--- The metrics of a scored population: best, mean, median, worst and quantiles of the fitness,
--- diversity, failures, champion, and what the fitness returned besides its score.
function metrics.measure(population)
  local all, ranked = population.rows, population.ranked
  local best, count = ranked[1], #ranked
  local data, sum, quantiles = rows.scored(all).data, 0, {}
  for i = 0, all.count - 1 do -- in the order of the population
    local score = data[i].fitness
    if score == score then sum = sum + score end
  end
  local function ascending(k) return data[ranked[count + 1 - k] - 1].fitness end
  for _, q in ipairs { 10, 25, 50, 75, 90 } do
    quantiles["q" .. q] = sample.quantile_of(count, ascending, q / 100)
  end
  return {
    best = data[best - 1].fitness,
    mean = sum / count,
    median = quantiles.q50,
    worst = data[ranked[count] - 1].fitness,
    quantiles = quantiles,
    scored = count,
    failed = population.failed,
    coarse = population.coarse,
    diversity = without_nan(population.diversity),
    measures = measures_of(all, best),
    islands = islands_of(all),
    novelty = spread_of(all, best, "novelty"),
    age = spread_of(all, best, "age"),
    step_size = spread_of(all, best, "step_size"),
    champion = { id = all[best].id, index = best, hash = all[best].body.hash },
  }
end

return metrics
