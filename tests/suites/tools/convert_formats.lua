--- convert_formats.lua: `limax convert`, the other formats: 3MF, VTK, NumPy, CSV, TensorBoard and
--- EvoGym, each read or made by a program that is not ours.

local conversion = require "support.conversion"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local reader = require "support.reader"
local source = require "limax.base.source"
local tensorboard = require "limax.tools.convert.tensorboard"

local suite = require("limax.test").suite "convert formats"

local convert, refused = conversion.convert, conversion.refused
local stage, write = conversion.stage, conversion.write

local NUMPY = { "numpy", numpy = "python3-numpy" }
local MESHIO = { "meshio", meshio = "python3-meshio" }

-- ---- 3MF ----------------------------------------------------------------------------------------

suite:test("3MF is a whole ZIP with a closed surface in the materials' colours", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.3mf", "--edge", "8")
  convert(t, folder, "robot.json", "again.3mf", "--edge", "8")
  t:equal(source.read(folder .. "/again.3mf"), source.read(folder .. "/robot.3mf"))
  reader.python(t, folder, {}, [==[
import collections, xml.etree.ElementTree as tree, zipfile
archive = zipfile.ZipFile("robot.3mf")
assert archive.testzip() is None
assert sorted(archive.namelist()) == ["3D/3dmodel.model", "[Content_Types].xml", "_rels/.rels"]
name = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
model = tree.fromstring(archive.read("3D/3dmodel.model"))
assert model.get("unit") == "millimeter"
relation = tree.fromstring(archive.read("_rels/.rels"))[0]
assert relation.get("Target") == "/3D/3dmodel.model"
bases = [base.get("name") for base in model.iter(name + "base")]
assert bases == ["expanding muscle", "contracting muscle", "soft tissue", "bone"]
points = [tuple(float(v.get(k)) for k in "xyz") for v in model.iter(name + "vertex")]
edges, used, volume = collections.Counter(), set(), 0
for triangle in model.iter(name + "triangle"):
    corners = [int(triangle.get(k)) for k in ("v1", "v2", "v3")]
    used.add(int(triangle.get("p1")))
    for a, b in zip(corners, corners[1:] + corners[:1]): edges[a, b] += 1
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (points[c] for c in corners)
    volume += (ax*(by*cz - bz*cy) + ay*(bz*cx - bx*cz) + az*(bx*cy - by*cx)) / 6
assert all(n == 1 and edges[b, a] == 1 for (a, b), n in list(edges.items()))
assert used == {0, 1, 2, 3} and abs(volume / (12 * 8**3) - 1) < 0.01, volume
]==])
end)

suite:test("a zip tool finds nothing wrong in .3mf and .npz", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.3mf")
  convert(t, folder, "robot.json", "robot.npz", "--record", "center_of_mass=20")
  for _, name in ipairs { "robot.3mf", "robot.npz" } do
    t:ok(reader.tool(t, folder, "unzip", "-t " .. name):find "No errors detected")
  end
end)

