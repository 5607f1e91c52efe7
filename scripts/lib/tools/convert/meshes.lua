--- meshes.lua: a surface in millimetres as binary STL, and as 3MF with a material for each
--- triangle.

local bytes = require "limax.base.bytes"
local host = require "limax.host"
local palette = require "limax.draw.palette"
local xml = require "limax.tools.convert.xml"

local meshes = {}

-- 80 bytes that must not begin with "solid", which marks a text STL.
local TITLE = "limax robot, millimetres" .. ("\0"):rep(56)

local function unit_normal(a, b, c)
  local n, length = {}, 0
  for k = 1, 3 do
    local i, j = k % 3 + 1, (k + 1) % 3 + 1
    n[k] = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i])
    length = length + n[k] ^ 2
  end
  length = math.sqrt(length)
  return n[1] / length, n[2] / length, n[3] / length
end

--- The title, the number of triangles, and for each its normal, three points and two bytes.
function meshes.stl(mesh)
  local parts = { TITLE, bytes.pack("uint32_t", { #mesh.triangles }) }
  for _, triangle in ipairs(mesh.triangles) do
    local a, b, c = mesh.points[triangle[1]], mesh.points[triangle[2]], mesh.points[triangle[3]]
    local x, y, z = unit_normal(a, b, c)
    parts[#parts + 1] = bytes.pack("float", { x, y, z, a[1], a[2], a[3], b[1], b[2], b[3],
      c[1], c[2], c[3] }) .. "\0\0"
  end
  return table.concat(parts)
end

-- The constant parts of a package: content types, and the path of the model.
local TYPES = xml.HEAD .. [[
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
]]
local RELATIONSHIPS = xml.HEAD .. [[
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0"
 Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
]]
local MODEL = 'model unit="millimeter" xml:lang="en-US"'
  .. ' xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'

--- A ZIP archive of an XML model.
function meshes.threemf(mesh, materials)
  local bases, vertices, triangles = {}, {}, {}
  local colors, index = palette.of(materials), {}
  for _, material in ipairs(materials) do
    if material.kind ~= "empty" then
      index[material.letter] = #bases
      bases[#bases + 1] = ('<base name="%s" displaycolor="%sFF"/>'):format(
        xml.escaped(material.name), colors[material.letter].hex:upper())
    end
  end
  for i, p in ipairs(mesh.points) do
    vertices[i] = ('<vertex x="%.9g" y="%.9g" z="%.9g"/>'):format(p[1], p[2], p[3])
  end
  for i, t in ipairs(mesh.triangles) do
    triangles[i] = ('<triangle v1="%d" v2="%d" v3="%d" pid="1" p1="%d"/>'):format(t[1] - 1,
      t[2] - 1, t[3] - 1, index[mesh.letters[i]])
  end
  local model = xml.HEAD .. xml.element(MODEL,
    xml.element("resources",
      xml.element('basematerials id="1"', unpack(bases)),
      xml.element('object id="2" type="model" name="robot" pid="1" pindex="0"',
        xml.element("mesh", xml.element("vertices", table.concat(vertices, "\n")),
          xml.element("triangles", table.concat(triangles, "\n"))))),
    xml.element("build", '<item objectid="2"/>')) .. "\n"
  return host.zip.pack { { "[Content_Types].xml", TYPES }, { "_rels/.rels", RELATIONSHIPS },
    { "3D/3dmodel.model", model } }
end

return meshes
