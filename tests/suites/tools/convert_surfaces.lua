--- convert_surfaces.lua: robots as surfaces: closed whatever touches, and read by programs that are
--- not ours.

local conversion = require "support.conversion"
local limax = require "limax"
local reader = require "support.reader"
local source = require "limax.base.source"
local surface = require "limax.tools.convert.surface"

local suite = require("limax.test").suite "convert_surfaces"

local convert, stage = conversion.convert, conversion.stage

-- Every directed edge once, and its opposite once: closed, and turned outward alike. Points are
-- told apart by their place, as STL does.
local function check_closed(t, mesh)
  local places, edges = {}, {}
  for i, point in ipairs(mesh.points) do places[i] = ("%.6f,%.6f,%.6f"):format(unpack(point)) end
  for _, triangle in ipairs(mesh.triangles) do
    for k = 1, 3 do
      local from, to = places[triangle[k]], places[triangle[k % 3 + 1]]
      t:ok(not edges[from .. " " .. to], "an edge twice: " .. from .. " " .. to)
      edges[from .. " " .. to] = to .. " " .. from
    end
  end
  for edge, opposite in pairs(edges) do t:ok(edges[opposite], "an open edge: " .. edge) end
end

-- Sixths of signed volumes, by the divergence theorem.
local function volume_of(mesh)
  local volume = 0
  for _, triangle in ipairs(mesh.triangles) do
    local a, b, c = mesh.points[triangle[1]], mesh.points[triangle[2]], mesh.points[triangle[3]]
    volume = volume + (a[1] * (b[2] * c[3] - b[3] * c[2]) + a[2] * (b[3] * c[1] - b[1] * c[3])
      + a[3] * (b[1] * c[2] - b[2] * c[1])) / 6
  end
  return volume
end

suite:test("surfaces are closed, whatever touches along edges and at corners", function(t)
  local checked = 0
  local function check(letters, parted)
    local mesh = surface.of(limax.robot({ voxels = letters }).body.voxel)
    check_closed(t, mesh)
    local voxels = select(2, letters:gsub("[ecsb]", ""))
    -- a voxel whose corners are all parted is smaller by PARTED along each of three axes
    t:near(volume_of(mesh), voxels, parted and { rtol = 3 * surface.PARTED } or { rtol = 1e-12 })
    checked = checked + 1
  end
  for pattern = 1, 255 do
    local letters = {}
    for k = 0, 7 do
      letters[k + 1] = bit.band(pattern, bit.lshift(1, k)) ~= 0 and "e" or "."
    end
    check(("%s%s\n%s%s\n\n%s%s\n%s%s"):format(unpack(letters)), true)
  end
  -- both ends of the edge in the middle layer are joined above and below
  check("ee\nee\n\ne.\n.e\n\nee\nee", true)
  check("eee\neee\neee\n\neee\ne.e\neee\n\neee\neee\neee", false)
  -- and porous ones, of many ways around an edge
  for k = 1, 20 do
    local lines = {}
    for z = 1, 5 do
      for y = 1, 5 do
        local line = {}
        for x = 1, 5 do
          local mixed = x * 37 + y * 101 + z * 59 + x * y * z * 7 + k * x * z
          line[x] = bit.band(mixed, 8) > 0 and "e" or "."
        end
        lines[#lines + 1] = table.concat(line)
      end
      lines[#lines + 1] = ""
    end
    check(table.concat(lines, "\n"), true)
  end
  t:equal(checked, 277)
end)

suite:test("STL is watertight to admesh", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.stl", "--edge", "8")
  local text = reader.tool(t, folder, "admesh", "robot.stl")
  t:ok(text:find "Total disconnected facets%s*:%s*0%s+0\n", text)
  t:ok(text:find "Facets reversed%s*:%s*0" and text:find "Normals fixed%s*:%s*0", text)
  t:near(tonumber(text:match "Volume%s*:%s*([%d.]+)"), 12 * 8 ^ 3, { rtol = surface.PARTED })
end)

suite:test("OBJ keeps the materials", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.obj")
  local mesh = surface.of(limax.robot(folder .. "/robot.json").body.voxel)
  local counts, current = {}, nil
  for line in source.read(folder .. "/robot.obj"):gmatch "[^\n]+" do
    current = line:match "^usemtl (.*)" or current
    if line:find "^f " then counts[current] = (counts[current] or 0) + 1 end
  end
  local expected, names = {}, { e = "expanding_muscle", c = "contracting_muscle",
    s = "soft_tissue", b = "bone" }
  for _, letter in ipairs(mesh.letters) do
    expected[names[letter]] = (expected[names[letter]] or 0) + 1
  end
  t:equal(counts, expected)
  local shades = source.read(folder .. "/robot.mtl")
  for _, name in pairs(names) do t:ok(shades:find("newmtl " .. name, 1, true), shades) end
  local text = reader.python(t, folder, { "meshio", meshio = "python3-meshio" }, [==[
import meshio
mesh = meshio.read("robot.obj")
print(len(mesh.points), sum(len(block.data) for block in mesh.cells), mesh.points.max())
]==])
  t:ok(text:find(("^%d %d 150"):format(#mesh.points, #mesh.triangles)), text)
end)

return suite
