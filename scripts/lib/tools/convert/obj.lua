--- obj.lua: a surface as Wavefront OBJ, millimetres, with a colour for each material in the .mtl
--- beside it.

local palette = require "limax.draw.palette"

local obj = {}

-- A name for each material, by letter, without what ends a word in these files.
local function words_of(materials)
  local words, taken = {}, {}
  for _, material in ipairs(materials) do
    local word = material.name:gsub("[^%w_%-]", "_")
    local free, n = word, 1
    while taken[free] do
      n = n + 1
      free = ("%s_%d"):format(word, n)
    end
    words[material.letter], taken[free] = free, true
  end
  return words
end

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
  local colors, words = palette.of(materials), words_of(materials)
  local shades = { "# limax materials" }
  for _, material in ipairs(materials) do
    local used = false
    for i, triangle in ipairs(mesh.triangles) do
      if mesh.letters[i] == material.letter then
        if not used then lines[#lines + 1] = "usemtl " .. words[material.letter] end
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
      shades[#shades + 1] = ("newmtl %s\nKd %s\nd 1\nillum 1"):format(words[material.letter],
        table.concat(parts, " "))
    end
  end
  return table.concat(lines, "\n") .. "\n", table.concat(shades, "\n") .. "\n"
end

return obj
