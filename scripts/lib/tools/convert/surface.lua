--- surface.lua: the outside of a body at rest as triangles, closed: every edge belongs to exactly
--- two triangles, which run along it in opposite directions. Points in units of a voxel's edge,
--- from the lattice's lowest corner; triangles are counter-clockwise seen from outside.

local skin = require "limax.draw.skin"

local surface = {}

--- Parts of a body that touch along an edge or at a corner alone are parted there by moving that
--- corner into its own part by this share of an edge: joined, the surface would not be closed.
surface.PARTED = 0.01

---@class limax.convert.mesh
---@field points number[][] x, y, z
---@field triangles integer[][] three indices into points, from 1
---@field letters string[] of each triangle's voxel

-- Where a site lies.
local function place(site, nx, ny)
  local x = site % (nx + 1)
  local row = (site - x) / (nx + 1)
  local y = row % (ny + 1)
  return { x, y, (row - y) / (ny + 1) }
end

-- Sides of faces by the edge that they lie on: two, or four where voxels touch along an edge.
local function sides_by_edge(faces)
  local edges, order = {}, {}
  for f, face in ipairs(faces) do
    for k = 1, 4 do
      local one, other = face.corners[k], face.corners[k % 4 + 1]
      local key = math.min(one, other) .. " " .. math.max(one, other)
      if not edges[key] then
        edges[key] = {}
        order[#order + 1] = key
      end
      table.insert(edges[key], { f = f, k = k })
    end
  end
  return edges, order
end

-- Pairs of sides that the surface joins: the two of an edge or, of four, those of the same voxel.
local function pairs_of(sides, voxels)
  if #sides == 2 then return { sides } end
  local first, second = { sides[1] }, {}
  local mine = voxels[sides[1].f]
  for i = 2, 4 do
    local other = voxels[sides[i].f]
    local same = mine[1] == other[1] and mine[2] == other[2] and mine[3] == other[3]
    table.insert(same and first or second, sides[i])
  end
  return { first, second }
end

-- Corners of faces (4 f + k) that are one point of the surface, by joining along paired sides.
local function join(count)
  local parent = {}
  for i = 1, count do parent[i] = i end
  local function find(i)
    while parent[i] ~= i do
      parent[i] = parent[parent[i]]
      i = parent[i]
    end
    return i
  end
  return find, function(i, j)
    i, j = find(i), find(j)
    if i ~= j then parent[math.max(i, j)] = math.min(i, j) end
  end
end

local function corner(side, next) return 4 * (side.f - 1) + (side.k - 1 + next) % 4 + 1 end

-- A point moved by the share PARTED towards another.
local function towards(point, other)
  local moved = {}
  for k = 1, 3 do moved[k] = point[k] + surface.PARTED * (other[k] - point[k]) end
  return moved
end

-- Points of the surface: one for each class of corners, moved where a site has several classes.
local function points_of(faces, voxels, find, nx, ny)
  local points, index, classes, inside = {}, {}, {}, {}
  for f, face in ipairs(faces) do
    for k = 1, 4 do
      local class, site = find(4 * (f - 1) + k), face.corners[k]
      if not inside[class] then
        inside[class] = { 0, 0, 0, site = site, count = 0 }
        classes[site] = (classes[site] or 0) + 1
        points[#points + 1] = class
        index[class] = #points
      end
      local sum = inside[class]
      sum.count = sum.count + 1
      for axis = 1, 3 do sum[axis] = sum[axis] + voxels[f][axis] end
    end
  end
  for i, class in ipairs(points) do
    local sum = inside[class]
    local point = place(sum.site, nx, ny)
    if classes[sum.site] > 1 then
      point = towards(point, { sum[1] / sum.count, sum[2] / sum.count, sum[3] / sum.count })
    end
    points[i] = point
  end
  return points, index
end

--- The surface of a body.
---@param voxel string[][][] letters [x][y][z], "." is empty
---@return limax.convert.mesh
function surface.of(voxel)
  local nx, ny = #voxel, #voxel[1]
  -- every site is its own mass
  local faces = skin.faces(voxel, setmetatable({}, { __index = function(_, site) return site end }))
  local voxels = {}
  for f, face in ipairs(faces) do
    local x, y, z = unpack(face.voxel)
    voxels[f] = { x - 0.5, y - 0.5, z - 0.5 } -- its centre
  end

  local find, unite = join(4 * #faces)
  local edges, order = sides_by_edge(faces)
  for _, key in ipairs(order) do
    for _, pair in ipairs(pairs_of(edges[key], voxels)) do
      unite(corner(pair[1], 0), corner(pair[2], 1))
      unite(corner(pair[1], 1), corner(pair[2], 0))
    end
  end
  local points, index = points_of(faces, voxels, find, nx, ny)

  -- where both ends of a touching edge stay joined, each part gets a point of its own in the middle
  local middle = {}
  for _, key in ipairs(order) do
    local pairs_here = pairs_of(edges[key], voxels)
    local one, other = pairs_here[1][1], pairs_here[2] and pairs_here[2][1]
    local ends = other and { [find(corner(one, 0))] = true, [find(corner(one, 1))] = true }
    if ends and ends[find(corner(other, 0))] and ends[find(corner(other, 1))] then
      for _, pair in ipairs(pairs_here) do
        local a = points[index[find(corner(pair[1], 0))]]
        local b = points[index[find(corner(pair[1], 1))]]
        local half = { (a[1] + b[1]) / 2, (a[2] + b[2]) / 2, (a[3] + b[3]) / 2 }
        points[#points + 1] = towards(half, voxels[pair[1].f])
        for _, side in ipairs(pair) do middle[corner(side, 0)] = #points end
      end
    end
  end

  local triangles, letters = {}, {}
  local function add(letter, a, b, c)
    triangles[#triangles + 1] = { a, b, c }
    letters[#letters + 1] = letter
  end
  for f, face in ipairs(faces) do
    local ring, split = {}, false
    for k = 1, 4 do
      local at = 4 * (f - 1) + k
      ring[#ring + 1] = index[find(at)]
      ring[#ring + 1] = middle[at]
      split = split or middle[at] ~= nil
    end
    if split then
      -- a fan around the face's own middle: no triangle is flat, whichever sides are split
      local centre = { 0, 0, 0 }
      for k = 1, 3 do
        for c = 1, 4 do
          centre[k] = centre[k] + points[index[find(4 * (f - 1) + c)]][k] / 4
        end
      end
      points[#points + 1] = centre
      local hub = #points
      for k = 1, #ring do add(face.letter, hub, ring[k], ring[k % #ring + 1]) end
    else
      add(face.letter, ring[1], ring[2], ring[3])
      add(face.letter, ring[1], ring[3], ring[4])
    end
  end
  return { points = points, triangles = triangles, letters = letters }
end

--- The surface of a robot in millimetres, with the edge of its voxels as given.
---@param robot limax.robot
---@param edge number mm
---@return limax.convert.mesh
function surface.of_robot(robot, edge)
  local mesh = surface.of(robot.body.voxel)
  for _, point in ipairs(mesh.points) do
    for k = 1, 3 do point[k] = point[k] * edge end
  end
  return mesh
end

return surface
