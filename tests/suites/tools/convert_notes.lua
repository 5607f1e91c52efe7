--- convert_notes.lua: `limax convert`: what a format leaves out is named whole, names survive every
--- format, options that would say nothing are refused, and so are files that would take for ever.

local conversion = require "support.conversion"
local host = require "limax.host"
local limax = require "limax"
local process = require "limax.tools.test.process"
local reader = require "support.reader"
local source = require "limax.base.source"

local suite = require("limax.test").suite "convert notes"

local convert, refused = conversion.convert, conversion.refused
local stage, write = conversion.stage, conversion.write

-- The notes of a conversion, as a list.
local function notes_of(t, folder, ...)
  local notes = {}
  for note in convert(t, folder, ...).stderr:gmatch "! not carried: ([^\n]+)" do
    notes[#notes + 1] = note
  end
  return notes
end

local REST = "scene, simulation, outcome, id, generation, parents, origin"

suite:test("every format names what it leaves out of a robot that was simulated", function(t)
  local folder = stage(t)
  limax.robot(folder .. "/robot.json"):simulate({ duration = 0.1, settle = 0,
    scene = { gravity = true, friction = true, planes = true, actuation = true } })
    :save(folder .. "/walk.json")
  local surface = { "weights", "materials: all but name and colour", REST }
  local grid = { "materials: all but their number", REST }
  t:equal(notes_of(t, folder, "walk.json", "w.obj"), surface)
  t:equal(notes_of(t, folder, "walk.json", "w.3mf"), surface)
  t:equal(notes_of(t, folder, "walk.json", "w.stl"), { "materials and weights: STL is a surface"
    .. " alone; .obj and .3mf keep materials", REST })
  for _, name in ipairs { "w.vtu", "w.pvd", "w.npz" } do
    t:equal(notes_of(t, folder, "walk.json", name), grid)
  end
  local weights = {}
  for k, name in ipairs { "stiffness", "amplitude" } do
    weights[k] = ("weights.%s: read back by limax alone; elsewhere every voxel has its material's"
      .. " full %s"):format(name, name)
  end
  t:equal(notes_of(t, folder, "walk.json", "w.vxa"), {
    "scene.friction: VoxCad's is that of its floor",
    "scene: that nothing damps; limax reads damping",
    "scene.planes", "scene.actuation.ramp: muscles begin at once", weights[1], weights[2],
    "simulation: all but its duration (settling, integrator, time step)",
    "materials: the table's name, and where its numbers come from",
    "outcome, id, generation, parents, origin" })
  t:equal(notes_of(t, folder, "walk.json", "w.vxd"), { weights[1], weights[2], "materials and"
    .. " scene: voxcraft-sim reads them from the base.vxa beside it, which a .vxa of this robot can"
    .. " be", "simulation, outcome, id, generation, parents, origin" })
  t:equal(notes_of(t, folder, "walk.json", "again.json"), {})
end)

suite:test("elements of a .vxa that limax does not read are named, each once", function(t)
  local folder = stage(t)
  convert(t, folder, "robot.json", "robot.vxa")
  local text = source.read(folder .. "/robot.vxa")
  t:equal(notes_of(t, folder, "robot.vxa", "plain.json"),
    { "Simulator: all but a StopConditionFormula t - seconds" })
  text = text:gsub("<CTE>", "<Plastic_Mod>0</Plastic_Mod><Yield_Stress>5</Yield_Stress><CTE>")
    :gsub("</Display>", "</Display><Fixed>1</Fixed><Sticky> 0 </Sticky>")
    :gsub("<Lattice>", "<Voxel><Vox_Name>BOX</Vox_Name><X_Squeeze>1</X_Squeeze></Voxel>"
      .. "<Lattice><X_Dim_Adj>1</X_Dim_Adj><Y_Dim_Adj>2</Y_Dim_Adj>")
    :gsub("<Environment>", "<RawPrint>words</RawPrint><Environment><Sea><Depth>3</Depth></Sea>")
  write(folder .. "/rich.vxa", text)
  t:equal(notes_of(t, folder, "rich.vxa", "rich.json"), { "RawPrint", "Environment.Sea",
    "VXC.Lattice.Y_Dim_Adj", "VXC.Palette.Material.Fixed",
    "VXC.Palette.Material.Mechanical.Yield_Stress",
    "Simulator: all but a StopConditionFormula t - seconds" })
  local many = {}
  for k = 1, 5000 do many[k] = ("<E%d>1</E%d>"):format(k, k) end
  write(folder .. "/many.vxa", (source.read(folder .. "/robot.vxa"):gsub("<Palette>",
    table.concat(many) .. "<Palette>")))
  local notes = notes_of(t, folder, "many.vxa", "many.json")
  t:equal({ #notes, notes[21] }, { 22, "4980 more elements" })
end)

suite:test("names of files and materials are what other programs read them as", function(t)
  local folder = stage(t)
  local robot = host.json.decode(source.read(folder .. "/robot.json"))
  for k, name in ipairs { "a b", "a_b", '<x y="1">&' } do
    robot.materials.materials[k + 1].name = name
  end
  write(folder .. "/robot.json", host.json.encode(robot))
  convert(t, folder, "robot.json", 'a & "b".pvd', "--record", "position=20")
  convert(t, folder, "robot.json", "x y.obj")
  convert(t, folder, "robot.json", "r.3mf")
  reader.python(t, folder, {}, [==[
import os, re, xml.etree.ElementTree as tree, zipfile
sets = list(tree.parse('a & "b".pvd').getroot().iter("DataSet"))
assert sets and all(os.path.exists(each.get("file")) for each in sets)
words = dict(line.split(None, 1) for line in open("x y.obj") if line.startswith("mtllib"))
library = words["mtllib"].strip()
made = re.findall(r"^newmtl (\S+)$", open(library).read(), re.M)
used = re.findall(r"^usemtl (\S+)$", open("x y.obj").read(), re.M)
assert library == "x_y.mtl" and used == made and len(set(made)) == len(made) == 4, made
model = tree.fromstring(zipfile.ZipFile("r.3mf").read("3D/3dmodel.model"))
assert [e.get("name") for e in model.iter() if e.tag.endswith("base")][:3] == [
    "a b", "a_b", '<x y="1">&']
]==])
end)

suite:test("options that would say nothing are refused", function(t)
  local folder = stage(t)
  refused(t, folder, { "robot.json", "r.vtu", "--edge", "8" }, "--edge is for a .stl, .obj or .3mf")
  refused(t, folder, { "robot.json", "r.stl", "--record", "position=50" },
    "--record is for a .pvd or .npz")
  refused(t, folder, { "robot.json", "r.stl", "--generation", "3" },
    "--generation is for the champion of a run")
  refused(t, folder, { "robot.json", "r.vxd", "--base", "b.vxa" }, "--base is for a robot from")
end)

suite:test("a robot file's scene and duration are checked for every format", function(t)
  local folder = stage(t)
  local robot = host.json.decode(source.read(folder .. "/robot.json"))
  robot.scene = { gravty = true }
  write(folder .. "/scene.json", host.json.encode(robot))
  robot.scene, robot.simulation = nil, { duration = -1 }
  write(folder .. "/time.json", host.json.encode(robot))
  for _, to in ipairs { "r.vxa", "r.stl", "r.npz" } do
    refused(t, folder, { "scene.json", to }, 'scene.json: scene: unknown field "gravty"')
    refused(t, folder, { "time.json", to }, "time.json: robot.simulation.duration: expected",
      "above 0 to 1000000 (s), got -1")
  end
end)

suite:test("arrays that promise much and hold nothing are refused at once", { limit = 20 },
  function(t)
    local folder = t:folder()
    local function array(shape)
      local header = ("{'descr': '|u1', 'fortran_order': False, 'shape': (%s), }\n"):format(shape)
      return "\147NUMPY\1\0" .. string.char(#header % 256, math.floor(#header / 256)) .. header
    end
    for _, each in ipairs { { "1000000000000, 0", "has the shape (1000000000000, 0); legal" },
      { "10000000, 0", "0 voxels along x" }, { "-1, 3", "up to 32 whole numbers from 0" },
      { "1e5, 3", "has the shape (1e5, 3)" }, { ("1, "):rep(33), "has the shape (1, 1," } } do
      write(folder .. "/a.npy", array(each[1]))
      refused(t, folder, { "a.npy", "out.json" }, "a.npy: ", each[2])
    end
    write(folder .. "/a.npy", (array("1, 3"):gsub("'|u1'", "[('a', '<i4')]")))
    refused(t, folder, { "a.npy", "out.json" }, "is an array of records; legal are")
    write(folder .. "/a.npy", array("1, 3"):sub(1, 40))
    refused(t, folder, { "a.npy", "out.json" }, "is cut short: its header has 30 bytes of")
    write(folder .. "/body.npy", array "1, 2" .. "\1\2")
    reader.python(t, folder, {}, [==[
import warnings, zipfile
warnings.simplefilter("ignore")
with zipfile.ZipFile("twice.npz", "w") as archive:
    for k in range(2): archive.write("body.npy")
]==])
    refused(t, folder, { "twice.npz", "out.json" }, 'twice.npz: has two arrays "body"')
    write(folder .. "/twice.json", '{"grid_width": 2, "grid_height": 1, "objects": {"r":'
      .. ' {"indices": [1, 1], "types": [1, 2]}}}')
    refused(t, folder, { "twice.json", "out.json" }, "objects.r.indices[2]: cell 1 is there twice")
  end)

suite:test("lines of a run that are no generation's are refused", { limit = 20 }, function(t)
  local folder = t:folder()
  assert(host.file.mkdir(folder .. "/run"))
  write(folder .. "/run/config.json", "{}")
  local function lines(metrics, timing)
    write(folder .. "/run/metrics.jsonl", metrics)
    write(folder .. "/run/timing.jsonl", timing)
  end
  local good = '{"repetition": 1, "generation": 0, "best": 1}\n'
  lines('{"repetition": 1, "generation": -1}\n', good)
  refused(t, folder, { "run", "b.tensorboard" },
    "metrics.jsonl: line 1: generation: expected a whole number from 0 to 1000000")
  lines('{"repetition": 0.5, "generation": 1}\n', good)
  refused(t, folder, { "run", "b.csv" }, "line 1: repetition: expected a whole number from 1")
  lines(good, good .. '{"a": 1}\n')
  refused(t, folder, { "run", "b.tensorboard" }, "timing.jsonl: line 2: repetition: expected")
  lines("", "")
  refused(t, folder, { "run", "b.csv" }, "metrics.jsonl: holds no generation yet")
  lines(good:gsub('"best"', '"a, b": "c", "best"'), good)
  convert(t, folder, "run", "b.csv")
  reader.python(t, folder, {}, [==[
import csv
row, = csv.DictReader(open("b.csv", newline=""))
assert row == {"repetition": "1", "generation": "0", "a, b": "c", "best": "1"}, row
]==])
  t:equal(notes_of(t, folder, "run", "b.tensorboard"),
    { "digits beyond those of 32 bits: a scalar is a float", "a, b: no number" })
end)

suite:test("the page's commands run, and its table is what is read and written", { limit = 30 },
  function(t)
    local page, folder = assert(source.read(host.home .. "/scripts/CONVERT.md")), t:folder()
    write(folder .. "/walk.lua", [[
return require("limax").experiment { lattice = { 2, 2, 2 }, population = 4, generations = 2,
  repetitions = 1, simulation = { duration = 0.1, settle = 0, accuracy = "preview" },
  fitness = "walk" }
]])
    local done = process.limax({ "run", "-q", "walk.lua", "--out", "runs/walk-1" },
      { folder = folder })
    t:ok(done.status == 0, done.stderr)
    local count = 0
    convert(t, folder, "runs/walk-1", "walker.vxa")
    for line in page:match("```text\n(.-)```"):gmatch "[^\n]+" do
      local words = {}
      for word in line:gsub("%s*#.*$", ""):gmatch "%S+" do words[#words + 1] = word end
      t:equal({ words[1], words[2] }, { "limax", "convert" })
      convert(t, folder, unpack(words, 3))
      count = count + 1
    end
    t:ok(count >= 5, count)
    local rows = 0
    for row in page:gmatch "\n| `(%.[^\n]+)" do
      rows = rows + 1
      local endings, reads, writes = row:match "^(.-) | ?(%l*) | ?(%l*) |"
      t:ok(reads == "yes" or writes == "yes", row)
      for ending in ("`" .. endings):gmatch "`(%.[%w]+)`" do
        local out = process.limax({ "convert", "gone.json", "out" .. ending }, { folder = folder })
        -- the source is looked at after the ending
        t:equal(out.stderr:find("names no format", 1, true) == nil,
          writes == "yes" or page:find(("| `%s` | | yes |"):format(ending), 1, true) ~= nil)
        local from = process.limax({ "convert", "gone" .. ending, "out.json" }, { folder = folder })
        t:equal(from.stderr:find("is no robot's", 1, true) == nil,
          reads == "yes" or ending == ".npz")
      end
    end
    t:equal(rows, 12)
  end)

return suite
