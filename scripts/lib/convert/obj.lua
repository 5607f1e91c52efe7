--- obj.lua: a surface as Wavefront OBJ, millimetres, with a colour for each material in the .mtl
--- beside it.

local palette = require "limax.palette"

local obj = {}

-- A name without what ends a word in these files.
local function word(name) return (name:gsub("[^%w_%-]", "_")) end

--- The two texts.
---@param mesh limax.convert.mesh mm
---@param materials table[] as a material table lists them
---@param library string name of the .mtl file
---@return string obj
---@return string mtl
function obj.encode(mesh, materials, library)
  local lines = { "# limax robot, millimetres", "mtllib " .. library, "o robot" }
  for _, p in ipairs(mesh.points) do
    lines[#lines + 1] = ("v %.9g %.9g %.9g"):format(p[1], p[2], p[3])
  end
  local colors, shades = palette.of(materials), { "# limax materials" }
  for _, material in ipairs(materials) do
    local used = false
    for i, triangle in ipairs(mesh.triangles) do
      if mesh.letters[i] == material.letter then
        if not used then lines[#lines + 1] = "usemtl " .. word(material.name) end
        used = true
        lines[#lines + 1] = ("f %d %d %d"):format(triangle[1], triangle[2], triangle[3])
      end
    end
    if used then
      local parts = {}
      for k = 1, 3 do
        local hex = colors[material.letter].hex
        parts[k] = ("%.6g"):format(tonumber(hex:sub(2 * k, 2 * k + 1), 16) / 255)
      end
      shades[#shades + 1] = ("newmtl %s\nKd %s\nd 1\nillum 1"):format(word(material.name),
        table.concat(parts, " "))
    end
  end
  return table.concat(lines, "\n") .. "\n", table.concat(shades, "\n") .. "\n"
end

return obj
