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

-- A side of a face: face f from its corner k to the next one. Corners of all faces are numbered
-- 4 (f - 1) + k.
local function first_corner(side) return 4 * (side.f - 1) + side.k end
local function second_corner(side) return 4 * (side.f - 1) + side.k % 4 + 1 end

-- The sides of faces on each edge: two, or four where voxels touch only along the edge.
local function edges_of(faces)
  local by_key, edges = {}, {}
  for f, face in ipairs(faces) do
    for k = 1, 4 do
      local from, to = face.corners[k], face.corners[k % 4 + 1]
      local key = math.min(from, to) .. " " .. math.max(from, to)
      if not by_key[key] then
        by_key[key] = {}
        edges[#edges + 1] = by_key[key]
      end
      table.insert(by_key[key], { f = f, k = k })
    end
  end
  return edges
end

-- The pairs of sides that are joined along an edge: of four sides, those of the same voxel.
local function pairs_of(sides, faces)
  if #sides == 2 then return { sides } end
  local own = faces[sides[1].f].voxel
  local first, second = { sides[1] }, {}
  for i = 2, 4 do
    local other = faces[sides[i].f].voxel
    local same = own[1] == other[1] and own[2] == other[2] and own[3] == other[3]
    table.insert(same and first or second, sides[i])
  end
  return { first, second }
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
  local points, index, sets, sets_at = {}, {}, {}, {}
  for f, face in ipairs(faces) do
    for k = 1, 4 do
      local set, site = find(4 * (f - 1) + k), face.corners[k]
      if not index[set] then
        points[#points + 1] = place_of(site, nx, ny)
        index[set], sets[#points] = #points, { site = site }
        sets_at[site] = (sets_at[site] or 0) + 1
      end
      table.insert(sets[index[set]], centre_of(face))
    end
  end
  for i, set in ipairs(sets) do
    if sets_at[set.site] > 1 then points[i] = towards(points[i], mean(set)) end
  end
  return points, index
end

-- Where both ends of an edge are shared by two parts, each part gets a point of its own in the
-- middle of the edge. Returns the index of that point by the first corner of a side.
local function add_middles(points, index, edges, faces, find)
  local middle = {}
  local function ends(side) return find(first_corner(side)), find(second_corner(side)) end
  for _, sides in ipairs(edges) do
    local joined = pairs_of(sides, faces)
    local a, b = ends(joined[1][1])
    local c, d = ends((joined[2] or joined[1])[1])
    if joined[2] and (a == c and b == d or a == d and b == c) then
      for _, pair in ipairs(joined) do
        local half = mean { points[index[a]], points[index[b]] }
        points[#points + 1] = towards(half, centre_of(faces[pair[1].f]))
        for _, side in ipairs(pair) do middle[first_corner(side)] = #points end
      end
    end
  end
  return middle
end

-- The triangles of a face: two, or a fan around its centre where a side has a point in its middle.
local function add_triangles(mesh, f, face, corner_point, middle)
  local ring, corners = {}, {}
  for k = 1, 4 do
    local corner = 4 * (f - 1) + k
    ring[#ring + 1], corners[k] = corner_point(corner), mesh.points[corner_point(corner)]
    ring[#ring + 1] = middle[corner]
  end
  local function add(...)
    table.insert(mesh.triangles, { ... })
    table.insert(mesh.letters, face.letter)
  end
  if #ring == 4 then
    add(ring[1], ring[2], ring[3])
    add(ring[1], ring[3], ring[4])
    return
  end
  table.insert(mesh.points, mean(corners))
  local centre = #mesh.points
  for k = 1, #ring do add(centre, ring[k], ring[k % #ring + 1]) end
end

--- The surface of a body.
---@param voxel string[][][] letters [x][y][z], "." is empty
function surface.of(voxel)
  local every_site = setmetatable({}, { __index = function(_, site) return site end })
  local faces = skin.faces(voxel, every_site)
  local edges, find, unite = edges_of(faces), disjoint_sets(4 * #faces)
  for _, sides in ipairs(edges) do
    for _, pair in ipairs(pairs_of(sides, faces)) do
      unite(first_corner(pair[1]), second_corner(pair[2]))
      unite(second_corner(pair[1]), first_corner(pair[2]))
    end
  end
  local points, index = points_of(faces, find, #voxel, #voxel[1])
  local middle = add_middles(points, index, edges, faces, find)
  local mesh = { points = points, triangles = {}, letters = {} }
  local function corner_point(corner) return index[find(corner)] end
  for f, face in ipairs(faces) do add_triangles(mesh, f, face, corner_point, middle) end
  return mesh
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
