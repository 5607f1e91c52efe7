--- selection.lua: the library of selection schemes. A scheme picks two parents for one offspring,
--- (population, random) -> i, j, independently. It reads `population.ranked`, indices best first,
--- so a robot without a fitness is never chosen.

local choice = require "limax.base.choice"
local engine = require "limax.engine"
local sample = require "limax.base.statistics.sample"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local selection = strict.module "limax.selection"

---@alias limax.selection.scheme fun(population: table, random: table): integer, integer

-- Caches what a scheme computes for a scored population. `ranked` is a new table each time that a
-- population is scored.
local function cached(work)
  local cache = setmetatable({}, { __mode = "k" })
  return function(population)
    local ranked = population.ranked
    if cache[ranked] == nil then cache[ranked] = work(population, ranked) end
    return cache[ranked]
  end
end

local function ranking(population)
  local ranked = population.ranked
  if type(ranked) ~= "table" then
    engine.fail "selection: expected a scored population, with its field `ranked`"
  end
  if #ranked == 0 then
    engine.fail "selection: no robot of this generation has a fitness, so there is none to choose"
  end
  return ranked
end

-- Two independent picks.
local function twice(pick)
  return function(population, random)
    local ranked = ranking(population)
    local first = pick(population, random, ranked)
    return first, pick(population, random, ranked)
  end
end

