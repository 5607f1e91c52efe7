--- metrics.lua: one line of numbers per generation, over the robots that were scored. No clock
--- reaches it, so that two runs can be compared byte for byte.

local diversity = require "limax.diversity"

local metrics = {}

--- The q-quantile of an ascending list, linear between neighbours (R's type 7).
---@param ascending number[]
---@param q number 0 to 1
---@return number
function metrics.quantile(ascending, q)
  local position = q * (#ascending - 1) + 1
  local below = math.floor(position)
  local above = math.min(below + 1, #ascending)
  return ascending[below] + (position - below) * (ascending[above] - ascending[below])
end

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

--- The metrics of a scored population: best, mean, median, worst and quantiles of the fitness,
--- diversity, failures, champion.
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
    quantiles["q" .. q] = metrics.quantile(ascending, q / 100)
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
    champion = { id = champion.id, index = ranked[1], hash = champion.body.hash },
  }
end

return metrics
