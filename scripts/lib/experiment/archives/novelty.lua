--- novelty.lua: an archive without cells, and the novelty of robots: the mean distance of a robot's
--- descriptors to those of its k nearest neighbours in the archive and in its own population.

local ffi = require "ffi"
local neighbours = require "limax.experiment.archives.neighbours"

-- Descriptors as distances measure them: a range counts as 1.
local function scaled(values, descriptors)
  local point = {}
  for d, measure in ipairs(descriptors) do
    local range = measure.range
    point[d] = range and (values[d] - range[1]) / (range[2] - range[1]) or values[d]
  end
  return point
end

-- Writes `novelty` into the rows of robots with descriptors. A robot is no neighbour of itself,
-- in the population or in the archive.
local function write(robots, rows, descriptors, k)
  local points, ids, robot_of = {}, {}, {}
  for _, row in ipairs(rows) do
    points[#points + 1], ids[#ids + 1] = scaled(row.descriptors, descriptors), row.id
  end
  for _, robot in ipairs(robots) do
    if robot.fitness and robot.descriptors then
      points[#points + 1], ids[#ids + 1] = scaled(robot.descriptors, descriptors), robot.id
      robot_of[#points] = robot
    end
  end
  local search, most = neighbours.new(points, #descriptors), k + 2
  local one = { most = most, found = ffi.new("double[?]", most),
    indices = ffi.new("int32_t[?]", most) }
  for i = #rows + 1, #points do
    one.query = search.data + search.place[i] * search.stride
    search:nearest(one)
    local robot, sum, count = robot_of[i], 0, 0
    for n = 0, one.count - 1 do
      if count < k and ids[search.order[one.indices[n] + 1]] ~= ids[i] then
        sum, count = sum + math.sqrt(one.found[n]), count + 1
      end
    end
    robot.novelty = count > 0 and sum / count or 0
  end
end

-- `count` of the candidates, each with the same chance.
local function drawn(candidates, count, random)
  local left, list = {}, {}
  for k, row in ipairs(candidates) do left[k] = row end
  for k = 1, math.min(count, #left) do
    local at = k - 1 + random:integer(#left - k + 1)
    left[k], left[at] = left[at], left[k]
    list[k] = left[k]
  end
  return list
end

-- The oldest rows leave an archive that is full.
local function leaving(rows, entered, capacity)
  local surplus = #rows + #entered - capacity
  if surplus <= 0 then return nil end
  local ids = {}
  for k = 1, math.min(surplus, #rows) do ids[rows[k].id] = true end
  return ids
end

--- An unstructured archive.
---@param options { descriptors: limax.measure[], k: integer, threshold?: number, add?: integer,
--- capacity: integer }
---@return limax.archive.definition|string
return function(options)
  if options.threshold and options.add then
    return "threshold and add: name one of the two rules by which robots enter"
  end
  local function enter(candidates, random)
    if not random then return candidates end -- they entered before
    if not options.threshold then return drawn(candidates, options.add or 6, random) end
    local list = {}
    for _, row in ipairs(candidates) do
      if row.novelty >= options.threshold then list[#list + 1] = row end
    end
    return list
  end
  return {
    descriptors = options.descriptors,
    appraise = function(robots, rows) write(robots, rows, options.descriptors, options.k) end,
    choose = function(rows, _, candidates, random)
      local list = enter(candidates, random)
      for k = #list, options.capacity + 1, -1 do list[k] = nil end
      return list, leaving(rows, list, options.capacity)
    end,
  }
end
