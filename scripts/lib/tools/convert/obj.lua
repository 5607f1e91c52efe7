--- obj.lua: a surface as Wavefront OBJ, with the materials' colours in a .mtl file beside it.

local palette = require "limax.draw.palette"

local obj = {}

-- A name for each material, by letter: unique, and without characters that end a name.
local function names_of(materials)
  local names, taken = {}, {}
  for _, material in ipairs(materials) do
    local base = material.name:gsub("[^%w_%-]", "_")
    local name, n = base, 1
    while taken[name] do
      n = n + 1
      name = ("%s_%d"):format(base, n)
    end
    names[material.letter], taken[name] = name, true
  end
  return names
end

---@param mesh limax.convert.mesh mm
---@param materials table[] of a material table
---@param library string name of the .mtl file
---@return string obj
---@return string mtl
function obj.encode(mesh, materials, library)
  local lines = { "# limax robot, millimetres", "mtllib " .. library, "o robot" }
  for _, p in ipairs(mesh.points) do
    lines[#lines + 1] = ("v %.9g %.9g %.9g"):format(p[1], p[2], p[3])
  end
  local colors, names, faces = palette.of(materials), names_of(materials), {}
  for i, triangle in ipairs(mesh.triangles) do
    local letter = mesh.letters[i]
    faces[letter] = faces[letter] or {}
    table.insert(faces[letter], ("f %d %d %d"):format(unpack(triangle)))
  end
  local shades = { "# limax materials" }
  for _, material in ipairs(materials) do
    local letter = material.letter
    if faces[letter] then
      lines[#lines + 1] = ("usemtl %s\n%s"):format(names[letter], table.concat(faces[letter], "\n"))
      local rgb = {}
      for hex in colors[letter].hex:gmatch "%x%x" do
        rgb[#rgb + 1] = ("%.6g"):format(tonumber(hex, 16) / 255)
      end
      shades[#shades + 1] = ("newmtl %s\nKd %s\nd 1\nillum 1"):format(names[letter],
        table.concat(rgb, " "))
    end
  end
  return table.concat(lines, "\n") .. "\n", table.concat(shades, "\n") .. "\n"
end

return obj
