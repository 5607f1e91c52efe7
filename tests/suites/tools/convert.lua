--- convert.lua: `limax convert` with the formats that it reads: VoxCad and EvoGym. Other programs
--- read what it writes, a robot survives the round trip, and bad files end with one line.

local conversion = require "support.conversion"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "convert"

local convert, refused = conversion.convert, conversion.refused
local python, stage, write = conversion.python, conversion.stage, process.write

local function read_json(path) return host.json.decode(assert(source.read(path))) end

-- ---- VoxCad -------------------------------------------------------------------------------------

suite:test("a robot survives the round trip through .vxa", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.vxa")
  t:equal(convert(t, folder, "robot.vxa", "back.json"),
    { "Simulator: all but a StopConditionFormula t - seconds" })
  local before, after = read_json(folder .. "/robot.json"), read_json(folder .. "/back.json")
  for _, field in ipairs { "lattice", "edge", "voxels", "weights" } do
    t:same_bits(after[field], before[field])
  end
  t:equal(after.materials.materials, before.materials.materials)
end)

suite:test("other programs find voxels, phases and materials in a .vxa", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.vxa")
  convert(t, folder, "robot.json", "robot.vxd")
  python(t, folder, {}, [==[
import json, xml.etree.ElementTree as tree
robot = json.load(open("robot.json"))
root = tree.parse("robot.vxa").getroot()
structure = root.find("VXC/Structure")
vxd = tree.parse("robot.vxd").getroot().find("Structure")
assert vxd.get("replace") == "VXA.VXC.Structure"
for name in "Data", "PhaseOffset":
    assert [e.text for e in vxd.find(name)] == [e.text for e in structure.find(name)]
nx, ny, nz = (int(structure.find(n + "_Voxels").text) for n in "XYZ")
assert [nx, ny, nz] == robot["lattice"]
letters = [m["letter"] for m in robot["materials"]["materials"]]
for z, layer in enumerate(structure.find("Data")):
    assert layer.text == "".join(str(letters.index(c)) for line in robot["voxels"][z] for c in line)
for z, layer in enumerate(structure.find("PhaseOffset")):
    read = [float(word) for word in layer.text.split(",")]
    flat = [p / 2 for line in robot["weights"]["phase"][z] for p in line]
    assert all(abs(a - b) < 1e-9 for a, b in zip(read, flat)) and len(read) == nx * ny
materials = root.findall("VXC/Palette/Material")
value = lambda m, n: float(m.find("Mechanical/" + n).text)
assert [value(m, "CTE") for m in materials] == [0.25, -0.25, 0, 0]
assert abs(value(materials[3], "Elastic_Mod") - 2.7 * 1e4 / 0.05) < 1e-6
assert abs(value(materials[0], "Density") - 0.1 / 0.05 ** 3) < 1e-9
assert float(root.find("Environment/Thermal/TempPeriod").text) == 0.5
]==])
end)

local VOXCAD = [==[
<?xml version="1.0" encoding="ISO-8859-1"?>
<VXA Version="1.0">
<Environment>
<Gravity><GravEnabled>1</GravEnabled><GravAcc>-9.81</GravAcc><FloorEnabled>1</FloorEnabled>
</Gravity>
<Thermal><TempEnabled>1</TempEnabled><TempAmp>39</TempAmp><TempBase>25</TempBase>
<VaryTempEnabled>1</VaryTempEnabled><TempPeriod>0.25</TempPeriod></Thermal>
</Environment>
<VXC Version="0.93">
<Lattice><Lattice_Dim>0.01</Lattice_Dim></Lattice>
<Palette>
<Material ID="1"><Name>Active</Name><Mechanical><Elastic_Mod>5e+6</Elastic_Mod>
<Density>1e+6</Density><Poissons_Ratio>0.35</Poissons_Ratio><CTE>0.01</CTE><uStatic>1</uStatic>
<uDynamic>0.5</uDynamic></Mechanical></Material>
<Material ID="2"><Name>Passive &lt;b&gt;</Name><Mechanical><Elastic_Mod>5e+7</Elastic_Mod>
<Density>1e+6</Density><CTE>0</CTE><uStatic>1</uStatic><uDynamic>0.5</uDynamic></Mechanical>
</Material>
</Palette>
<Structure Compression="ASCII_READABLE">
<X_Voxels>2</X_Voxels><Y_Voxels>2</Y_Voxels><Z_Voxels>1</Z_Voxels>
<Data><Layer><![CDATA[1120]]></Layer></Data>
<PhaseOffset><Layer><![CDATA[0.25, -0.25, 0.9, 0, ]]></Layer></PhaseOffset>
<Stiffness><Layer><![CDATA[1, 2, 3, 4]]></Layer></Stiffness>
</Structure>
</VXC>
</VXA>
]==]

