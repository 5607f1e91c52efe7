--- convert.lua: `limax convert FROM TO`: robots and runs as files of other programs, and robots
--- from them.

local defaults = require "limax.settings.defaults"
local failure = require "limax.base.failure"
local host = require "limax.host"
local input = require "limax.tools.convert.input"
local losses = require "limax.tools.convert.losses"
local metrics = require "limax.tools.convert.metrics"
local motion = require "limax.draw.motion"
local obj = require "limax.tools.convert.obj"
local robot_file = require "limax.robot.robot_file"
local robots = require "limax.tools.convert.robots"
local source = require "limax.base.source"
local stl = require "limax.tools.convert.stl"
local suggest = require "limax.base.suggest"
local surface = require "limax.tools.convert.surface"
local tensorboard = require "limax.tools.convert.tensorboard"
local threemf = require "limax.tools.convert.threemf"
local traces = require "limax.tools.convert.traces"
local voxcad_write = require "limax.tools.convert.voxcad_write"
local vtk = require "limax.tools.convert.vtk"

local command = {
  summary = "robots and runs as files of other programs, and robots from them",
  usage = "limax convert FROM TO [options]",
  text = [[
FROM is a robot file (.json), a robot of VoxCad or voxcraft-sim (.vxa, .vxd) or of EvoGym (.json,
.npy, .npz), or a run folder, which stands for its champion. TO says by its ending what is written:

  .json         a robot file
  .vxa, .vxd    VoxCad and voxcraft-sim: with materials and world, or the robot alone
  .stl .obj .3mf  for printing, in millimetres; .3mf and .obj (with a .mtl) keep the materials
  .vtu          ParaView: the body at rest
  .pvd          ParaView: the robot simulated again, a .vtu beside it for each sample
  .npz          NumPy: the traces of the robot, simulated again, its body and weights
  .csv          of a run: metrics.jsonl as a table
  .tensorboard  of a run: a folder with TensorBoard's event files, one for each repetition

What a format cannot carry is printed. Nothing is overwritten without --force.]],
  positional = { least = 2, most = 2, name = "FROM and TO" },
  options = {
    { name = "force", text = "overwrite files that are there" },
    { name = "base", argument = "FILE", text = "the .vxa whose materials and world a .vxd takes;"
      .. " base.vxa beside it if left out" },
    { name = "edge", argument = "MM", kind = "number", minimum = 0.001, maximum = 1e6,
      text = "edge of a printed voxel; the robot's own if left out" },
    { name = "record", argument = "TRACE=HZ", many = true,
      text = "traces in place of those that the robot's file records; a .pvd needs position" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "cpu",
      text = "that simulates the robot again" },
    { name = "repetition", argument = "R", kind = "integer", minimum = 1, maximum = 1e6,
      text = "of a run: whose champion; 1 if left out" },
    { name = "generation", argument = "G", kind = "integer", minimum = 0, maximum = 1e6,
      text = "of a run: the generation of the champion; the last if left out" },
  },
}

local MILLIMETRES = 1000 -- in a metre


-- ---- what each ending is made of ----------------------------------------------------------------

local function edge_of(robot)
  return robot.description.edge or defaults.fields.simulation.edge.value
end

-- A robot's surface in millimetres.
local function mesh_of(robot, arguments)
  return surface.of_robot(robot, arguments.edge or edge_of(robot) * MILLIMETRES)
end

-- The folder of a run, which some endings need.
local function run_of(job)
  if not robots.is_run(job.from) then
    input.refuse(job.from, "is no run folder, which a .%s needs", robots.ending_of(job.to))
  end
  return job.from
end

-- Each: job { from, to, arguments, notes, robot() } -> list of { path, text }.
local WRITERS = {}

function WRITERS.json(job)
  return { { job.to, robot_file.text(job.robot():table()) } }
end

function WRITERS.vxa(job)
  return { { job.to, voxcad_write.vxa(job.robot(), job.to, job.notes) } }
end

function WRITERS.vxd(job)
  return { { job.to, voxcad_write.vxd(job.robot(), job.to, job.notes) } }
end

function WRITERS.stl(job)
  local robot = job.robot()
  losses.note(job.notes, robot, "materials and weights: STL is a surface alone; .obj and .3mf keep"
    .. " materials")
  return { { job.to, stl.encode(mesh_of(robot, job.arguments)) } }
end

