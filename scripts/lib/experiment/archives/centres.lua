--- centres.lua: the centres of a CVT archive's cells: a centroidal Voronoi tessellation of the unit
--- cube by Lloyd's algorithm. They depend on the numbers of cells, dimensions and samples only, so
--- that all runs with these have the same cells.

local engine = require "limax.engine"
local neighbours = require "limax.experiment.archives.neighbours"

-- Passes of Lloyd's algorithm; centres hardly move after ten.
local PASSES = 12

-- In up to 4 dimensions a search visits few centres, in more nearly all. So many visits in a pass
-- take up to half an hour.
local FEW, MOST_VISITS = 4, 4e9

local centres, known = {}, {}

-- Samples, if left out 20 for each cell, but no more than 1e5, or three for each.
local function completed(cells, samples)
  return math.max(samples or math.max(math.min(20 * cells, 1e5), 3 * cells), cells)
end

--- Explains why so many centres would take too long; nil if they do not.
function centres.refusal(cells, dimensions, samples)
  samples = completed(cells, samples)
  if dimensions <= FEW or cells * samples <= MOST_VISITS then return nil end
  return ("%d cells by %d random points in %d dimensions would take hours: cells times points may"
    .. " be at most %.0e in more than %d dimensions"):format(cells, samples, dimensions,
    MOST_VISITS, FEW)
end

-- Even random points.
local function random_points(count, dimensions)
  local random, points = engine.random(1, 1, "selection"), {}
  for i = 1, count do
    points[i] = {}
    for d = 1, dimensions do points[i][d] = random:uniform() end
  end
  return points
end

-- Every centre of the list moves to the mean of the samples that are nearest to it.
local function pass(list, samples, dimensions)
  local search = neighbours.new(list, dimensions)
  local sums, counts, moved = {}, {}, {}
  for i = 1, #list do
    sums[i], counts[i] = {}, 0
    for d = 1, dimensions do sums[i][d] = 0 end
  end
  for _, sample in ipairs(samples) do
    local i = search:nearest_to(sample)
    counts[i] = counts[i] + 1
    for d = 1, dimensions do sums[i][d] = sums[i][d] + sample[d] end
  end
  for i, sum in ipairs(sums) do
    moved[i] = list[i]
    if counts[i] > 0 then
      moved[i] = {}
      for d = 1, dimensions do moved[i][d] = sum[d] / counts[i] end
    end
  end
  return moved
end

--- The centres of cells in the unit cube.
---@param samples integer|nil random points that stand for the cube; if left out 20 for each cell,
--- but no more than 1e5, or three for each
---@return number[][] [cell][dimension]
function centres.of(cells, dimensions, samples)
  samples = completed(cells, samples)
  local key = ("%d %d %d"):format(cells, dimensions, samples)
  if not known[key] then
    local points, list = random_points(samples, dimensions), {}
    for i = 1, cells do list[i] = points[i] end
    for _ = 1, PASSES do list = pass(list, points, dimensions) end
    known[key] = list
  end
  return known[key]
end

return centres
