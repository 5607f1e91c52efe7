--- neighbours.lua: the nearest of many points. Points are sorted along the axis of their largest
--- extent; a search goes outwards from its place and stops where that axis exceeds the distance of
--- the last neighbour: linear in the points at worst, their square root for even points of a plane.

local ffi = require "ffi"
local sorting = require "limax.base.sorting"

local neighbours = {}

---@class limax.neighbours
---@field count integer
---@field dimensions integer
---@field order integer[] index of each sorted point
---@field place ffi.cdata* int32_t[], of each point among the sorted ones
local Neighbours = {}
Neighbours.__index = Neighbours

-- The axis along which the points differ most.
local function widest(points, dimensions)
  local best, widest_extent = 1, -1
  for d = 1, dimensions do
    local least, most = math.huge, -math.huge
    for i = 1, #points do
      least, most = math.min(least, points[i][d]), math.max(most, points[i][d])
    end
    if most - least > widest_extent then best, widest_extent = d, most - least end
  end
  return best
end

--- Prepares points for searches.
---@param points number[][] [point][dimension]
---@param dimensions integer
---@return limax.neighbours
function neighbours.new(points, dimensions)
  local count, axis, along = #points, widest(points, dimensions), {}
  for i = 1, count do along[i] = points[i][axis] end
  local order = sorting.ascending(along)
  -- the sorted axis comes first
  local data = ffi.new("double[?]", math.max(count * dimensions, 1))
  local place = ffi.new("int32_t[?]", count + 1)
  for k = 1, count do
    local point, at = points[order[k]], (k - 1) * dimensions
    place[order[k]] = k - 1
    data[at] = point[axis]
    local column = 1
    for d = 1, dimensions do
      if d ~= axis then
        data[at + column] = point[d]
        column = column + 1
      end
    end
  end
  return setmetatable({ count = count, dimensions = dimensions, axis = axis, order = order,
    place = place, data = data }, Neighbours)
end

local function squared_distance(data, at, query, dimensions)
  local sum = 0
  for d = 0, dimensions - 1 do
    local difference = data[at + d] - query[d]
    sum = sum + difference * difference
  end
  return sum
end

-- Inserts a distance into the sorted ones that were found.
local function insert(found, indices, count, most, distance, index)
  local k = count < most and count or most - 1
  while k > 0 and found[k - 1] > distance do
    found[k], indices[k] = found[k - 1], indices[k - 1]
    k = k - 1
  end
  found[k], indices[k] = distance, index
  return count < most and count + 1 or most
end

-- The first sorted point that is not before `value` along the first axis.
local function first_from(self, value)
  local low, high = 0, self.count
  while low < high do
    local middle = math.floor((low + high) / 2)
    if self.data[middle * self.dimensions] < value then low = middle + 1 else high = middle end
  end
  return low
end

--- Finds the nearest points. `found` gets their squared distances and `indices` their places among
--- the sorted points (from 0), the nearest first; points whose `group` is `skip` are left out.
---@param query ffi.cdata* double[dimensions], the sorted axis first
---@param most integer number of points
---@param found ffi.cdata* double[most]
---@param indices ffi.cdata* int32_t[most]
---@param group ffi.cdata*|nil double[], of each sorted point
---@param skip number|nil
---@return integer number that was found
function Neighbours:nearest(query, most, found, indices, group, skip)
  local data, dimensions, count = self.data, self.dimensions, 0
  local right = first_from(self, query[0])
  local left = right - 1
  for direction = 0, 1 do
    local at, step, stop = right, 1, self.count
    if direction == 1 then at, step, stop = left, -1, -1 end
    while at ~= stop do
      local ahead = data[at * dimensions] - query[0]
      if count == most and ahead * ahead >= found[most - 1] then break end
      if not (group and group[at] == skip) then
        local distance = squared_distance(data, at * dimensions, query, dimensions)
        if count < most or distance < found[most - 1] then
          count = insert(found, indices, count, most, distance, at)
        end
      end
      at = at + step
    end
  end
  return count
end

--- A point in the order of the axes of a search.
---@param point number[]
---@param query ffi.cdata* double[dimensions] that is written
function Neighbours:query(point, query)
  query[0] = point[self.axis]
  local column = 1
  for d = 1, self.dimensions do
    if d ~= self.axis then
      query[column] = point[d]
      column = column + 1
    end
  end
end

return neighbours