suite:test("a robot of VoxCad's own, with phases beyond half a period", function(t)
  local folder = t:folder()
  write(folder .. "/v.vxa", (VOXCAD:gsub("Active", "\233t\233 \27[31m")))
  t:equal(convert(t, folder, "v.vxa", "v.json")[1], "Structure.Stiffness")
  local robot = read_json(folder .. "/v.json")
  -- sin(a - pi / 2) = -sin(a + pi / 2): the second voxel is the opposite muscle
  t:equal(robot.voxels, { { "ec", "s." } })
  t:near(robot.weights.phase[1][1], { 0.5, 0.5 }, { rtol = 1e-7 })
  local by_letter = {}
  for _, material in ipairs(robot.materials.materials) do by_letter[material.letter] = material end
  t:near(by_letter.e.amplitude, 0.14)
  t:near(by_letter.e.stiffness, 5e6 * 0.01 / 2.7, { rtol = 1e-11 })
  t:equal({ by_letter.c.kind, by_letter.c.stiffness }, { "contracting", by_letter.e.stiffness })
  -- the file's encoding is not UTF-8
  t:equal({ by_letter.e.name, by_letter.s.name }, { "_t_ _[31m", "Passive <b>" })
  t:near(robot.scene.actuation.frequency, 4)
  t:equal(robot.scene.friction, { static = 1, kinetic = 0.5 })
  t:ok(limax.robot(folder .. "/v.json"):simulate({ duration = 0.1 }).status == "done")
end)

suite:test("a bad .vxa is refused with its file and field", function(t)
  local folder = t:folder()
  local function bad(from, to, ...)
    local text, count = VOXCAD:gsub(from, (to:gsub("%%", "%%%%")))
    t:ok(count > 0, from)
    write(folder .. "/bad.vxa", text)
    refused(t, folder, { "bad.vxa", "out.json" }, "limax: bad.vxa: ", ...)
  end
  bad("1120", "1130", "Structure.Data: layer 1, voxel 3 is 3; expected 0 (empty) to 2")
  bad("<Z_Voxels>1", "<Z_Voxels>2", "Structure.Data has 1 layers; Z_Voxels is 2")
  bad("<X_Voxels>2", "<X_Voxels>1e9", "at most 1000000 are read")
  bad("ASCII_READABLE", "ZLIB", 'Compression is "ZLIB"; expected "ASCII_READABLE"')
  bad("5e%+6", "5e+16", 'material 2 "Active": stiffness is 1.85185', "1 to 10000000 N/m")
  bad("0.25, %-0.25", "0.25, x", 'layer 1 holds "x"; expected numbers')
  bad("<uStatic>1", "<uStatic>-1", "friction.static: expected a number from 0 to 1000, got -1")
  bad("1120", "0000", "the body is empty")
  bad('%?>', '?>\n<!DOCTYPE VXA [<!ENTITY a "b">]>', "declares a document type, which is refused")
end)

-- ---- EvoGym -------------------------------------------------------------------------------------

suite:test("EvoGym's robots, as NumPy writes them, are one voxel thick", function(t)
  local folder = t:folder()
  python(t, folder, { "numpy" }, [==[
import numpy
body = numpy.array([[3, 3, 4], [1, 0, 2], [5, 0, 4]])
joined = numpy.array([[0, 1, 0, 2, 3, 5], [1, 2, 3, 5, 6, 8]])
numpy.savez("ga.npz", body, joined)
numpy.savez_compressed("named.npz", body=body.astype("float64"))
numpy.save("body.npy", body.astype("int8"))
]==])
  for _, name in ipairs { "ga.npz", "named.npz", "body.npy" } do
    local out = name:gsub("%.", "_") .. ".json"
    local notes = table.concat(convert(t, folder, name, out), "\n")
    local robot = limax.robot(folder .. "/" .. out)
    t:equal(robot.body.letters, "b.c\n\nb.s\n\neec")
    t:equal(robot.description.lattice, { 3, 1, 3 })
    t:ok(notes:find "actuators: " and notes:find "fixed voxels: ", notes)
    t:equal(notes:find "connections: " ~= nil, name == "ga.npz")
  end
  t:ok(limax.robot(folder .. "/ga_npz.json"):simulate({ duration = 0.1 }).status == "done")
end)

