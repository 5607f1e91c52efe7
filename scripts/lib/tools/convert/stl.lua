--- stl.lua: a surface as binary STL: 80 bytes of text, the number of triangles, and for each its
--- normal, three points and two bytes.

local bytes = require "limax.base.bytes"

local stl = {}

local HEADER_BYTES = 80
-- must not begin with "solid", which marks a text STL
local TITLE = "limax robot, millimetres"

-- The unit normal of a triangle.
local function normal_of(a, b, c)
  local n, length = {}, 0
  for k = 1, 3 do
    local i, j = k % 3 + 1, (k + 1) % 3 + 1
    n[k] = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i])
    length = length + n[k] ^ 2
  end
  length = math.sqrt(length)
  return n[1] / length, n[2] / length, n[3] / length
end

---@param mesh limax.convert.mesh mm
---@return string bytes of the file
function stl.encode(mesh)
  local parts = { TITLE .. ("\0"):rep(HEADER_BYTES - #TITLE),
    bytes.pack("uint32_t", { #mesh.triangles }) }
  for _, triangle in ipairs(mesh.triangles) do
    local a, b, c = mesh.points[triangle[1]], mesh.points[triangle[2]], mesh.points[triangle[3]]
    local x, y, z = normal_of(a, b, c)
    parts[#parts + 1] = bytes.pack("float", { x, y, z, a[1], a[2], a[3], b[1], b[2], b[3],
      c[1], c[2], c[3] })
    parts[#parts + 1] = "\0\0"
  end
  return table.concat(parts)
end

return stl
