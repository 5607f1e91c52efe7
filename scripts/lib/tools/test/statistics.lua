--- statistics.lua: what `t:statistically` asks: is a mean over seeds, or a whole sample, still what
--- it was? It fails only where chance would explain the sample less often than `level`.

local rank_sum = require "limax.base.statistics.rank_sum"
local student = require "limax.base.statistics.student"

local statistics = {}

--- Chance of a false alarm where the test names none: of a hundred such checks one fails by chance
--- in a hundred changes of the bits; the same seeds and bits always give the same answer.
statistics.LEVEL = 1e-4

--- Seeds where the test names none: with fewer the interval of a mean is wide at such a level.
statistics.SEEDS = 12

-- A draw's values over the seeds; true and false count as 1 and 0.
local function drawn(draw, seeds)
  local list = {}
  for i, seed in ipairs(seeds) do
    local value = draw(seed)
    if type(value) == "boolean" then value = value and 1 or 0 end
    if type(value) ~= "number" or value ~= value or math.abs(value) == math.huge then
      return nil, ("seed %s gave %s; expected a finite number, true or false"):format(
        tostring(seed), tostring(value))
    end
    list[i] = value
  end
  return list
end

local function against_sample(list, expected, level)
  local smallest = rank_sum.smallest_p(#list, #expected)
  if smallest > level then
    return ("%d and %d values cannot differ at the level %g: their smallest p is %.2g; take more "
      .. "seeds or a larger level"):format(#list, #expected, level, smallest)
  end
  local result = rank_sum.test(list, expected)
  local text = ("p %.2g, A12 %.2f, %d and %d values"):format(result.p, result.a12, #list, #expected)
  if result.p < level then
    return ("the samples differ: %s; the level is %g"):format(text, level)
  end
  return nil, text
end

local function against_numbers(list, options, level)
  local mean, half = student.interval(list, 1 - level)
  local text = ("mean %.6g +- %.2g of %d seeds (level %g)"):format(mean, half, #list, level)
  local expected = options.expected
  if expected then
    local allowed = (options.atol or 0) + (options.rtol or 0) * math.abs(expected)
    if not (math.abs(mean - expected) <= allowed + half) then
      return ("%s; expected %.6g +- %.2g"):format(text, expected, allowed)
    end
  end
  if options.at_least and mean + half < options.at_least then
    return ("%s; expected at least %.6g"):format(text, options.at_least)
  end
  if options.at_most and mean - half > options.at_most then
    return ("%s; expected at most %.6g"):format(text, options.at_most)
  end
  return nil, text
end

---@class limax.test_statistics
---@field seeds integer[]|integer|nil the seeds, or how many from 1; 12
---@field expected number|number[]|nil the mean, or a sample to compare with
---@field rtol number|nil of an expected mean, beside what chance explains
---@field atol number|nil
---@field at_least number|nil
---@field at_most number|nil
---@field level number|nil chance of a false alarm; 1e-4

--- Asks.
---@param draw fun(seed: integer): number|boolean
---@param options limax.test_statistics
---@return string|nil failure
---@return string|nil text what was found, where nothing failed
function statistics.check(draw, options)
  local seeds = options.seeds or statistics.SEEDS
  if type(seeds) == "number" then
    local list = {}
    for i = 1, seeds do list[i] = i end
    seeds = list
  end
  if #seeds < 2 then return "seeds: expected two at least" end
  local level = options.level or statistics.LEVEL
  if type(level) ~= "number" or not (level > 0 and level < 1) then
    return ("level: expected a chance between 0 and 1, got %s"):format(tostring(level))
  end
  if not options.expected and not options.at_least and not options.at_most then
    return "nothing is expected: name expected, at_least or at_most"
  end
  local list, message = drawn(draw, seeds)
  if not list then return message end
  if type(options.expected) == "table" then return against_sample(list, options.expected, level) end
  return against_numbers(list, options, level)
end

return statistics
