--- exploratory.lua: numbers of an arm without a claim: how soon it reached a target, and the mean
--- of the best so far over evaluations.

local curves = require "limax.tools.report.curves"
local runs = require "limax.tools.compare.runs"
local sample = require "limax.base.statistics.sample"

local exploratory = {}

--- The best of the last generation, under the first materials, as it was evolved.
---@return number
function exploratory.last(run)
  local points = curves.points(run, runs.score)
  return points[#points] and points[#points][2] or 0
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

--- How many runs reached the target, the median of the evaluations that this took (runs that missed
--- it count as longer than all; nil where the median is one of them), and the centre of the area
--- under the curve, as a mean over evaluations.
---@param target number
---@return { reached: integer, evaluations: number|nil, area: number, areas: number[],
--- to_target: table<integer, number> }
function exploratory.of(list, target)
  local hits, spent, areas, to_target = 0, {}, {}, {}
  for i, run in ipairs(list) do
    local points = curves.points(run, runs.score)
    local at = reached(points, target)
    hits = hits + (at and 1 or 0)
    spent[i], to_target[i] = at or math.huge, at
    areas[i] = area(points)
  end
  local median = sample.median(spent)
  return { reached = hits, evaluations = median < math.huge and median or nil,
    area = sample.centre(areas), areas = areas, to_target = to_target }
end

return exploratory
