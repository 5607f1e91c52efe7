--- convert.lua: `limax convert`, robots from and to VoxCad: what it writes is read by programs that
--- are not ours, what it reads comes back as it was, and bad or hostile files are refused in one
--- line.

local conversion = require "support.conversion"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local reader = require "support.reader"
local source = require "limax.base.source"
local voxcad = require "limax.tools.convert.voxcad"

local suite = require("limax.test").suite "convert"

local convert, refused = conversion.convert, conversion.refused
local stage, write = conversion.stage, conversion.write

-- ---- VoxCad -------------------------------------------------------------------------------------

suite:test("a robot comes back from .vxa and .vxd as it was", function(t)
  local folder = stage(t)
  local notes = convert(t, folder, "robot.json", "base.vxa").stderr
  t:ok(notes:find("! not carried: weights.stiffness: read back by limax alone", 1, true), notes)
  convert(t, folder, "base.vxa", "back.json")
  convert(t, folder, "robot.json", "robot.vxd")
  convert(t, folder, "robot.vxd", "beside.json")
  local before = host.json.decode(source.read(folder .. "/robot.json"))
  for _, name in ipairs { "back", "beside" } do
    local after = host.json.decode(source.read(("%s/%s.json"):format(folder, name)))
    for _, field in ipairs { "lattice", "edge", "voxels", "weights" } do
      t:same_bits(after[field], before[field])
    end
    t:equal(after.materials.materials, before.materials.materials)
  end
  -- and again: the same bytes
  convert(t, folder, "back.json", "again.vxa")
  t:equal(source.read(folder .. "/again.vxa"), source.read(folder .. "/base.vxa"))
end)

