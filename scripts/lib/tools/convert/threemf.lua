--- threemf.lua: a surface as 3MF, the format of printers of several materials: a ZIP of an XML
--- model with a base material, by name and colour, for each triangle. Millimetres.

local host = require "limax.host"
local palette = require "limax.draw.palette"
local xml = require "limax.tools.convert.xml"

local threemf = {}

local HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'

-- What every 3MF package says of itself: the kinds of its parts, and which of them is the model.
local TYPES = HEAD .. [[
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
]]
local RELATIONSHIPS = HEAD .. [[
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0"
 Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
]]
local CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"

local function model(mesh, materials)
  local lines = { HEAD .. '<model unit="millimeter" xml:lang="en-US" xmlns="' .. CORE .. '">',
    "<resources>", '<basematerials id="1">' }
  local colors, index = palette.of(materials), {}
  local count = 0
  for _, material in ipairs(materials) do
    if material.kind ~= "empty" then
      index[material.letter], count = count, count + 1
      lines[#lines + 1] = ('<base name="%s" displaycolor="%sFF"/>')
        :format(xml.escaped(material.name), colors[material.letter].hex:upper())
    end
  end
  lines[#lines + 1] = "</basematerials>"
  lines[#lines + 1] = '<object id="2" type="model" name="robot" pid="1" pindex="0">\n<mesh>'
  lines[#lines + 1] = "<vertices>"
  for _, p in ipairs(mesh.points) do
    lines[#lines + 1] = ('<vertex x="%.9g" y="%.9g" z="%.9g"/>'):format(p[1], p[2], p[3])
  end
  lines[#lines + 1] = "</vertices>\n<triangles>"
  for i, triangle in ipairs(mesh.triangles) do
    lines[#lines + 1] = ('<triangle v1="%d" v2="%d" v3="%d" pid="1" p1="%d"/>'):format(
      triangle[1] - 1, triangle[2] - 1, triangle[3] - 1, index[mesh.letters[i]])
  end
  lines[#lines + 1] = "</triangles>\n</mesh>\n</object>\n</resources>"
  lines[#lines + 1] = '<build>\n<item objectid="2"/>\n</build>\n</model>\n'
  return table.concat(lines, "\n")
end

--- The bytes of a file.
---@param mesh limax.convert.mesh mm
---@param materials table[] as a material table lists them
---@return string
function threemf.encode(mesh, materials)
  return host.zip.pack { { "[Content_Types].xml", TYPES }, { "_rels/.rels", RELATIONSHIPS },
    { "3D/3dmodel.model", model(mesh, materials) } }
end

return threemf
