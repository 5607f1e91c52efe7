--- convert_formats.lua: `limax convert` with the formats that it only writes, each read by another
--- program: STL, 3MF, VTK, NumPy and CSV.

local conversion = require "support.conversion"
local evolution = require "support.evolution"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local source = require "limax.base.source"
local surface = require "limax.tools.convert.surface"

local suite = require("limax.test").suite "convert formats"

local convert, refused = conversion.convert, conversion.refused
local python, stage, write = conversion.python, conversion.stage, process.write

-- ---- surfaces -----------------------------------------------------------------------------------

-- Every directed edge occurs once, and so does its opposite: closed, and oriented consistently.
-- Points are compared by place, as in an STL.
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

-- By the divergence theorem.
local function volume_of(mesh)
  local volume = 0
  for _, triangle in ipairs(mesh.triangles) do
    local a, b, c = mesh.points[triangle[1]], mesh.points[triangle[2]], mesh.points[triangle[3]]
    volume = volume + (a[1] * (b[2] * c[3] - b[3] * c[2]) + a[2] * (b[3] * c[1] - b[1] * c[3])
      + a[3] * (b[1] * c[2] - b[2] * c[1])) / 6
  end
  return volume
end

suite:test("surfaces are closed where parts touch along edges and at corners", function(t)
  local function check(letters, rtol)
    local mesh = surface.of(limax.robot({ voxels = letters }).body.voxel)
    check_closed(t, mesh)
    t:near(volume_of(mesh), select(2, letters:gsub("%a", "")), { rtol = rtol })
  end
  -- a voxel whose corners are all separated is smaller by GAP along each of three axes
  local smaller = 3 * surface.GAP
  for pattern = 1, 255 do
    local letters = {}
    for k = 0, 7 do
      letters[k + 1] = bit.band(pattern, bit.lshift(1, k)) ~= 0 and "e" or "."
    end
    check(("%s%s\n%s%s\n\n%s%s\n%s%s"):format(unpack(letters)), smaller)
  end
  -- both ends of the edge in the middle layer are joined above and below
  check("ee\nee\n\ne.\n.e\n\nee\nee", smaller)
  check("eee\neee\neee\n\neee\ne.e\neee\n\neee\neee\neee", 1e-12)
  for k = 1, 20 do -- porous bodies
    local voxels = ("....."):rep(5, "\n")
    voxels = voxels:rep(5, "\n\n")
    local random = limax.engine.random(k, 1, "user", 0, 0)
    check((voxels:gsub("%.", function() return random:uniform() < 0.5 and "e" or "." end)), smaller)
  end
end)

suite:test("an STL is reported with its size, and a wrong unit is noticed", function(t)
  local folder = stage(t)
  for _, case in ipairs { { "0.15 x 0.1 x 0.15 m\n" }, { "0.024 x 0.016 x 0.024 m\n", "8" },
    { "0.0003 x 0.0002 x 0.0003 m\n", "0.1", "is 0.0003 m, expected 0.001 to 100 m: its voxels"
      .. " have edges of 0.1 mm; --edge MM sets them" },
    { "150 x 100 x 150 m\n", "5e4", "longest side of the robot is 150 m" } } do
    local size, edge, warning = unpack(case, 1, 3)
    local words = { "convert", "robot.json", "r.stl", "--force", edge and "--edge=" .. edge }
    local done = process.completes(t, folder, words)
    t:ok(done.stdout:find(size, 1, true), done.stdout)
    t:equal(select(2, done.stdout:gsub("\n", "")), 1)
    t:equal(done.stderr:find("! r.stl: ", 1, true) ~= nil, warning ~= nil)
    t:ok(done.stderr:find(warning or "", 1, true), done.stderr)
  end
end)

