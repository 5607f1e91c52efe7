--- front.lua: comparison of robots by several objectives: dominance, the order of NSGA-II, and the
--- hypervolume of a front. Objectives are maximised; one that begins with a minus is minimised.

local engine = require "limax.engine"
local sorting = require "limax.base.sorting"

local front = {}

--- Points in which larger is better.
---@param list { objectives: number[] }[] robots or rows of an archive
function front.points(list, objectives)
  local points = {}
  for i, each in ipairs(list) do
    points[i] = {}
    for k, measure in ipairs(objectives) do points[i][k] = measure.sign * each.objectives[k] end
  end
  return points
end

--- Indices of points by Pareto rank, then by distance from their neighbours, most first.
---@return integer[]
---@return integer[] ranks of the points, from 1
function front.crowded_order(points)
  local ranks, crowding = engine.pareto(points)
  local order, of_rank, sorted = sorting.descending(crowding), {}, {}
  for k, at in ipairs(order) do of_rank[k] = ranks[at] end
  for k, at in ipairs(sorting.ascending(of_rank)) do sorted[k] = order[at] end
  return sorted, ranks
end

--- Indices of the points that none dominates; of equal ones the first.
function front.of(points)
  local ranks, seen, list = engine.pareto(points), {}, {}
  for i, point in ipairs(points) do
    if ranks[i] == 1 then
      local texts = {}
      for k, value in ipairs(point) do texts[k] = ("%.17g"):format(value) end
      local text = table.concat(texts, " ")
      if not seen[text] then list[#list + 1] = i end
      seen[text] = true
    end
  end
  return list
end

-- Area that points of a plane dominate above (0, 0).
local function area(points)
  local firsts, sum, height = {}, 0, 0
  for i, point in ipairs(points) do firsts[i] = point[1] end
  for _, at in ipairs(sorting.descending(firsts)) do
    local point = points[at]
    if point[2] > height then
      sum, height = sum + point[1] * (point[2] - height), point[2]
    end
  end
  return sum
end

-- Volume above (0, 0, 0): slabs between the points' third coordinates, from the top.
local function volume(points)
  local thirds, above, sum = {}, {}, 0
  for i, point in ipairs(points) do thirds[i] = point[3] end
  local order = sorting.descending(thirds)
  for k, at in ipairs(order) do
    above[k] = points[at]
    local below = order[k + 1] and thirds[order[k + 1]] or 0
    if thirds[at] > below then sum = sum + area(above) * (thirds[at] - below) end
  end
  return sum
end

--- The volume between a reference point and a front of two or three objectives, exactly.
---@param points number[][] larger is better
function front.hypervolume(points, reference)
  local above = {}
  for _, point in ipairs(points) do
    local shifted, inside = {}, true
    for k, value in ipairs(reference) do
      shifted[k] = point[k] - value
      inside = inside and shifted[k] > 0
    end
    if inside then above[#above + 1] = shifted end
  end
  return (#reference == 2 and area or volume)(above)
end

--- Size and hypervolume of the front of robots, or of rows of an archive.
---@param reference number[]|nil in the objectives' own signs
---@return { size: integer, hypervolume: number|nil }
function front.measure(list, objectives, reference)
  local points, best = front.points(list, objectives), {}
  for k, at in ipairs(front.of(points)) do best[k] = points[at] end
  if not reference then return { size = #best } end
  local signed = {}
  for k, measure in ipairs(objectives) do signed[k] = measure.sign * reference[k] end
  return { size = #best, hypervolume = front.hypervolume(best, signed) }
end

--- The objectives of robots beside the reference: "distance is 0.1 to 0.2 (reference 5), ...".
---@param measured { objectives: limax.measure[], reference: number[] }
function front.ranges(list, measured)
  local texts = {}
  for k, measure in ipairs(measured.objectives) do
    local least, most = math.huge, -math.huge
    for _, each in ipairs(list) do
      least, most = math.min(least, each.objectives[k]), math.max(most, each.objectives[k])
    end
    texts[k] = ("%s is %.4g to %.4g (reference %.6g, expected %s)"):format(measure.name, least,
      most, measured.reference[k], measure.sign < 0 and "above" or "below")
  end
  return table.concat(texts, ", ")
end

--- Describes the problem of a reference point; nil if it has none.
---@param options { objectives: limax.measure[], reference?: number[] }
function front.wrong_reference(options)
  local wanted, reference = #options.objectives, options.reference
  if not reference or #reference == wanted and wanted <= 3 then return nil end
  if wanted > 3 then
    return ("reference: a hypervolume is of two or three objectives, there are %d; leave it out")
      :format(wanted)
  end
  return ("reference: expected one number for each of the %d objectives, got %d"):format(wanted,
    #reference)
end

return front