suite:test("archives in memory", function(t)
  local entries = { { "a/b", ("x"):rep(1e5) }, { "c", "\0\1" }, { "empty", "" } }
  local bytes = host.zip.pack(entries)
  t:ok(#bytes < 2000)
  t:equal(host.zip.unpack(bytes), entries)
  t:raises("an entry is a list { name, bytes }", function() host.zip.pack { "a" } end)
  t:raises("must not hold a zero byte", function() host.zip.pack { { "a\0b", "1" } } end)
  t:raises("File already exists", function() host.zip.pack { { "a", "" }, { "a", "" } } end)
  local value, message = host.zip.unpack(bytes:sub(1, -2))
  t:equal(value, nil)
  t:equal(type(message), "string")
end)

-- ---- VTK ----------------------------------------------------------------------------------------

suite:test("a body at rest is a grid of cubes to meshio", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.vtu")
  reader.python(t, folder, MESHIO, [==[
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

suite:test("a walk is a series of grids whose places are the trace's", function(t)
  local folder = stage(t)
  limax.robot(folder .. "/robot.json"):simulate({ duration = 0.2, settle = 0.05,
    record = { center_of_mass = 50 } }):save(folder .. "/walk.json")
  convert(t, folder, "walk.json", "walk.pvd")
  -- the same rates, hence the time step that the robot was scored with
  convert(t, folder, "walk.json", "walk.npz", "--record", "center_of_mass=50", "--record",
    "position=50")
  convert(t, folder, "walk.json", "own.npz")
  reader.python(t, folder, { "meshio", "numpy", meshio = "python3-meshio",
    numpy = "python3-numpy" }, [==[
import meshio, numpy, xml.etree.ElementTree as tree
trace = numpy.load("walk.npz")
assert (numpy.load("own.npz")["center_of_mass"] == trace["center_of_mass"]).all()
sets = list(tree.parse("walk.pvd").getroot().iter("DataSet"))
assert len(sets) == 11 == len(trace["position"])
for i, each in enumerate(sets):
    mesh = meshio.read(each.get("file"))
    assert numpy.allclose(mesh.points, trace["position"][i], rtol=1e-8, atol=1e-9)
    assert float(each.get("timestep")) == trace["position_time"][i]
assert 0 < mesh.cell_data["strain"][0].max() < 1
]==])
end)

-- ---- NumPy --------------------------------------------------------------------------------------

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
  reader.python(t, folder, NUMPY, [==[
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

suite:test("words of --record are checked", function(t)
  local folder = stage(t)
  refused(t, folder, { "robot.json", "robot.npz", "--record", "postion=20" },
    "--record postion=20: expected TRACE=HZ", 'did you mean "position"?')
  refused(t, folder, { "robot.json", "robot.npz", "--record", "position=0" },
    "expected a whole number from 1 to 100000 Hz")
  refused(t, folder, { "robot.json", "robot.pvd", "--record", "energy=20" }, "needs position=HZ")
end)

-- ---- runs ---------------------------------------------------------------------------------------

local EXPERIMENT = [[
local limax = require "limax"
return limax.experiment {
  name = "try", lattice = { 2, 2, 2 }, population = 6, generations = 3, repetitions = 2,
  simulation = { duration = 0.1, settle = 0.1, accuracy = "preview" }, fitness = "distance",
}
]]

local function run(t)
  local folder = t:folder()
  write(folder .. "/try.lua", EXPERIMENT)
  process.completes(t, folder, { "run", "-q", "try.lua", "--out", "run" })
  return folder
end

suite:test("the metrics of a run as CSV", function(t)
  local folder = run(t)
  convert(t, folder, "run", "metrics.csv")
  reader.python(t, folder, {}, [==[
import csv, json
rows = list(csv.DictReader(open("metrics.csv", newline="")))
lines = [json.loads(line) for line in open("run/metrics.jsonl")]
assert len(rows) == len(lines) == 6
def check(value, name, row):
    if isinstance(value, dict):
        for key in value: check(value[key], name + "." + key if name else key, row)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        assert float(row[name]) == value, name
    elif name != "schema":
        assert row[name] == str(value), name
for row, line in zip(rows, lines): check(line, "", row)
]==])
end)

-- The messages of TensorBoard's event files, as far as scalars need them.
local PROTO = [[
syntax = "proto3";
message Value { string tag = 1; float simple_value = 2; }
message Summary { repeated Value value = 1; }
message Event { double wall_time = 1; int64 step = 2; string file_version = 3;
  Summary summary = 5; }
]]

suite:test("the metrics of a run as TensorBoard's events", function(t)
  local folder = run(t)
  convert(t, folder, "run", "board.tensorboard")
  write(folder .. "/event.proto", PROTO)
  reader.tool(t, folder, "protoc", "--version", "protobuf-compiler")
  reader.python(t, folder, { "crcmod", crcmod = "python3-crcmod" }, [==[
import calendar, crcmod.predefined, glob, json, re, struct, subprocess, time
crc = crcmod.predefined.mkPredefinedCrcFun("crc-32c")
masked = lambda b: ((crc(b) >> 15 | crc(b) << 17) + 0xa282ead8) & 0xffffffff
lines = [json.loads(line) for line in open("run/metrics.jsonl")]
timing = [json.loads(line) for line in open("run/timing.jsonl")]
for repetition in 1, 2:
    path, = glob.glob("board.tensorboard/r%02d/*.tfevents.*" % repetition)
    rest, events = open(path, "rb").read(), []
    while rest:
        size, check = struct.unpack("<QI", rest[:12])
        assert check == masked(rest[:8])
        data = rest[12:12 + size]
        assert struct.unpack("<I", rest[12 + size:16 + size])[0] == masked(data)
        rest = rest[16 + size:]
        words = ["protoc", "--decode=Event", "event.proto"]
        done = subprocess.run(words, input=data, capture_output=True, check=True)
        events.append(done.stdout.decode())
    assert 'file_version: "brain.Event:2"' in events[0]
    own = [(l, m) for l, m in zip(lines, timing) if l["repetition"] == repetition]
    assert len(events) == len(own) + 1 == 4
    for event, (line, ended) in zip(events[1:], own):
        assert int((re.findall(r"step: (\d+)", event) or [0])[0]) == line["generation"]
        seconds = calendar.timegm(time.strptime(ended["ended"], "%Y-%m-%dT%H:%M:%SZ"))
        assert float(re.search(r"wall_time: (\S+)", event)[1]) == seconds
        values = dict(re.findall(r'tag: "([^"]+)"\s+simple_value: (\S+)', event))
        assert abs(float(values["best"]) - line["best"]) <= 1e-6 * abs(line["best"])
        assert abs(float(values["quantiles/q10"]) - line["quantiles"]["q10"]) < 1e-6
        assert "champion/hash" not in values
]==])
end)

suite:test("checksums are CRC-32C", function(t)
  -- RFC 3720, B.4: 32 bytes of 0, of 255, ascending; and the check value of the polynomial
  t:equal(tensorboard.crc(("\0"):rep(32)), 0x8a9136aa)
  t:equal(tensorboard.crc(("\255"):rep(32)), 0x62a8ab43)
  t:equal(tensorboard.crc "123456789", 0xe3069283)
end)

suite:test("a run stands for its champion", function(t)
  local folder = run(t)
  convert(t, folder, "run", "last.vxa")
  convert(t, folder, "run/r01/champions/g0002.json", "same.vxa")
  t:equal(source.read(folder .. "/last.vxa"), source.read(folder .. "/same.vxa"))
  convert(t, folder, "run", "first.json", "--repetition", "2", "--generation", "0")
  local first = host.json.decode(source.read(folder .. "/first.json"))
  t:equal(first.voxels,
    host.json.decode(source.read(folder .. "/run/r02/champions/g0000.json")).voxels)
  refused(t, folder, { "run", "x.stl", "--generation", "3" }, "legal are 0 to 2")
  refused(t, folder, { "run", "x.stl", "--repetition", "3" }, "repetition 3 has no champion")
  refused(t, folder, { "first.json", "x.csv" }, "first.json: is no run folder, which a .csv needs")
end)

-- ---- EvoGym -------------------------------------------------------------------------------------

suite:test("EvoGym's robots, as NumPy and JSON write them, are one voxel thick", function(t)
  local folder = t:folder()
  reader.python(t, folder, NUMPY, [==[
import json, numpy
body = numpy.array([[3, 3, 4], [1, 0, 2], [5, 0, 4]])
joined = numpy.array([[0, 1, 0, 2, 3, 5], [1, 2, 3, 5, 6, 8]])
numpy.savez("ga.npz", body, joined)
numpy.savez_compressed("named.npz", body=body.astype("float64"), connections=joined[:, :-1])
numpy.save("body.npy", body.astype("int8"))
# a world of 5 x 4 cells, the lowest row first, the robot one cell from the left and from below
cells = {(x + 1) + 5 * (y + 1): int(body[2 - y][x])
         for y in range(3) for x in range(3) if body[2 - y][x]}
beside = {str(i): [j for j in cells if j - i in (1, -1, 5, -5)] for i in cells}
json.dump({"grid_width": 5, "grid_height": 4, "objects": {"robot": {"indices": list(cells),
    "types": list(cells.values()), "neighbors": beside}, "ground": {"indices": [0], "types": [5],
    "neighbors": {"0": []}}}}, open("world.json", "w"))
]==])
  for _, name in ipairs { "ga.npz", "named.npz", "body.npy", "world.json" } do
    local out = name:gsub("%.", "_") .. ".json"
    local notes = convert(t, folder, name, out).stderr
    local robot = limax.robot(folder .. "/" .. out)
    t:equal(robot.body.letters, "b.c\n\nb.s\n\neec")
    t:equal(robot.description.lattice, { 3, 1, 3 })
    t:ok(notes:find "! not carried: actuators" and notes:find "! not carried: fixed voxels", notes)
    -- in one of them a pair of neighbours is not joined
    t:equal(notes:find "connections: 1 neighbouring" ~= nil, name == "named.npz")
    t:equal(notes:find "the world's other objects" ~= nil, name == "world.json")
  end
  t:ok(limax.robot(folder .. "/ga_npz.json"):simulate({ duration = 0.1 }).status == "done")
end)

suite:test("bad and hostile arrays are refused", { limit = 120 }, function(t)
  local folder = t:folder()
  reader.python(t, folder, NUMPY, [==[
import numpy, zipfile
numpy.save("objects.npy", numpy.array([{"a": 1}], dtype=object), allow_pickle=True)
numpy.save("flat.npy", numpy.array([1, 2]))
numpy.save("kind.npy", numpy.array([[1, 7]]))
numpy.save("half.npy", numpy.array([[0.5, 1]]))
numpy.save("nan.npy", numpy.array([[numpy.nan, 1]]))
numpy.save("big.npy", numpy.array([[1, 2]], dtype=">i4"))
numpy.save("words.npy", numpy.array([["a", "b"]]))
numpy.save("fortran.npy", numpy.asfortranarray(numpy.ones((2, 2))))
numpy.save("empty.npy", numpy.zeros((0, 3)))
numpy.save("wide.npy", numpy.ones((2, 1000000), dtype="int8"))
numpy.savez("none.npz", other=numpy.array([[1]]))
good = open("kind.npy", "rb").read()
open("cut.npy", "wb").write(good[:-3])
open("short.npy", "wb").write(good[:20])
# a header that promises far more than there is
promise = good.replace(b"(1, 2), }        ", b"(99999, 99999), }")
assert len(promise) == len(good) and promise != good
open("promise.npy", "wb").write(promise)
with zipfile.ZipFile("bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
    for k in range(4): archive.writestr("arr_%d.npy" % k, bytes(100 << 20))
with zipfile.ZipFile("many.npz", "w") as archive:
    for k in range(1001): archive.writestr("a%d.npy" % k, b"")
for name, entry in ("up", "../arr_0.npy"), ("root", "/arr_0.npy"), ("inner", "a/../../arr_0.npy"):
    with zipfile.ZipFile(name + ".npz", "w") as archive: archive.writestr(entry, good)
with zipfile.ZipFile("damaged.npz", "w") as archive: archive.writestr("arr_0.npy", good)
whole = bytearray(open("damaged.npz", "rb").read())
whole[150] ^= 255
open("damaged.npz", "wb").write(whole)
open("text.npz", "w").write("no archive")
]==])
  local function bad(name, ...) refused(t, folder, { name, "out.json" }, "limax: " .. name, ...) end
  bad("objects.npy", "legal are bool, int, uint and float")
  bad("flat.npy", "has 1 dimensions; legal is 2, rows and columns")
  bad("kind.npy", "row 1, column 2 is 7; legal are whole numbers from 0 to 5")
  bad("half.npy", "row 1, column 1 is 0.5")
  bad("nan.npy", "row 1, column 1 is nan")
  bad("big.npy", 'numbers of kind ">i4"')
  bad("words.npy", "legal are bool, int, uint and float")
  bad("fortran.npy", "is in Fortran's order; legal is C's")
  bad("empty.npy", "0 voxels along z; legal are whole numbers from 1")
  bad("wide.npy", "at most 1000000 are read")
  bad("none.npz", 'has no array "body", "structure" or "arr_0"')
  bad("cut.npy", "holds 1 numbers, its header says 2")
  bad("short.npy", "is cut short: its header has 10 bytes of 118")
  bad("promise.npy", "at most 10000000 are read")
  bad("bomb.npz", "more than 268435456 bytes when unpacked")
  bad("many.npz", "1001 entries; at most 1000 are read")
  for _, name in ipairs { "up", "root", "inner" } do
    bad(name .. ".npz", "an entry names a place outside of the archive")
  end
  bad("damaged.npz", "an entry is damaged")
  bad("text.npz", "Not a zip archive")
end)

suite:test("bad worlds of EvoGym are refused with the field", function(t)
  local folder = t:folder()
  local function bad(text, ...)
    write(folder .. "/bad.json", text)
    refused(t, folder, { "bad.json", "out.json" }, "limax: bad.json: ", ...)
  end
  local world = '{"grid_width": %s, "grid_height": 2, "objects": %s}'
  local function object(indices, types)
    return ('{"r": {"indices": [%s], "types": [%s]}}'):format(indices, types)
  end
  bad(world:format("0", object("0", "1")), "grid_width: expected a whole number from 1")
  bad(world:format("2000000", object("0", "1")), "grid_width: expected a whole number from 1 to")
  bad(world:format("2", object("4", "1")), "objects.r.indices[1]: expected a whole number from 0")
  bad(world:format("2", object("1", "6")), "objects.r.types[1]: expected a whole number from 0 to")
  bad(world:format("2", object("1, 2", "1")), "expected the lists indices and types, of one length")
  bad(world:format("2", object("", "")), "objects.r has no voxels")
  bad(world:format("2", '{"a": 1, "b": 2}'), "objects has 2 entries")
  bad(world:format("2", "{}"), "objects has 0 entries")
  bad("[" .. ("[],"):rep(9000000) .. "1]",
    "has 9000001 lists and objects; at most 8000000 are read")
end)

return suite
