--- convert.lua: `limax convert FROM TO`: robots as files of other programs, and from such files.

local failure = require "limax.base.failure"
local formats = require "limax.tools.convert.formats"
local host = require "limax.host"
local input = require "limax.tools.convert.input"
local output = require "limax.base.output"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local suggest = require "limax.engine.suggest"

local lines = {}
for _, format in ipairs(formats.list) do
  if format.write then lines[#lines + 1] = ("  .%-12s %s"):format(format.ending, format.text) end
end

local command = {
  summary = "robots as files of other programs, and from them",
  usage = "limax convert FROM TO [options]",
  text = [[
FROM is a robot file (.json), a robot of VoxCad or voxcraft-sim (.vxa) or of EvoGym (.npy, .npz), or
a run folder, for its champion. The ending of TO chooses the format:

]] .. table.concat(lines, "\n") .. [[


What a format cannot hold is printed. Nothing is overwritten without --force.]],
  positional = { least = 2, most = 2, name = "FROM and TO" },
  options = {
    { name = "force", text = "overwrite existing files" },
    { name = "edge", argument = "MM", kind = "number", minimum = 0.001, maximum = 1e6,
      text = "edge of a printed voxel; the robot's own if left out" },
    { name = "record", argument = "TRACE=HZ", many = true,
      text = "traces instead of those of the robot's file; a .pvd needs position" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "cpu",
      text = "that simulates the robot again" },
    { name = "repetition", argument = "R", kind = "integer", minimum = 1, maximum = 1e6,
      text = "of a run: whose champion; 1 if left out" },
    { name = "generation", argument = "G", kind = "integer", minimum = 0, maximum = 1e6,
      text = "of a run: the generation of the champion; the last if left out" },
  },
}

-- Refuses options that do not apply to these files.
local function check_options(from, format, arguments)
  local applies = format.options or {}
  local of_champion = runs.is_folder(from)
  for _, each in ipairs {
    { "edge", arguments.edge, applies.edge, "a .stl or .3mf" },
    { "record", arguments.record[1], applies.record, "a .pvd or .npz" },
    { "repetition", arguments.repetition, of_champion, "the champion of a run" },
    { "generation", arguments.generation, of_champion, "the champion of a run" },
  } do
    local name, value, valid, target = unpack(each, 1, 4)
    if value and not valid then failure.raise(2, ("--%s is for %s"):format(name, target)) end
  end
end

local function read(from, arguments, notes)
  local path = runs.is_folder(from) and input.champion(from, arguments) or from
  local format, endings = formats.find(path, "read")
  if not format then
    input.refuse(path, "its ending names no format; expected %s or a run folder",
      table.concat(endings, ", "))
  end
  return input.robot_of(path, format.read(path, notes))
end

-- What was written, in one line.
local function summary(job, files)
  local bytes, size = 0, job.size
  for _, file in ipairs(files) do bytes = bytes + #file[2] end
  local text = ("%s: %d bytes"):format(job.to, bytes)
  if #files > 1 then
    text = ("%s in %d files, also %s to %s"):format(text, #files, source.name_of(files[1][1]),
      source.name_of(files[#files - 1][1]))
  end
  if not size then return text end
  return ("%s; the robot is %.4g x %.4g x %.4g m"):format(text, size[1], size[2], size[3])
end

local function write(files, force)
  for _, file in ipairs(files) do
    if host.file.exists(file[1]) and not force then
      failure.raise(2, file[1] .. " exists already; --force overwrites it")
    end
  end
  for _, file in ipairs(files) do
    local written, message = host.file.mkdir(source.folder_of(file[1]))
    if written then written, message = host.file.write_atomic(file[1], file[2]) end
    if not written then failure.raise(1, message) end
  end
end

function command.run(arguments)
  local from, to = arguments[1], arguments[2]
  local format, endings = formats.find(to, "write")
  if not format then
    failure.raise(2, ("%s: its ending names no format%s"):format(to,
      suggest.ending("." .. formats.ending_of(to), endings)))
  end
  check_options(from, format, arguments)
  local job = { from = from, to = to, arguments = arguments, notes = {} }
  job.robot = read(from, arguments, job.notes)
  local files = format.write(job)
  if type(files) == "string" then files = { { to, files } } end
  write(files, arguments.force)
  output.write(summary(job, files), "\n")
  if job.warning then output.warn(("! %s: %s\n"):format(to, job.warning)) end
  formats.note_losses(format, job.robot, job.notes)
  for _, note in ipairs(job.notes) do output.warn("! not carried: ", note, "\n") end
  return 0
end

return command
