--- neighbours.lua: the nearest of many points. Points are divided into slabs along the axis of
--- their largest extent, and sorted in each slab along the axis of the next largest one. A search
--- goes outwards from its place, in its slab and then from slab to slab, and stops in each
--- direction where one axis exceeds the distance of the last neighbour.

local ffi = require "ffi"
local sorting = require "limax.base.sorting"

local neighbours = {}

-- A slab has sqrt(64 n) of n points: with fewer, entering slabs takes most of the time.
local OF_SLAB = 64

---@class limax.neighbours
---@field stride integer numbers of a sorted point: the axis within slabs, that of slabs, the others
---@field order integer[] index of each sorted point
---@field place ffi.cdata* int32_t[], of each point among the sorted ones
---@field data ffi.cdata* double[], of the sorted points
---@field slabs integer their number; slab s holds the sorted points start[s] to start[s + 1] - 1,
--- least[s] to most[s] along their axis
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

-- Indices of the points, sorted along an axis.
local function sorted_along(points, axis)
  local along = {}
  for i = 1, #points do along[i] = points[i][axis] end
  return sorting.ascending(along)
end

-- The axes in the order of a sorted point's numbers, the points' order, and the slabs' starts.
local function arranged(points, dimensions)
  local axes, count = axes_of(points, dimensions), #points
  local widest = table.remove(axes)
  table.insert(axes, 1, widest)
  local order = sorted_along(points, widest)
  if dimensions == 1 then return axes, order, { 0, count } end
  local second = table.remove(axes)
  table.insert(axes, 1, second)
  local slabs = math.max(1, math.floor(math.sqrt(count / OF_SLAB)))
  local slab_of, start, filled = {}, {}, {}
  for k = 1, count do slab_of[order[k]] = math.floor((k - 1) * slabs / count) end
  for s = 0, slabs do start[s + 1], filled[s] = math.ceil(s * count / slabs), 0 end
  for _, i in ipairs(sorted_along(points, second)) do
    local s = slab_of[i]
    filled[s] = filled[s] + 1
    order[start[s + 1] + filled[s]] = i
  end
  return axes, order, start
end

-- Copies a point in the order of the axes, with zeros up to a multiple of four.
local function write(point, axes, target, at)
  for k = 1, #axes do target[at + k - 1] = point[axes[k]] end
end

--- Prepares points for searches.
---@param points number[][] [point][dimension]
function neighbours.new(points, dimensions)
  local count, stride = #points, 4 * math.ceil(dimensions / 4)
  local axes, order, start = arranged(points, dimensions)
  local slabs, column = #start - 1, math.min(dimensions, 2) - 1
  local self = { count = count, stride = stride, axes = axes, order = order, slabs = slabs,
    data = ffi.new("double[?]", math.max(count * stride, 1)), column = column,
    place = ffi.new("int32_t[?]", count + 1), start = ffi.new("int32_t[?]", slabs + 1, start),
    least = ffi.new("double[?]", slabs), most = ffi.new("double[?]", slabs),
    query = ffi.new("double[?]", stride) }
  for k = 1, count do
    self.place[order[k]] = k - 1
    write(points[order[k]], axes, self.data, (k - 1) * stride)
  end
  for s = 0, slabs - 1 do
    local least, most = math.huge, -math.huge
    for at = self.start[s], self.start[s + 1] - 1 do
      local value = self.data[at * stride + column]
      least, most = math.min(least, value), math.max(most, value)
    end
    self.least[s], self.most[s] = least, most
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

-- The first of sorted points low to high - 1 that is not before `value`; high if there is none.
local function first_from(data, stride, low, high, value)
  while low < high do
    local middle = math.floor((low + high) / 2)
    if data[middle * stride] < value then low = middle + 1 else high = middle end
  end
  return low
end

-- Searches from a sorted point to another one. Returns the number of neighbours so far.
local function sweep(self, search, first, last, step)
  local data, stride, query = self.data, self.stride, search.query
  local found, indices = search.found, search.indices
  local count, most = search.count, search.most
  local limit = count == most and found[most - 1] or math.huge
  for at = first, last, step do
    local ahead = data[at * stride] - query[0]
    if ahead * ahead >= limit then break end
    local distance = squared_distance(data, at * stride, query, stride)
    if distance < limit then
      count = insert(found, indices, count, most, distance, at)
      if count == most then limit = found[most - 1] end
    end
  end
  search.count = count
end

-- Searches a slab; false where it is too far away, and with it all that follow in this direction.
local function search_slab(self, search, s, distance)
  if search.count == search.most and distance > 0
    and distance * distance >= search.found[search.most - 1] then
    return false
  end
  local low, high = self.start[s], self.start[s + 1]
  local first = first_from(self.data, self.stride, low, high, search.query[0])
  sweep(self, search, first, high - 1, 1)
  sweep(self, search, first - 1, low, -1)
  return true
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
  local value, home = search.query[self.column], 0
  local high = self.slabs
  while home < high do
    local middle = math.floor((home + high) / 2)
    if self.most[middle] < value then home = middle + 1 else high = middle end
  end
  for s = home, self.slabs - 1 do
    if not search_slab(self, search, s, self.least[s] - value) then break end
  end
  for s = home - 1, 0, -1 do
    if not search_slab(self, search, s, value - self.most[s]) then break end
  end
end

--- The index of the point that is nearest to another one.
---@param point number[]
function Neighbours:nearest_to(point)
  self.one = self.one or { query = self.query + 0, most = 1, found = ffi.new("double[?]", 1),
    indices = ffi.new("int32_t[?]", 1), count = 0 }
  write(point, self.axes, self.query, 0)
  self:nearest(self.one)
  return self.order[self.one.indices[0] + 1]
end

return neighbours