suite:test("3MF keeps materials and names", function(t)
  local folder = stage(t)
  local robot = host.json.decode(source.read(folder .. "/robot.json"))
  for k, name in ipairs { "a b", "a_b", '<x y="1">&' } do
    robot.materials.materials[k + 1].name = name
  end
  write(folder .. "/robot.json", host.json.encode(robot))
  convert(t, folder, "robot.json", "robot.3mf", "--edge", "8")
  python(t, folder, {}, [==[
import xml.etree.ElementTree as tree, zipfile
archive = zipfile.ZipFile("robot.3mf")
assert archive.testzip() is None
assert sorted(archive.namelist()) == ["3D/3dmodel.model", "[Content_Types].xml", "_rels/.rels"]
name = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
model = tree.fromstring(archive.read("3D/3dmodel.model"))
assert model.get("unit") == "millimeter"
assert tree.fromstring(archive.read("_rels/.rels"))[0].get("Target") == "/3D/3dmodel.model"
bases = [base.get("name") for base in model.iter(name + "base")]
assert bases == ["a b", "a_b", '<x y="1">&', "bone"]
points = len(list(model.iter(name + "vertex")))
triangles = list(model.iter(name + "triangle"))
assert all(int(each.get(v)) < points for each in triangles for v in ("v1", "v2", "v3"))
assert {int(each.get("p1")) for each in triangles} == {0, 1, 2, 3}
]==])
end)

-- ---- VTK and NumPy ------------------------------------------------------------------------------

suite:test("a body at rest is a grid of cubes to meshio", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.vtu")
  python(t, folder, { "meshio" }, [==[
import json, meshio, numpy
robot, mesh = json.load(open("robot.json")), meshio.read("robot.vtu")
cells, = mesh.cells
assert cells.type == "hexahedron" and cells.data.shape == (12, 8)
lattice = [(x, y, z, letter) for z, layer in enumerate(robot["voxels"])
           for y, line in enumerate(layer) for x, letter in enumerate(line) if letter != "."]
letters = [m["letter"] for m in robot["materials"]["materials"]]
for i, (x, y, z, letter) in enumerate(lattice):
    corners = mesh.points[cells.data[i]]
    assert numpy.allclose(corners.mean(0), (numpy.array([x, y, z]) + 0.5) * 0.05)
    # VTK's order: each corner's neighbours along the three axes make a right-handed cube
    a, b, d = corners[1] - corners[0], corners[3] - corners[0], corners[4] - corners[0]
    assert abs(numpy.dot(numpy.cross(a, b), d) / 0.05**3 - 1) < 1e-6
    assert mesh.cell_data["material"][0][i] == letters.index(letter)
    weight = robot["weights"]["stiffness"][z][y][x]
    assert abs(mesh.cell_data["stiffness_weight"][0][i] - weight) < 1e-6
assert abs(mesh.cell_data["strain"][0]).max() < 1e-6
]==])
end)

suite:test("a simulated robot is a series of grids at the positions of its trace", function(t)
  local folder = stage(t)
  limax.robot(folder .. "/robot.json"):simulate({ duration = 0.2, settle = 0.05,
    record = { center_of_mass = 50 } }):save(folder .. "/walk.json")
  local done = process.completes(t, folder, { "convert", "walk.json", 'a & "b".pvd' })
  t:ok(done.stdout:find('^a & "b"%.pvd: %d+ bytes in 12 files, also a & "b"_0000%.vtu to '
    .. 'a & "b"_0010%.vtu\n$'), done.stdout)
  -- the same rates, hence the time step that the robot was scored with
  convert(t, folder, "walk.json", "walk.npz", "--record", "center_of_mass=50", "--record",
    "position=50")
  convert(t, folder, "walk.json", "own.npz")
  python(t, folder, { "meshio", "numpy" }, [==[
import meshio, numpy, xml.etree.ElementTree as tree
trace = numpy.load("walk.npz")
assert (numpy.load("own.npz")["center_of_mass"] == trace["center_of_mass"]).all()
sets = list(tree.parse('a & "b".pvd').getroot().iter("DataSet"))
assert len(sets) == 11 == len(trace["position"])
for i, each in enumerate(sets):
    mesh = meshio.read(each.get("file"))
    assert numpy.allclose(mesh.points, trace["position"][i], rtol=1e-8, atol=1e-9)
    assert float(each.get("timestep")) == trace["position_time"][i]
assert 0 < mesh.cell_data["strain"][0].max() < 1
]==])
end)

