--- curves.lua: what a run reached after how many evaluations. An evaluation is one simulation of a
--- robot for its score; elites that keep their score need none, and those of a tuning come first.

local runs = require "limax.tools.compare.runs"
local sample = require "limax.base.statistics.sample"

local curves = {}

--- Points { evaluations, value } of a run, generation by generation. A generation without a value
--- repeats the one before.
---@param run limax.compare.run
---@param value fun(line: table): number|nil
---@return number[][]
function curves.points(run, value)
  local points, spent, before = {}, run.before, nil
  for _, line in ipairs(run.lines) do
    spent = spent + line.evaluations
    before = value(line) or before
    if before then points[#points + 1] = { spent, before } end
  end
  return points
end

--- The best of the last generation, under the first materials, as it was evolved.
---@param run limax.compare.run
---@return number
function curves.last(run)
  local points = curves.points(run, runs.score)
  return points[#points] and points[#points][2] or 0
end

--- The value at a number of evaluations: that of the last generation that was whole by then; nil
--- before the first.
---@param points number[][]
---@param evaluations number
---@return number|nil
function curves.at(points, evaluations)
  local value
  for _, point in ipairs(points) do
    if point[1] > evaluations then break end
    value = point[2]
  end
  return value
end

-- Evaluations after which the target was reached; nil if never.
local function reached(points, target)
  for _, point in ipairs(points) do
    if point[2] >= target then return point[1] end
  end
end

-- Mean of the best so far between the first generation and the last, by evaluations.
local function area(points)
  local sum, best = 0, -math.huge
  for k, point in ipairs(points) do
    best = math.max(best, point[2])
    if points[k + 1] then sum = sum + best * (points[k + 1][1] - point[1]) end
  end
  local span = #points > 0 and points[#points][1] - points[1][1] or 0
  return span > 0 and sum / span or best
end

--- Exploratory numbers of an arm: how many runs reached the target, the median of the evaluations
--- that this took (runs that missed it count as longer than all; nil where the median is one of
--- them), and the centre of the area under the curve, as a mean over evaluations.
---@param list limax.compare.run[]
---@param target number
---@return { reached: integer, evaluations: number|nil, area: number, areas: number[],
--- to_target: table<integer, number> }
function curves.exploratory(list, target)
  local hits, spent, areas, to_target = 0, {}, {}, {}
  for i, run in ipairs(list) do
    local points = curves.points(run, runs.score)
    local at = reached(points, target)
    hits = hits + (at and 1 or 0)
    -- censored
    spent[i], to_target[i] = at or math.huge, at
    areas[i] = area(points)
  end
  local median = sample.median(spent)
  return { reached = hits, evaluations = median < math.huge and median or nil,
    area = sample.centre(areas), areas = areas, to_target = to_target }
end

return curves
