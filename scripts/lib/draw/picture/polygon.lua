--- polygon.lua: flat, convex pieces of a picture, and cuts by planes. A plane is a
--- normal n and an offset: n.p = offset; points with n.p > offset are in front of it. Metres,
--- along, away, up.

local polygon = {}

-- m: points that a computation puts into a plane are this near to it
local ROUNDING = 1e-9

---@class limax.picture.polygon
---@field points number[][]
---@field edges (boolean|string)[] is the k-th edge, from point k to the next, one of the thing
--- itself, and which?
---@field look table how it is drawn: colours `fill` and `ink`, and `ruled` for floors

local function dot(a, b) return a[1] * b[1] + a[2] * b[2] + a[3] * b[3] end
polygon.dot = dot

local function scaled(a, factor) return { a[1] * factor, a[2] * factor, a[3] * factor } end

local function cross(a, b)
  return { a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1] }
end

local function unit(a) return scaled(a, 1 / math.sqrt(dot(a, a))) end
polygon.unit, polygon.cross = unit, cross

--- The normal, of any length, of a quad that need not be flat: that of its diagonals.
function polygon.quad_normal(points)
  local one, other = {}, {}
  for c = 1, 3 do
    one[c], other[c] = points[3][c] - points[1][c], points[4][c] - points[2][c]
  end
  return cross(one, other)
end

--- Least and most coordinates of points, and the function that adds a point.
function polygon.bounds(dimensions)
  local low, high = {}, {}
  for c = 1, dimensions do low[c], high[c] = math.huge, -math.huge end
  return low, high, function(point)
    for c = 1, dimensions do
      low[c], high[c] = math.min(low[c], point[c]), math.max(high[c], point[c])
    end
  end
end

--- The parts of a polygon in front of a plane and behind it. A polygon that leaves the plane by
--- less than `slack` on a side is not cut; one that does so on both sides counts as in front.
---@param slack? number m, 0 if left out
---@return limax.picture.polygon|nil front
---@return limax.picture.polygon|nil behind
function polygon.split(whole, normal, offset, slack)
  slack = slack or 0
  local points, sides, low, high = whole.points, {}, math.huge, -math.huge
  for k, p in ipairs(points) do
    local side = dot(normal, p) - offset
    sides[k], low, high = side, math.min(low, side), math.max(high, side)
  end
  if low >= -slack then return whole, nil end
  if high <= slack then return nil, whole end
  local front = { points = {}, edges = {}, look = whole.look }
  local behind = { points = {}, edges = {}, look = whole.look }
  local function add(part, point, edge)
    part.points[#part.points + 1], part.edges[#part.edges + 1] = point, edge
  end
  for k, p in ipairs(points) do
    local next_k = k % #points + 1
    local from, to, edge = sides[k], sides[next_k], whole.edges[k]
    add(from >= 0 and front or behind, p, edge)
    if (from >= 0) ~= (to >= 0) then
      local q, share, cut = points[next_k], from / (from - to), {}
      for c = 1, 3 do cut[c] = p[c] + (q[c] - p[c]) * share end
      -- the cut itself is not an edge; beyond it the old edge continues
      add(from >= 0 and front or behind, cut, false)
      add(from >= 0 and behind or front, cut, edge)
    end
  end
  return front, behind
end

--- The part of a polygon within half-spaces, behind all their planes; nil if nothing is left.
---@param except? integer one of them that does not count
function polygon.within(whole, spaces, except)
  for k, space in ipairs(spaces) do
    -- points in the plane are kept
    if k ~= except and whole then
      whole = polygon.split(whole, scaled(space.normal, -1), -space.offset, ROUNDING)
    end
  end
  return whole
end

-- A square in a plane around the point of it that is nearest to `center`.
local function square(normal, offset, center, half)
  local foot, beyond = {}, dot(normal, center) - offset
  for c = 1, 3 do foot[c] = center[c] - beyond * normal[c] end
  -- the axis that the normal is farthest from
  local least = 1
  for c = 2, 3 do
    if math.abs(normal[c]) < math.abs(normal[least]) then least = c end
  end
  local axis = { 0, 0, 0 }
  axis[least] = 1
  local one = unit(cross(normal, axis))
  local other, points = cross(normal, one), {}
  for k, sign in ipairs { { -1, -1 }, { 1, -1 }, { 1, 1 }, { -1, 1 } } do
    points[k] = {}
    for c = 1, 3 do points[k][c] = foot[c] + half * (sign[1] * one[c] + sign[2] * other[c]) end
  end
  return { points = points, edges = { true, true, true, true } }
end

--- Where a plane cuts a polygon: two points, or nothing.
function polygon.crossing(whole, normal, offset)
  local front, behind = polygon.split(whole, normal, offset)
  if not front or not behind then return nil end
  local found = {}
  for k, p in ipairs(front.points) do
    -- the edge along the cut is the one between two points of the plane
    if math.abs(dot(normal, p) - offset) < ROUNDING then found[#found + 1] = front.points[k] end
  end
  return found[1], found[2]
end

--- The k-th side of the common part of half-spaces, whose normals, of length 1, point out of it.
---@param center number[] a point near it, m
---@param half number m: no point of the side is farther than this from `center`
function polygon.side(spaces, k, center, half)
  local side = polygon.within(square(spaces[k].normal, spaces[k].offset, center, half), spaces, k)
  -- where two half-spaces end there is an edge
  for c = 1, side and #side.points or 0 do side.edges[c] = true end
  return side
end

return polygon