suite:test("traces, body and weights are arrays to NumPy", function(t)
  local folder = stage(t)
  local walked = limax.robot(folder .. "/robot.json"):simulate { duration = 0.2, settle = 0.05,
    device = "cpu", record = { center_of_mass = 50, contact = 20 } }
  walked:save(folder .. "/walk.json")
  write(folder .. "/expected.json", host.json.encode {
    center = walked:trace("center_of_mass"):table(), contact = walked:trace("contact"):table(),
    voxels = walked.context.population:voxels(1):table() })
  convert(t, folder, "walk.json", "walk.npz")
  convert(t, folder, "walk.json", "energy.npz", "--record", "energy=100", "--record=strain=20")
  python(t, folder, { "numpy" }, [==[
import json, numpy
expected, arrays = json.load(open("expected.json")), numpy.load("walk.npz")
assert (arrays["center_of_mass"] == numpy.array(expected["center"])).all()
assert (arrays["contact"] == numpy.array(expected["contact"])).all()
assert numpy.allclose(arrays["center_of_mass_time"], numpy.arange(11) / 50)
assert (arrays["voxels"] == numpy.array(expected["voxels"])).all()
assert arrays["voxels"].shape == arrays["phase"].shape == (3, 2, 3)
assert arrays["amplitude"].dtype == "float32" and (arrays["amplitude"] == 0.75).all()
assert len(set(arrays["sites"])) == len(arrays["sites"])
arrays = numpy.load("energy.npz")
assert arrays["energy"].shape == (21, 4) and arrays["strain"].shape == (5, 2)
assert "center_of_mass" not in arrays
]==])
end)

-- ---- runs ---------------------------------------------------------------------------------------

local function run(t)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua", "repetitions = 2, simulation = { duration = 0.1 }")
  process.completes(t, folder, { "run", "-q", "try.lua", "--out", "run" })
  return folder
end

suite:test("a run folder is read as its champion", function(t)
  local folder = run(t)
  convert(t, folder, "run", "last.vxa")
  convert(t, folder, "run/r01/champions/g0002.json", "same.vxa")
  t:equal(source.read(folder .. "/last.vxa"), source.read(folder .. "/same.vxa"))
  convert(t, folder, "run", "first.json", "--repetition", "2", "--generation", "0")
  local first = host.json.decode(source.read(folder .. "/first.json"))
  t:equal(first.voxels,
    host.json.decode(source.read(folder .. "/run/r02/champions/g0000.json")).voxels)
  refused(t, folder, { "run", "x.stl", "--generation", "3" }, "expected 0 to 2")
  refused(t, folder, { "run", "x.stl", "--repetition", "3" }, "repetition 3 has no champion")
end)

-- ---- losses -------------------------------------------------------------------------------------

suite:test("every format lists what it loses of a simulated robot", function(t)
  local folder = stage(t)
  limax.robot(folder .. "/robot.json"):simulate({ duration = 0.1, settle = 0,
    scene = { gravity = true, friction = true, planes = true, actuation = true } })
    :save(folder .. "/walk.json")
  for ending, expected in pairs {
    json = "^$", stl = "^weights\nmaterials.*\nscene, simulation, outcome",
    vtu = "^materials.*\nscene, simulation, outcome",
    npz = "^materials.*\nscene, simulation, outcome",
    vxa = "scene.friction.*scene.planes.*weights.stiffness.*weights.amplitude.*\noutcome, id",
    vxd = "weights.amplitude.*\nmaterials and scene.*\nsimulation, outcome",
  } do
    local notes = table.concat(convert(t, folder, "walk.json", "w." .. ending), "\n")
    t:ok(notes:find(expected), ("%s: %s"):format(ending, notes))
  end
end)