suite:test("other programs find voxels, phases and materials in a .vxa", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.vxa")
  reader.python(t, folder, {}, [==[
import json, math, xml.etree.ElementTree as tree
robot = json.load(open("robot.json"))
root = tree.parse("robot.vxa").getroot()
structure = root.find("VXC/Structure")
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

-- A bar of bone that hangs from its top under 1 m/s^2 for so long that it rests: how far its lower
-- end sinks, m.
local function sag_of(width, height, edge)
  local layer = (("b"):rep(width) .. "\n"):rep(width) .. "\n"
  local hung = limax.robot({ voxels = layer:rep(height) }):simulate { duration = 8, settle = 0,
    accuracy = "preview", record = { position = 20 },
    scene = { damping = true, gravity = { acceleration = { 0, 0, -1 } },
      anchors = { from = { -1, -1, height * edge - 0.01 }, to = { 2, 2, 2 } } } }
  local trace, lowest = hung:trace "position", math.huge
  for _, point in ipairs(trace[trace:size()]:table()) do lowest = math.min(lowest, point[3]) end
  return -lowest
end

suite:test("a bar stretches as the Elastic_Mod of its bone says", { limit = 60 }, function(t)
  local height, edge = 12, 0.1
  -- a bar of w x w voxels has (w + 1)^2 columns of masses: its skin counts as 1 / w
  local sag = 2 * sag_of(8, height, edge) - sag_of(4, height, edge)
  local density, modulus = 0.1 / edge ^ 3, voxcad.MODULUS * 1e4 / edge
  -- the rest of the skin, and the ends, are of second order
  t:near(sag, density * (height * edge) ^ 2 / (2 * modulus), { rtol = 0.05 })
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
  write(folder .. "/v.vxa", VOXCAD)
  local notes = convert(t, folder, "v.vxa", "v.json").stderr
  t:ok(notes:find("! not carried: Structure.Stiffness\n", 1, true), notes)
  local robot = host.json.decode(source.read(folder .. "/v.json"))
  -- sin(a - pi / 2) is - sin(a + pi / 2): the second voxel is the opposite muscle
  t:equal(robot.voxels, { { "ec", "s." } })
  t:near(robot.weights.phase[1][1], { 0.5, 0.5 }, { rtol = 1e-7 })
  local by_letter = {}
  for _, material in ipairs(robot.materials.materials) do by_letter[material.letter] = material end
  t:near(by_letter.e.amplitude, 0.14)
  t:near(by_letter.e.stiffness, 5e6 * 0.01 / 2.7, { rtol = 1e-11 })
  t:equal({ by_letter.c.kind, by_letter.c.stiffness }, { "contracting", by_letter.e.stiffness })
  t:equal(by_letter.s.name, "Passive <b>")
  t:near(robot.scene.actuation.frequency, 4)
  t:equal(robot.scene.friction, { static = 1, kinetic = 0.5 })
  t:ok(limax.robot(folder .. "/v.json"):simulate({ duration = 0.1 }).status == "done")
end)

suite:test("a muscle of amplitude 0 stays one, with its phases", function(t)
  local folder = t:folder()
  local materials = limax.engine.materials("paper"):table()
  materials.materials[2].amplitude = 0
  limax.robot({ voxels = "eb\nbb", materials = materials, weights = 0.25 })
    :save(folder .. "/still.json")
  convert(t, folder, "still.json", "still.vxa")
  convert(t, folder, "still.vxa", "back.json")
  local before = host.json.decode(source.read(folder .. "/still.json"))
  local after = host.json.decode(source.read(folder .. "/back.json"))
  t:equal(after.materials.materials, before.materials.materials)
  t:same_bits(after.weights, before.weights)
  -- what only limax writes is believed no more than the rest
  write(folder .. "/odd.vxa", (source.read(folder .. "/still.vxa")
    :gsub("<Kind>expanding</Kind>", ""):gsub("<Letter>e</Letter>", "<Letter>\200</Letter>")))
  convert(t, folder, "odd.vxa", "odd.json")
  t:equal(limax.robot(folder .. "/odd.json").body.letters, "ab\nbb")
end)

suite:test("names in any encoding, and bodies of very many layers", { limit = 20 }, function(t)
  local folder = t:folder()
  write(folder .. "/v.vxa", (VOXCAD:gsub("Active", "\233t\233 \27[31m")))
  convert(t, folder, "v.vxa", "v.json")
  local robot = host.json.decode(source.read(folder .. "/v.json"))
  t:equal(robot.materials.materials[2].name, "_t_ _[31m")
  limax.robot({ voxels = ("e\n\n"):rep(9000) }):save(folder .. "/tall.json")
  convert(t, folder, "tall.json", "tall.vxa")
  convert(t, folder, "tall.vxa", "back.json")
  t:equal(host.json.decode(source.read(folder .. "/back.json")).lattice, { 1, 1, 9000 })
end)

suite:test("a .vxd takes the place of parts of its base", function(t)
  local folder = t:folder()
  write(folder .. "/other.vxa", VOXCAD)
  local vxd = [==[<VXD><StopCondition replace="VXA.Simulator.StopCondition"><StopConditionFormula>
<mtSUB><mtVAR>t</mtVAR><mtCONST>3</mtCONST></mtSUB></StopConditionFormula></StopCondition>
<Structure replace="PLACE" Compression="ASCII_READABLE"><X_Voxels>1</X_Voxels>
<Y_Voxels>1</Y_Voxels><Z_Voxels>2</Z_Voxels><Data><Layer><![CDATA[2]]></Layer>
<Layer><![CDATA[1]]></Layer></Data></Structure></VXD>]==]
  write(folder .. "/r.vxd", (vxd:gsub("PLACE", "VXA.VXC.Structure")))
  convert(t, folder, "r.vxd", "r.json", "--base", "other.vxa")
  local robot = limax.robot(folder .. "/r.json")
  t:equal(robot.body.letters, "s\n\ne")
  t:equal(robot.description.simulation.duration, 3)
  refused(t, folder, { "r.vxd", "x.json", "--base", "gone.vxa" }, "name its .vxa with --base FILE")
  refused(t, folder, { "r.vxd", "x.json", "--base", "r.vxd" }, "its root is <VXD>; expected <VXA>")
  write(folder .. "/odd.vxd", (vxd:gsub("PLACE", "/etc/passwd")))
  refused(t, folder, { "odd.vxd", "x.json", "--base", "other.vxa" }, "VXD.Structure: replace is",
    "expected a path such as")
end)

suite:test("without actuation muscles keep their amplitude, and do not move", function(t)
  local folder = stage(t)
  local still = limax.robot(folder .. "/robot.json"):simulate { duration = 0.1, settle = 0,
    scene = { gravity = true, ground = true } }
  still:save(folder .. "/still.json")
  convert(t, folder, "still.json", "still.vxa")
  convert(t, folder, "still.vxa", "back.json")
  local before = host.json.decode(source.read(folder .. "/still.json"))
  local after = host.json.decode(source.read(folder .. "/back.json"))
  t:equal(after.materials.materials, before.materials.materials)
  t:equal({ after.scene.actuation, after.scene.gravity }, { nil, before.scene.gravity })
  write(folder .. "/hot.vxa", (VOXCAD:gsub("<VaryTempEnabled>1", "<VaryTempEnabled>0")
    :gsub("<TempAmp>39", "<TempAmp>1000")))
  convert(t, folder, "hot.vxa", "hot.json")
  t:equal(limax.robot(folder .. "/hot.json").materials:get(2).kind, "passive")
end)

-- ---- bad and hostile files ----------------------------------------------------------------------

suite:test("a bad .vxa is refused with file, field and what is legal", function(t)
  local folder = t:folder()
  local function bad(from, to, ...)
    local text, count = VOXCAD:gsub(from, (to:gsub("%%", "%%%%")))
    t:ok(count > 0, from)
    write(folder .. "/bad.vxa", text)
    refused(t, folder, { "bad.vxa", "out.json" }, "limax: bad.vxa: ", ...)
  end
  bad("1120", "1130", 'Structure.Data: layer 1, voxel 3 is "3"', "0 (empty) to 2")
  bad("1120", "112", "layer 1 has 3 voxels; X_Voxels times Y_Voxels is 4")
  bad("<Z_Voxels>1", "<Z_Voxels>2", "Structure.Data has 1 layers; Z_Voxels is 2")
  bad("<X_Voxels>2", "<X_Voxels>2.5", "2.5 voxels along x; legal are whole numbers from 1")
  bad("<X_Voxels>2", "<X_Voxels>1e9", "at most 1000000 are read")
  bad("<X_Voxels>2", "<X_Voxels>nan", 'X_Voxels is "nan"; expected a number')
  bad("<X_Voxels>2", "<X_Voxels>\27[2J", 'X_Voxels is "\\27[2J"; expected a number')
  bad("ASCII_READABLE", "ZLIB", 'Compression is "ZLIB"; legal is "ASCII_READABLE"')
  bad("5e%+6", "5e+16", "Elastic_Mod 5e+16 Pa", "stiffness of 1.85185e+14", "1 to 1e+07 N/m")
  bad("<CTE>0.01", "<CTE>1", "amplitude of 14; legal are 0 to 0.95")
  bad("0.25, %-0.25", "0.25, x", 'layer 1 holds "x"; expected numbers')
  bad("<TempPeriod>0.25", "<TempPeriod>0", "TempPeriod is 0; legal is above 0 s")
  bad("<Lattice_Dim>0.01", "<Lattice_Dim>0", "Lattice_Dim is 0; legal are 1e-6 to 1000 m")
  bad("</VXC>", "", "not XML")
  bad("1120", "0000", "the body is empty")
  bad('%?>', '?>\n<!DOCTYPE VXA [<!ENTITY a "b">]>', "declares a document type, which is refused")
  -- nine muscles, each with its opposite
  local palette, digits = {}, {}
  for k = 1, 9 do
    palette[k] = ("<Material><Name>m</Name><Mechanical><Elastic_Mod>%de6</Elastic_Mod>"):format(k)
      .. "<Density>1e6</Density><CTE>0.01</CTE></Mechanical></Material>"
    digits[k] = ("%d%d"):format(k, k)
  end
  bad("<Palette>.*</PhaseOffset>", ("<Palette>%s</Palette><Structure><X_Voxels>2</X_Voxels>"
    .. "<Y_Voxels>9</Y_Voxels><Z_Voxels>1</Z_Voxels><Data><Layer>%s</Layer></Data><PhaseOffset>"
    .. "<Layer>%s</Layer></PhaseOffset>"):format(table.concat(palette), table.concat(digits),
    ("0.2, 0.7,"):rep(9)), "Structure.PhaseOffset: with the opposites of muscles",
    "there are 18 materials, 9 without; limax holds up to 15")
  bad("<uStatic>1", "<uStatic>-1", "it must be 0 to 1000", "uStatic of VXC.Palette.Material 1")
  write(folder .. "/bad.vxd", "<VXD/>")
  refused(t, folder, { "bad.vxd", "out.json" }, "name its .vxa with --base FILE")
end)

suite:test("a hostile .vxa ends soon and small", { limit = 20 }, function(t)
  local folder = t:folder()
  -- a bomb of entities, a deep nest, and very many elements
  local bomb = { '<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a0 "aaaaaaaaaa">' }
  for k = 1, 30 do
    bomb[#bomb + 1] = ('<!ENTITY a%d "%s">'):format(k, ("&a%d;"):format(k - 1):rep(10))
  end
  write(folder .. "/bomb.vxa", table.concat(bomb) .. "]><VXA>&a30;</VXA>")
  refused(t, folder, { "bomb.vxa", "out.json" }, "declares a document type")
  write(folder .. "/deep.vxa", ("<a>"):rep(200000) .. ("</a>"):rep(200000))
  refused(t, folder, { "deep.vxa", "out.json" }, "nested deeper than 64")
  write(folder .. "/many.vxa", "<VXA>" .. ("<a/>"):rep(2000000) .. "</VXA>")
  refused(t, folder, { "many.vxa", "out.json" }, "more than 100000 elements")
  -- looked at before a tree of them is made
  write(folder .. "/more.vxa", "<VXA>" .. ("<a/>"):rep(20000000) .. "</VXA>")
  refused(t, folder, { "more.vxa", "out.json" }, "more than 100000 elements")
  local attributes = {}
  for k = 1, 100001 do attributes[k] = ("a%d=''"):format(k) end
  write(folder .. "/wide.vxa", "<VXA " .. table.concat(attributes, " ") .. "/>")
  refused(t, folder, { "wide.vxa", "out.json" }, "more than 100000 elements and attributes")
  write(folder .. "/zero.vxa", "<VXA>\0</VXA>")
  refused(t, folder, { "zero.vxa", "out.json" }, "not XML")
  -- read by its size alone
  local file = assert(io.open(folder .. "/large.vxa", "wb"))
  file:seek("set", 2 ^ 28)
  file:write "x"
  file:close()
  refused(t, folder, { "large.vxa", "out.json" }, "at most 134217728 are read")
end)

suite:test("nothing is overwritten without --force", function(t)
  local folder = stage(t)
  write(folder .. "/robot.mtl", "mine")
  local done = process.ends(folder, { "convert", "robot.json", "robot.obj" })
  t:equal({ done.status, done.stderr },
    { 2, "limax: robot.mtl is there already; --force overwrites it\n" })
  t:equal(host.file.exists(folder .. "/robot.obj"), nil)
  convert(t, folder, "robot.json", "robot.obj", "--force")
  t:ok(source.read(folder .. "/robot.mtl") ~= "mine")
end)

suite:test("endings and files that are not there", function(t)
  local folder = stage(t)
  refused(t, folder, { "robot.json", "robot.slt" }, 'names no format; did you mean ".stl"?')
  refused(t, folder, { "robot.txt", "robot.stl" }, "robot.txt: its ending is no robot's")
  refused(t, folder, { "gone.json", "robot.stl" }, "gone.json: No such file")
  write(folder .. "/odd.json", '{"schema": "limax.robot/1"}')
  refused(t, folder, { "odd.json", "robot.stl" }, "odd.json: robot.", "is missing")
end)

return suite