suite:test("bad arrays are refused", function(t)
  local folder = t:folder()
  python(t, folder, { "numpy" }, [==[
import numpy, zipfile
numpy.save("objects.npy", numpy.array([{"a": 1}], dtype=object), allow_pickle=True)
numpy.save("kind.npy", numpy.array([[1, 7]]))
numpy.save("big.npy", numpy.array([[1, 2]], dtype=">i4"))
numpy.savez("none.npz", other=numpy.array([[1]]))
good = open("kind.npy", "rb").read()
open("cut.npy", "wb").write(good[:-3])
open("promise.npy", "wb").write(good.replace(b"(1, 2), }        ", b"(99999, 99999), }"))
with zipfile.ZipFile("bomb.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
    for k in range(3): archive.writestr("arr_%d.npy" % k, bytes(100 << 20))
open("text.npz", "w").write("no archive")
]==])
  for _, each in ipairs {
    { "objects.npy", "expected bool, int, uint or float" },
    { "kind.npy", "row 1, column 2 is 7; expected a whole number from 0 to 5" },
    { "big.npy", 'elements of type ">i4"' },
    { "none.npz", 'has no array "body", "structure" or "arr_0"' },
    { "cut.npy", "holds 13 bytes; its header states 2 numbers" },
    { "promise.npy", "its header states 9.9998e+09 numbers" },
    { "bomb.npz", "more than 268435456 bytes when unpacked" },
    { "text.npz", "Not a zip archive" },
  } do
    refused(t, folder, { each[1], "out.json" }, "limax: " .. each[1] .. ": ", each[2])
  end
end)

-- ---- the command --------------------------------------------------------------------------------

suite:test("nothing is overwritten without --force", function(t)
  local folder = stage(t)
  write(folder .. "/robot.stl", "mine")
  local ended = process.ends(folder, { "convert", "robot.json", "robot.stl" })
  t:equal({ ended.status, ended.stderr },
    { 2, "limax: robot.stl exists already; --force overwrites it\n" })
  t:equal(source.read(folder .. "/robot.stl"), "mine")
  convert(t, folder, "robot.json", "robot.stl", "--force")
  t:ok(source.read(folder .. "/robot.stl") ~= "mine")
end)

suite:test("unknown endings, missing files and options that do not apply are refused", function(t)
  local folder = stage(t)
  local robot = read_json(folder .. "/robot.json")
  robot.scene = { gravty = true }
  write(folder .. "/scene.json", host.json.encode(robot))
  robot.scene, robot.simulation = nil, { duration = -1 }
  write(folder .. "/time.json", host.json.encode(robot))
  write(folder .. "/odd.json", '{"schema": "limax.robot/1"}')
  for _, each in ipairs {
    { { "robot.json", "robot.slt" }, 'names no format; did you mean ".stl"?' },
    { { "odd.json", "robot.stl" }, "odd.json: robot.", "is missing" },
    { { "scene.json", "r.stl" }, 'scene.json: robot.scene.gravty: unknown field' },
    { { "time.json", "r.stl" }, "time.json: robot.simulation.duration: expected", "got -1" },
    { { "robot.json", "r.vtu", "--edge", "8" }, "--edge is for a .stl or .3mf" },
    { { "robot.json", "r.stl", "--generation", "3" }, "--generation is for the champion of a run" },
    { { "robot.vxd", "r.json" }, "its ending names no format; expected" },
    { { "robot.json", "r.npz", "--record", "postion=20" }, 'did you mean "position"?' },
    { { "robot.json", "r.pvd", "--record", "energy=20" }, "needs position=HZ" },
  } do
    refused(t, folder, unpack(each))
  end
end)
