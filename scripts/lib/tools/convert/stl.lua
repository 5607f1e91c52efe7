--- stl.lua: a surface as binary STL, millimetres: 80 bytes of text, the number of triangles, and
--- for each its normal, three points and two bytes. STL knows no materials.

local bytes = require "limax.tools.convert.bytes"

local stl = {}

-- Bytes of the text at the beginning, which must not be "solid": that is the other kind of STL.
local HEADER = 80

--- The bytes of a file.
---@param mesh limax.convert.mesh mm
---@return string
function stl.encode(mesh)
  local title = "limax robot, millimetres"
  local parts = { title .. ("\0"):rep(HEADER - #title),
    bytes.pack("uint32_t", { #mesh.triangles }) }
  for _, triangle in ipairs(mesh.triangles) do
    local a, b, c = mesh.points[triangle[1]], mesh.points[triangle[2]], mesh.points[triangle[3]]
    local u, v, n = {}, {}, {}
    for k = 1, 3 do u[k], v[k] = b[k] - a[k], c[k] - a[k] end
    for k = 1, 3 do
      local i, j = k % 3 + 1, (k + 1) % 3 + 1
      n[k] = u[i] * v[j] - u[j] * v[i]
    end
    local length = math.sqrt(n[1] ^ 2 + n[2] ^ 2 + n[3] ^ 2)
    parts[#parts + 1] = bytes.pack("float", { n[1] / length, n[2] / length, n[3] / length,
      a[1], a[2], a[3], b[1], b[2], b[3], c[1], c[2], c[3] })
    parts[#parts + 1] = "\0\0"
  end
  return table.concat(parts)
end

return stl