-- Index of the first of rising sums that is above u times the last, by bisection.
local function drawn(sums, u)
  local target, low, high = u * sums[#sums], 1, #sums
  while low < high do
    local middle = math.floor((low + high) / 2)
    if sums[middle] > target then high = middle else low = middle + 1 end
  end
  return low
end

---@class limax.selection.entry: limax.choice.entry
---@field by_rank? boolean does it read no more of a population than `ranked`?
---@field make fun(options: table): limax.selection.scheme

--- Options of each scheme, by its name.
---@type table<string, limax.selection.entry>
selection.entries = {}

--- truncation: each of the best share of the robots, at least one, with equal chances.
selection.entries.truncation = {
  by_rank = true,
  options = { share = schema.number { value = 0.5, unit = "of the scored robots", above = 0,
    maximum = 1, note = "half keeps pressure and variety" } },
  make = function(options)
    return twice(function(_, random, ranked)
      return ranked[random:integer(math.max(1, math.ceil(options.share * #ranked - 1e-9)))]
    end)
  end,
}

--- tournament: the best of `size` draws with replacement. Of n robots, rank r wins with the chance
--- ((n - r + 1)^size - (n - r)^size) / n^size.
selection.entries.tournament = {
  by_rank = true,
  options = { size = schema.number { value = 3, unit = "robots", minimum = 1, maximum = 1e6,
    integer = true, note = "the best robot is some three times as likely as the median" } },
  make = function(options)
    return twice(function(_, random, ranked)
      local best = #ranked
      for _ = 1, options.size do best = math.min(best, random:integer(#ranked)) end
      return ranked[best]
    end)
  end,
}

-- A scheme whose chances are in proportion to weights of the ranked robots; equal if all are 0.
-- `add(sum, population, ranked, r)` adds the weight of rank r to a sum.
local function proportional(add)
  local sums_of = cached(function(population, ranked)
    local sums = {}
    for r = 1, #ranked do sums[r] = add(sums[r - 1] or 0, population, ranked, r) end
    return sums
  end)
  return twice(function(population, random, ranked)
    local sums = sums_of(population)
    if sums[#sums] <= 0 then return ranked[random:integer(#ranked)] end
    return ranked[drawn(sums, random:uniform())]
  end)
end

--- rank: chances fall linearly with the rank r of n, whatever the scores are:
--- (pressure - 2 (pressure - 1) (r - 1) / (n - 1)) / n.
selection.entries.rank = {
  by_rank = true,
  options = { pressure = schema.number { value = 1.8, unit = "mean chances, of the best robot",
    minimum = 1, maximum = 2, note = "near the steepest line; the worst still has a chance" } },
  make = function(options)
    return proportional(function(sum, _, ranked, r)
      local fall = #ranked > 1 and 2 * (options.pressure - 1) / (#ranked - 1) or 0
      return sum + options.pressure - fall * (r - 1)
    end)
  end,
}

--- roulette: chances in proportion to fitness. If any is negative, all are first shifted up by the
--- size of the worst, which then has the chance 0. If all shares are 0, chances are equal.
selection.entries.roulette = {
  options = {},
  make = function()
    return proportional(function(sum, population, ranked, r)
      local worst = population[ranked[#ranked]].fitness
      return sum + population[ranked[r]].fitness + (worst < 0 and -worst or 0)
    end)
  end,
}

-- Number of cases, the same for every scored robot.
local function check_cases(population, ranked)
  local count
  for _, index in ipairs(ranked) do
    local cases = population[index].cases
    if type(cases) ~= "table" or #cases == 0 then
      engine.fail(('selection "lexicase": robot %d has no cases; a fitness returns them as its '
        .. 'second value, return score, { case_1, case_2 }, or is { "distance", cases = 4 }')
        :format(index))
    end
    count = count or #cases
    if #cases ~= count then
      engine.fail(('selection "lexicase": robot %d has %d cases and robot %d has %d')
        :format(index, #cases, ranked[1], count))
    end
    for c, value in ipairs(cases) do
      if type(value) ~= "number" or value ~= value then
        engine.fail(('selection "lexicase": case %d of robot %d is %s, expected a number')
          :format(c, index, schema.show(value)))
      end
    end
  end
  return count
end

-- The amount by which a robot may be worse than the best in each case.
local function tolerances(population, ranked, epsilon)
  local count = check_cases(population, ranked)
  local tolerance = {}
  for c = 1, count do
    tolerance[c] = epsilon
    if epsilon == "mad" then
      -- median absolute deviation: the case's own scale, so that close scores count as equal
      local values, deviations = {}, {}
      for r, index in ipairs(ranked) do values[r] = population[index].cases[c] end
      local middle = sample.median(values)
      for r, value in ipairs(values) do deviations[r] = math.abs(value - middle) end
      tolerance[c] = sample.median(deviations)
    end
  end
  return tolerance
end

--- lexicase: the cases in a random order; each keeps only the robots within `epsilon` of the best
--- that is left; then a draw. `epsilon = "mad"` takes each case's median absolute deviation, the
--- usual choice for measured scores.
selection.entries.lexicase = {
  options = { epsilon = schema.word_or_number("mad", { unit = "the cases' own", minimum = 0,
    maximum = math.huge }) },
  make = function(options)
    local tolerance_of = cached(function(population, ranked)
      return tolerances(population, ranked, options.epsilon or 0)
    end)
    return twice(function(population, random, ranked)
      local tolerance = tolerance_of(population)
      local order, left = {}, ranked
      for c = 1, #tolerance do order[c] = c end
      for k = 1, #order do
        local swap = k - 1 + random:integer(#order - k + 1)
        order[k], order[swap] = order[swap], order[k]
        local case, best = order[k], -math.huge
        for _, index in ipairs(left) do best = math.max(best, population[index].cases[case]) end
        local kept = {}
        for _, index in ipairs(left) do
          if population[index].cases[case] >= best - tolerance[case] then
            kept[#kept + 1] = index
          end
        end
        left = kept
        if #left == 1 then break end
      end
      return left[random:integer(#left)]
    end)
  end,
}

--- The scheme that an experiment names: a name, { name, option = value }, or a function.
---@param spec string|table|limax.selection.scheme
---@return limax.selection.scheme
---@return string name a library name, or "function"
function selection.get(spec)
  if type(spec) == "function" then return spec, "function" end
  local name, options = choice.read("selection", spec, selection.entries)
  return selection.entries[name].make(options), name
end

return strict.close("limax.selection", selection)
