--- statistics.lua: `t:statistically` tests a mean over seeds. It fails only if chance would explain
--- the sample less often than `level`.

local student = require "limax.base.statistics.student"

local statistics = {}

-- Chance of a false alarm. The same seeds and bits always give the same answer.
local LEVEL = 1e-4
-- Seeds: with fewer the interval of a mean is wide at such a level.
local SEEDS = 12

-- The values of all seeds; true and false count as 1 and 0.
local function sample(draw, seeds)
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

local function compare_mean(list, options, level)
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
---@field expected number|nil the mean
---@field rtol number|nil of an expected mean, in addition to chance
---@field atol number|nil
---@field at_least number|nil
---@field at_most number|nil
---@field level number|nil chance of a false alarm; 1e-4

--- Compares a sample with what is expected.
---@param draw fun(seed: integer): number|boolean
function statistics.check(draw, options)
  local seeds, level = options.seeds or SEEDS, options.level or LEVEL
  if type(seeds) == "number" then
    local count = seeds
    seeds = {}
    for i = 1, count do seeds[i] = i end
  end
  if #seeds < 2 then return "seeds: expected at least two" end
  if not options.expected and not options.at_least and not options.at_most then
    return "nothing is expected: set expected, at_least or at_most"
  end
  local list, message = sample(draw, seeds)
  if not list then return message end
  return compare_mean(list, options, level)
end

return statistics
