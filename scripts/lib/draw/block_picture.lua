--- block_picture.lua: the rigid blocks of a scene for figures: their corners in the world, m, and
--- their sides. Corners count from 1 by their bits, x lowest.

local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"

local block_picture = {}

--- A block's name in a legend, and its colour.
block_picture.letter, block_picture.hex = "block", "#b98b4f"

--- The eight corners of a block with edges `size`, m, at a sample of the trace "block".
---@param sample number[] centre, m, and quaternion w, x, y, z
---@param size number[]
---@return number[][]
function block_picture.corners(sample, size)
  local w, x, y, z = sample[4], sample[5], sample[6], sample[7]
  local columns = {
    { 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y) },
    { 2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x) },
    { 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y) },
  }
  local corners = {}
  for corner = 0, 7 do
    local point = { sample[1], sample[2], sample[3] }
    for axis = 1, 3 do
      local half = (math.floor(corner / 2 ^ (axis - 1)) % 2 - 0.5) * size[axis]
      for k = 1, 3 do point[k] = point[k] + half * columns[axis][k] end
    end
    corners[corner + 1] = point
  end
  return corners
end

--- The corners of each block of a scene, if any, at a sample of its trace "block".
---@param scene table its effects
---@return number[][][]
function block_picture.all(scene, trace, sample)
  local blocks, list = scene.block or {}, {}
  for k, block in ipairs(blocks) do
    local row = trace[sample]:table()
    list[k] = block_picture.corners(blocks[2] and row[k] or row, block.size)
  end
  return list
end

--- Its sides, as faces of a skin whose corners follow `before` other points.
---@return { corners: integer[], letter: string }[]
function block_picture.faces(before)
  local mass_at = {}
  for site = 0, 7 do mass_at[site] = before + site + 1 end
  return skin.faces({ { { block_picture.letter } } }, mass_at)
end

--- The half-spaces whose common part is a block.
---@param corners number[][] eight, as corners() gives them, m
function block_picture.spaces(corners)
  local spaces = {}
  for k, face in ipairs(block_picture.faces(0)) do
    local points = {}
    for c, corner in ipairs(face.corners) do points[c] = corners[corner] end
    local normal = polygon.unit(polygon.quad_normal(points))
    spaces[k] = { normal = normal, offset = polygon.dot(normal, points[1]) }
  end
  return spaces
end

return block_picture
