--- surface.lua: the closed surface of a body at rest as triangles: every edge belongs to exactly
--- two triangles, which run along it in opposite directions. Points are in units of a voxel's edge,
--- from the lattice's lowest corner; triangles are counter-clockwise seen from outside.

local skin = require "limax.draw.skin"

local surface = {}

--- Parts of a body that touch only along an edge or at a corner are separated there: each part's
--- point is moved into the part by this share of an edge. Joined, the surface would not be closed.
surface.GAP = 0.01

---@class limax.convert.mesh
---@field points number[][] x, y, z
---@field triangles integer[][] three indices into points, from 1
---@field letters string[] of each triangle's voxel

-- Corner k of face f has the number 4 (f - 1) + k. A side of a face has the number of the corner at
-- which it begins.
local function face_of(corner) return math.floor((corner - 1) / 4) + 1 end
local function next_of(corner) return corner % 4 == 0 and corner - 3 or corner + 1 end
local function site_of(faces, corner)
  return faces[face_of(corner)].corners[(corner - 1) % 4 + 1]
end

-- The pairs of sides that are joined along each edge: one pair, or two, each of one voxel, where
-- voxels touch only along the edge.
local function edges_of(faces)
  local by_key, edges = {}, {}
  for side = 1, 4 * #faces do
    local from, to = site_of(faces, side), site_of(faces, next_of(side))
    local key = math.min(from, to) .. " " .. math.max(from, to)
    if not by_key[key] then
      by_key[key] = {}
      edges[#edges + 1] = by_key[key]
    end
    table.insert(by_key[key], side)
  end
  for i, sides in ipairs(edges) do
    local first, second = { sides[1] }, {}
    local own = faces[face_of(sides[1])].voxel
    for k = 2, #sides do
      local other = faces[face_of(sides[k])].voxel
      local same = #sides == 2
        or own[1] == other[1] and own[2] == other[2] and own[3] == other[3]
      table.insert(same and first or second, sides[k])
    end
    edges[i] = { first, #sides == 4 and second or nil }
  end
  return edges
end

-- Disjoint sets of 1 to count: `find` returns the smallest member of a set.
local function disjoint_sets(count)
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
    parent[math.max(i, j)] = math.min(i, j)
  end
end

-- `point` moved by the share GAP towards `target`.
local function towards(point, target)
  local moved = {}
  for k = 1, 3 do moved[k] = point[k] + surface.GAP * (target[k] - point[k]) end
  return moved
end

local function mean(list)
  local sum = { 0, 0, 0 }
  for _, point in ipairs(list) do
    for k = 1, 3 do sum[k] = sum[k] + point[k] end
  end
  for k = 1, 3 do sum[k] = sum[k] / #list end
  return sum
end

local function place_of(site, nx, ny)
  local row = math.floor(site / (nx + 1))
  return { site % (nx + 1), row % (ny + 1), math.floor(row / (ny + 1)) }
end

local function centre_of(face)
  local x, y, z = unpack(face.voxel)
  return { x - 0.5, y - 0.5, z - 0.5 }
end

-- A point for each set of joined corners, moved where a site has several. Returns the points and
-- the index of each set's point.
local function points_of(faces, find, nx, ny)
  local points, index, centres, sites, sets_at = {}, {}, {}, {}, {}
  for corner = 1, 4 * #faces do
    local set, site = find(corner), site_of(faces, corner)
    if not index[set] then
      points[#points + 1] = place_of(site, nx, ny)
      index[set], centres[#points], sites[#points] = #points, {}, site
      sets_at[site] = (sets_at[site] or 0) + 1
    end
    table.insert(centres[index[set]], centre_of(faces[face_of(corner)]))
  end
  for i, site in ipairs(sites) do
    if sets_at[site] > 1 then points[i] = towards(points[i], mean(centres[i])) end
  end
  return points, index
end

-- Where both ends of an edge are shared by two parts, each part gets a point of its own in the
-- middle of the edge. Returns the index of that point by side.
local function add_middles(points, edges, faces, point_of)
  local middle = {}
  for _, pairs_of_edge in ipairs(edges) do
    local first, second = unpack(pairs_of_edge, 1, 2)
    if second then
      local a, b = point_of(first[1]), point_of(next_of(first[1]))
      local c, d = point_of(second[1]), point_of(next_of(second[1]))
      if a == c and b == d or a == d and b == c then
        for _, pair in ipairs(pairs_of_edge) do
          points[#points + 1] = towards(mean { points[a], points[b] },
            centre_of(faces[face_of(pair[1])]))
          middle[pair[1]], middle[pair[2]] = #points, #points
        end
      end
    end
  end
  return middle
end

-- The triangles of a face: two, or a fan around its centre where a side has a point in its middle.
local function add_triangles(mesh, f, letter, point_of, middle)
  local ring, corners = {}, {}
  for corner = 4 * f - 3, 4 * f do
    ring[#ring + 1] = point_of(corner)
    corners[#corners + 1] = mesh.points[ring[#ring]]
    ring[#ring + 1] = middle[corner]
  end
  local function add(...)
    table.insert(mesh.triangles, { ... })
    table.insert(mesh.letters, letter)
  end
  if #ring == 4 then
    add(ring[1], ring[2], ring[3])
    add(ring[1], ring[3], ring[4])
    return
  end
  table.insert(mesh.points, mean(corners))
  for k = 1, #ring do add(#mesh.points, ring[k], ring[k % #ring + 1]) end
end

--- The surface of a body.
---@param voxel string[][][] letters [x][y][z], "." is empty
function surface.of(voxel)
  local every_site = setmetatable({}, { __index = function(_, site) return site end })
  local faces = skin.faces(voxel, every_site)
  local edges, find, unite = edges_of(faces), disjoint_sets(4 * #faces)
  for _, pairs_of_edge in ipairs(edges) do
    for _, pair in ipairs(pairs_of_edge) do
      unite(pair[1], next_of(pair[2]))
      unite(next_of(pair[1]), pair[2])
    end
  end
  local points, index = points_of(faces, find, #voxel, #voxel[1])
  local function point_of(corner) return index[find(corner)] end
  local middle = add_middles(points, edges, faces, point_of)
  local mesh = { points = points, triangles = {}, letters = {} }
  for f, face in ipairs(faces) do add_triangles(mesh, f, face.letter, point_of, middle) end
  return mesh
end

--- The size of a surface along x, y and z, in the unit of its points.
---@return number[]
function surface.size(mesh)
  local low, high = { unpack(mesh.points[1]) }, { unpack(mesh.points[1]) }
  for _, point in ipairs(mesh.points) do
    for k = 1, 3 do
      low[k], high[k] = math.min(low[k], point[k]), math.max(high[k], point[k])
    end
  end
  return { high[1] - low[1], high[2] - low[2], high[3] - low[3] }
end

--- The surface of a robot in millimetres.
---@param edge number mm, of a voxel
function surface.of_robot(robot, edge)
  local mesh = surface.of(robot.body.voxel)
  for _, point in ipairs(mesh.points) do
    for k = 1, 3 do point[k] = point[k] * edge end
  end
  return mesh
end

return surface
