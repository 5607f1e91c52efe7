--- neighbours.lua: the nearest of many points. Points are sorted along the axis of their largest
--- extent. A search goes outwards from its place, and stops in each direction where that axis
--- exceeds the distance of the last neighbour.

local ffi = require "ffi"
local sorting = require "limax.base.sorting"

local neighbours = {}

---@class limax.neighbours
---@field count integer points
---@field stride integer numbers of a sorted point
---@field axes integer[] in the order of a sorted point's numbers: by their extents, least first,
--- after the two with the largest extents
---@field column integer place of the axis along which points are sorted, from 0
---@field order integer[] index of each sorted point
---@field place ffi.cdata* int32_t[], of each point among the sorted ones
---@field data ffi.cdata* double[], of the sorted points
local Neighbours = {}
Neighbours.__index = Neighbours

-- The axes, the one along which the points differ most last.
local function axes_of(points, dimensions)
  local extents = {}
  for d = 1, dimensions do
    local least, most = math.huge, -math.huge
    for i = 1, #points do
      least, most = math.min(least, points[i][d]), math.max(most, points[i][d])
    end
    extents[d] = most - least
  end
  return sorting.ascending(extents)
end

-- Copies a point in the order of the axes, with zeros up to a multiple of four.
local function write(point, axes, target, at)
  for k = 1, #axes do target[at + k - 1] = point[axes[k]] end
end

--- Prepares points for searches.
---@param points number[][] [point][dimension]
function neighbours.new(points, dimensions)
  local count, stride = #points, 4 * math.ceil(dimensions / 4)
  local axes, column, along = axes_of(points, dimensions), math.min(dimensions, 2) - 1, {}
  local widest = table.remove(axes)
  if dimensions > 1 then table.insert(axes, 1, table.remove(axes)) end
  table.insert(axes, column + 1, widest)
  for i, point in ipairs(points) do along[i] = point[widest] end
  local order = sorting.ascending(along)
  local self = { count = count, stride = stride, axes = axes, order = order, column = column,
    data = ffi.new("double[?]", math.max(count * stride, 1)),
    place = ffi.new("int32_t[?]", count + 1), query = ffi.new("double[?]", stride) }
  for k, i in ipairs(order) do
    self.place[i] = k - 1
    write(points[i], axes, self.data, (k - 1) * stride)
  end
  return setmetatable(self, Neighbours)
end

-- Four coordinates at a time: LuaJIT compiles no loops of two or three passes within a loop.
local function squared_distance(data, at, query, stride)
  local a, b = data[at] - query[0], data[at + 1] - query[1]
  local c, d = data[at + 2] - query[2], data[at + 3] - query[3]
  local sum = a * a + b * b + c * c + d * d
  for k = 4, stride - 1 do
    local difference = data[at + k] - query[k]
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

-- The first sorted point that is not before `value`; the number of points if there is none.
local function first_from(self, value)
  local low, high = 0, self.count
  while low < high do
    local middle = math.floor((low + high) / 2)
    if self.data[middle * self.stride + self.column] < value then
      low = middle + 1
    else
      high = middle
    end
  end
  return low
end

-- Searches from a sorted point to another one.
local function sweep(self, search, first, last, step)
  local data, stride, column, query = self.data, self.stride, self.column, search.query
  local found, indices = search.found, search.indices
  local count, most = search.count, search.most
  local limit = count == most and found[most - 1] or math.huge
  for at = first, last, step do
    local ahead = data[at * stride + column] - query[column]
    if ahead * ahead >= limit then break end
    local distance = squared_distance(data, at * stride, query, stride)
    if distance < limit then
      count = insert(found, indices, count, most, distance, at)
      if count == most then limit = found[most - 1] end
    end
  end
  search.count = count
end

---@class limax.neighbours.search
---@field query ffi.cdata* double*: a sorted point, or `write` has written it
---@field most integer number of points that are wanted
---@field found ffi.cdata* double[most], gets the squared distances, the nearest first
---@field indices ffi.cdata* int32_t[most], gets the places among the sorted points, from 0
---@field count integer that was found

--- Finds the nearest points.
function Neighbours:nearest(search)
  search.count = 0
  local first = first_from(self, search.query[self.column])
  sweep(self, search, first, self.count - 1, 1)
  sweep(self, search, first - 1, 0, -1)
end

--- The index of the point that is nearest to another one.
function Neighbours:nearest_to(point)
  self.one = self.one or { query = self.query + 0, most = 1, found = ffi.new("double[?]", 1),
    indices = ffi.new("int32_t[?]", 1), count = 0 }
  write(point, self.axes, self.query, 0)
  self:nearest(self.one)
  return self.order[self.one.indices[0] + 1]
end

return neighbours