function WRITERS.obj(job)
  local robot = job.robot()
  -- programs take a name in an .obj to end at a blank
  local library = source.name_of(job.to):gsub("%.[^.]*$", ""):gsub("[%s%c]", "_") .. ".mtl"
  local text, shades = obj.encode(mesh_of(robot, job.arguments), robot.materials:table().materials,
    library)
  losses.note(job.notes, robot, "weights", losses.materials "name and colour")
  return { { job.to, text }, { job.to:sub(1, -#source.name_of(job.to) - 1) .. library, shades } }
end

WRITERS["3mf"] = function(job)
  local robot = job.robot()
  losses.note(job.notes, robot, "weights", losses.materials "name and colour")
  return { { job.to, threemf.encode(mesh_of(robot, job.arguments),
    robot.materials:table().materials) } }
end

function WRITERS.vtu(job)
  local robot = job.robot()
  losses.note(job.notes, robot, losses.materials "their number")
  return { { job.to, vtk.at_rest(robot:table(), edge_of(robot)) } }
end

function WRITERS.pvd(job)
  local rates, robot = traces.rates(job.arguments.record), job.robot()
  if not rates then
    -- beside what is recorded anyway, at a rate that leaves the time step as it was
    rates = source.copy((robot.description.simulation or {}).record or defaults.record)
    if (rates.position or 0) == 0 then rates.position = motion.position_rate(rates) end
  elseif not rates.position then
    failure.raise(2, "--record: a .pvd needs position=HZ")
  end
  local walked = traces.simulate(job.from, robot, rates, job.arguments.device)
  losses.note(job.notes, robot, losses.materials "their number")
  return vtk.series(walked, edge_of(robot), job.to)
end

function WRITERS.npz(job)
  local rates, robot = traces.rates(job.arguments.record), job.robot()
  local walked = traces.simulate(job.from, robot, rates, job.arguments.device)
  losses.note(job.notes, robot, losses.materials "their number")
  return { { job.to, traces.encode(walked) } }
end

function WRITERS.csv(job) return { { job.to, metrics.csv(run_of(job)) } } end

function WRITERS.tensorboard(job)
  return tensorboard.files(run_of(job), job.to, job.notes)
end

-- ---- the command --------------------------------------------------------------------------------

-- Refuses options that would say nothing here.
local function check_options(job)
  local given, ending = job.arguments, robots.ending_of(job.to)
  local printed = ending == "stl" or ending == "obj" or ending == "3mf"
  local moves = ending == "pvd" or ending == "npz"
  local of_champion = robots.is_run(job.from) and ending ~= "csv" and ending ~= "tensorboard"
  for _, each in ipairs {
    { "edge", given.edge, printed, "a .stl, .obj or .3mf" },
    { "record", given.record[1], moves, "a .pvd or .npz" },
    { "base", given.base, robots.ending_of(job.from) == "vxd", "a robot from a .vxd" },
    { "repetition", given.repetition, of_champion, "the champion of a run" },
    { "generation", given.generation, of_champion, "the champion of a run" },
  } do
    if each[2] and not each[3] then
      failure.raise(2, ("--%s is for %s"):format(each[1], each[4]))
    end
  end
end

local function writer_of(path)
  local ending = robots.ending_of(path)
  if WRITERS[ending] then return WRITERS[ending] end
  local endings = {}
  for each in pairs(WRITERS) do endings[#endings + 1] = "." .. each end
  failure.raise(2, ("%s: its ending names no format%s"):format(path,
    suggest.ending("." .. ending, endings)))
end

local function write(files, force)
  for _, file in ipairs(files) do
    local there = host.file.exists(file[1])
    if there == "folder" then failure.raise(2, file[1] .. " is a folder, not a file") end
    if there and not force then
      failure.raise(2, file[1] .. " is there already; --force overwrites it")
    end
  end
  for _, file in ipairs(files) do
    local fine, message = host.file.mkdir(source.folder_of(file[1]))
    if not fine then failure.raise(1, message) end
    fine, message = host.file.write_atomic(file[1], file[2])
    if not fine then failure.raise(1, message) end
    print(("%s: %d bytes"):format(file[1], #file[2]))
  end
end

---@param arguments table
---@return integer status
function command.run(arguments)
  local from, to = arguments[1], arguments[2]
  local writer, notes = writer_of(to), {}
  local job = { from = from, to = to, arguments = arguments, notes = notes }
  function job.robot() return robots.read(from, arguments, notes) end
  check_options(job)
  write(writer(job), arguments.force)
  for _, note in ipairs(notes) do io.stderr:write("! not carried: ", note, "\n") end
  return 0
end

return command
