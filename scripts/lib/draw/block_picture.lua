--- block_picture.lua: the rigid block of a scene for figures: its corners in the world, m, and its
--- sides. Corners count from 1 by their bits, x lowest.

local block_picture = {}

--- The block's name in a legend, and its colour.
block_picture.letter, block_picture.hex = "block", "#b98b4f"

-- Corners of the six sides, counter-clockwise seen from outside.
local sides = {
  { 2, 4, 8, 6 }, { 1, 5, 7, 3 }, { 3, 7, 8, 4 }, { 1, 2, 6, 5 }, { 5, 6, 8, 7 }, { 1, 3, 4, 2 },
}

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

--- The half-spaces whose common part is a block.
---@param corners number[][] eight, as corners() gives them, m
---@return limax.picture.space[]
function block_picture.spaces(corners)
  local spaces = {}
  for axis = 1, 3 do
    local from, to, length = corners[1], corners[1 + 2 ^ (axis - 1)], 0
    local normal, low, high = {}, 0, 0
    for c = 1, 3 do length = length + (to[c] - from[c]) ^ 2 end
    for c = 1, 3 do
      normal[c] = (to[c] - from[c]) / math.sqrt(length)
      low, high = low + normal[c] * from[c], high + normal[c] * to[c]
    end
    spaces[2 * axis - 1] = { normal = normal, offset = high }
    spaces[2 * axis] = { normal = { -normal[1], -normal[2], -normal[3] }, offset = -low }
  end
  return spaces
end

--- Its sides, as faces of a skin whose corners follow `before` other points.
---@return { corners: integer[], letter: string }[]
function block_picture.faces(before)
  local faces = {}
  for i, side in ipairs(sides) do
    local corners = {}
    for k, corner in ipairs(side) do corners[k] = before + corner end
    faces[i] = { corners = corners, letter = block_picture.letter }
  end
  return faces
end

return block_picture
