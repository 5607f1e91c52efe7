--- skin.lua: the outside of a deformed body. Points are { along, away, up }, m.

local palette = require "limax.draw.palette"
local polygon = require "limax.draw.picture.polygon"

local skin = {}

--- Colour of the lines between the faces of a body.
skin.ink = "#ffffff"

-- Direction to the light, of length 1: from the left, from above, from the viewer's side.
local light = { -0.40, -0.45, 0.80 }

-- The six sides of a voxel: where the neighbour is, and the four corners, counter-clockwise seen
-- from outside.
local sides = {
  { { 1, 0, 0 }, { { 1, 0, 0 }, { 1, 1, 0 }, { 1, 1, 1 }, { 1, 0, 1 } } },
  { { -1, 0, 0 }, { { 0, 0, 0 }, { 0, 0, 1 }, { 0, 1, 1 }, { 0, 1, 0 } } },
  { { 0, 1, 0 }, { { 0, 1, 0 }, { 0, 1, 1 }, { 1, 1, 1 }, { 1, 1, 0 } } },
  { { 0, -1, 0 }, { { 0, 0, 0 }, { 1, 0, 0 }, { 1, 0, 1 }, { 0, 0, 1 } } },
  { { 0, 0, 1 }, { { 0, 0, 1 }, { 1, 0, 1 }, { 1, 1, 1 }, { 0, 1, 1 } } },
  { { 0, 0, -1 }, { { 0, 0, 0 }, { 0, 1, 0 }, { 1, 1, 0 }, { 1, 0, 0 } } },
}

--- Faces between a voxel and emptiness: the masses at their corners, the voxel's letter and place.
---@param voxel string[][][] [x][y][z]
---@param mass_at table<integer, integer> mass of each site, sites as the engine counts them
---@return { corners: integer[], letter: string, voxel: integer[] }[]
function skin.faces(voxel, mass_at)
  local nx, ny, nz = #voxel, #voxel[1], #voxel[1][1]
  local faces = {}
  for z = 1, nz do
    for y = 1, ny do
      for x = 1, nx do
        local letter = voxel[x][y][z]
        for _, side in ipairs(letter ~= "." and sides or {}) do
          local to = side[1]
          local column = voxel[x + to[1]]
          local row = column and column[y + to[2]]
          local beyond = row and row[z + to[3]]
          if not beyond or beyond == "." then
            local corners = {}
            for k, c in ipairs(side[2]) do
              local row_of_sites = y - 1 + c[2] + (ny + 1) * (z - 1 + c[3])
              corners[k] = mass_at[x - 1 + c[1] + (nx + 1) * row_of_sites]
            end
            faces[#faces + 1] = { corners = corners, letter = letter, voxel = { x, y, z } }
          end
        end
      end
    end
  end
  return faces
end

--- How bright a face with this normal is: a factor on its colour.
---@param normal number[] of length 1
function skin.brightness(normal) return 0.80 + 0.28 * polygon.dot(normal, light) end

--- The faces that face the viewer.
---@param faces { corners: integer[], letter: string }[]
---@param positions number[][] of the masses
---@param colors table<string, limax.color> by letter
---@param sight number[] away from the viewer
---@param held? table<integer, boolean> masses that anchors hold: edges between two are "held"
---@param tints? number[] a factor on the brightness of each face
function skin.visible(faces, positions, colors, sight, held, tints)
  held = held or {}
  local list = {}
  for f, face in ipairs(faces) do
    local p, edges = {}, {}
    for k, corner in ipairs(face.corners) do
      p[k] = positions[corner]
      edges[k] = held[corner] and held[face.corners[k % 4 + 1]] and "held" or true
    end
    local normal = polygon.quad_normal(p)
    if polygon.dot(normal, sight) < 0 then
      local brightness = skin.brightness(polygon.unit(normal)) * (tints and tints[f] or 1)
      list[#list + 1] = { points = p, edges = edges,
        look = { fill = palette.shade(colors[face.letter].hex, brightness), ink = skin.ink } }
    end
  end
  return list
end

--- Outline of points on the page: their convex hull, by a monotone chain.
---@param points number[][] { x, y }; sorted by this call
function skin.outline(points)
  table.sort(points, function(p, q) return p[1] < q[1] or p[1] == q[1] and p[2] < q[2] end)
  local function half(from, to, step)
    local chain = {}
    for k = from, to, step do
      local p = points[k]
      while #chain > 1 do
        local o, m = chain[#chain - 1], chain[#chain]
        if (m[1] - o[1]) * (p[2] - o[2]) - (m[2] - o[2]) * (p[1] - o[1]) > 0 then break end
        chain[#chain] = nil
      end
      chain[#chain + 1] = p
    end
    return chain
  end
  local lower, upper = half(1, #points, 1), half(#points, 1, -1)
  for k = 2, #upper - 1 do lower[#lower + 1] = upper[k] end
  return lower
end

return skin
