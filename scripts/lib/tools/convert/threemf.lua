--- threemf.lua: a surface as 3MF: a ZIP archive of an XML model, which names a base material with
--- its colour for each triangle.

local host = require "limax.host"
local palette = require "limax.draw.palette"
local xml = require "limax.tools.convert.xml"

local threemf = {}

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

local function model(mesh, materials)
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
  return xml.HEAD .. xml.element(MODEL,
    xml.element("resources",
      xml.element('basematerials id="1"', unpack(bases)),
      xml.element('object id="2" type="model" name="robot" pid="1" pindex="0"',
        xml.element("mesh", xml.element("vertices", table.concat(vertices, "\n")),
          xml.element("triangles", table.concat(triangles, "\n"))))),
    xml.element("build", '<item objectid="2"/>')) .. "\n"
end

---@param mesh limax.convert.mesh mm
---@param materials table[] of a material table
---@return string bytes of the file
function threemf.encode(mesh, materials)
  return host.zip.pack { { "[Content_Types].xml", TYPES }, { "_rels/.rels", RELATIONSHIPS },
    { "3D/3dmodel.model", model(mesh, materials) } }
end

return threemf
