--- formats.lua: the formats of `limax convert`, one row each: functions that read or write a file,
--- and the data that it cannot hold.

local defaults = require "limax.settings.defaults"
local evogym = require "limax.tools.convert.evogym"
local failure = require "limax.base.failure"
local host = require "limax.host"
local input = require "limax.tools.convert.input"
local meshes = require "limax.tools.convert.meshes"
local motion = require "limax.draw.motion"
local robot_file = require "limax.robot.robot_file"
local source = require "limax.base.source"
local surface = require "limax.tools.convert.surface"
local traces = require "limax.tools.convert.traces"
local voxcad_read = require "limax.tools.convert.voxcad_read"
local voxcad_write = require "limax.tools.convert.voxcad_write"
local vtk = require "limax.tools.convert.vtk"

local formats = {}

-- A job has the paths `from` and `to`, the command's `arguments`, `notes`, which receive what is
-- lost, and the `robot`. A writer may add `size`, along x, y and z in m, and a `warning`.

---@class limax.convert.format
---@field ending string
---@field text? string description of a written file, for the help page
---@field read? fun(path: string, notes: string[]): limax.robot.description
---@field write? fun(job: table): string|{ [1]: string, [2]: string }[] the text of the
--- file, or paths and texts of several
---@field options? table<string, boolean> options of the command that apply to a written file
---@field lost? string[] what is always lost
---@field kept? table<string, boolean> fields of a robot file besides the body that are not lost;
--- all without `lost`

local MILLIMETRES = 1000 -- in a metre

local function read_json(path)
  local decoded, message = host.json.decode(input.read(path), path)
  if decoded == nil then failure.raise(2, message) end
  local description
  description, message = robot_file.check(decoded)
  if not description then input.refuse(path, "%s", message) end
  return description
end

local function edge_of(robot)
  return robot.description.edge or defaults.fields.simulation.edge.value
end

-- m: a longest side beyond these is probably a mistake of the unit
local SMALLEST, LARGEST = 1e-3, 100

local function mesh_of(job)
  local edge = job.arguments.edge or edge_of(job.robot) * MILLIMETRES
  local mesh = surface.of_robot(job.robot, edge)
  local size = surface.size(mesh)
  for k = 1, 3 do size[k] = size[k] / MILLIMETRES end
  job.size = size
  local longest = math.max(unpack(size))
  if longest < SMALLEST or longest > LARGEST then
    job.warning = ("the longest side of the robot is %.4g m, expected %g to %g m: its voxels have"
      .. " edges of %.4g mm; --edge MM sets them"):format(longest, SMALLEST, LARGEST, edge)
  end
  return mesh
end

local function materials_of(job) return job.robot.materials:table().materials end

local function write_pvd(job)
  local rates = traces.rates(job.arguments.record)
  if not rates then
    -- a rate of positions that does not change the time step of the other traces
    local simulation = job.robot.description.simulation or {}
    rates = source.copy(simulation.record or defaults.record)
    if (rates.position or 0) == 0 then rates.position = motion.position_rate(rates) end
  elseif (rates.position or 0) == 0 then
    failure.raise(2, "--record: a .pvd needs position=HZ")
  end
  local simulated = traces.simulate(job.from, job.robot, rates, job.arguments.device)
  return vtk.series(simulated, edge_of(job.robot), job.to)
end

local function write_npz(job)
  local rates = traces.rates(job.arguments.record)
  return traces.encode(traces.simulate(job.from, job.robot, rates, job.arguments.device))
end

local WITH_COLOUR = { "weights", "materials: all but name and colour" }
local WITH_NUMBER = { "materials: all but their number" }

formats.list = {
  { ending = "json", text = "a robot file", read = read_json,
    write = function(job) return robot_file.text(job.robot:table()) end },
  { ending = "vxa", text = "VoxCad and voxcraft-sim: robot, materials and world",
    read = voxcad_read.read,
    write = function(job) return voxcad_write.vxa(job.robot, job.to, job.notes) end,
    kept = { scene = true, simulation = true },
    lost = { "materials: the table's name, and the sources of its numbers" } },
  { ending = "vxd", text = "voxcraft-sim: only the robot, for the world of a base.vxa",
    write = function(job) return voxcad_write.vxd(job.robot, job.to, job.notes) end,
    kept = { scene = true },
    lost = { "materials and scene: voxcraft-sim reads them from the base.vxa beside the file" } },
  { ending = "npy", read = evogym.read_npy },
  { ending = "stl", text = "the surface in mm, for printing", options = { edge = true },
    write = function(job) return meshes.stl(mesh_of(job)) end,
    lost = { "weights", "materials; .3mf keeps them" } },
  { ending = "3mf", text = "the same with the material of every triangle",
    options = { edge = true },
    write = function(job) return meshes.threemf(mesh_of(job), materials_of(job)) end,
    lost = WITH_COLOUR },
  { ending = "vtu", text = "ParaView: the body at rest", lost = WITH_NUMBER,
    write = function(job) return vtk.at_rest(job.robot:table(), edge_of(job.robot)) end },
  { ending = "pvd", text = "ParaView: the robot simulated again, a .vtu for each sample",
    options = { record = true }, write = write_pvd, lost = WITH_NUMBER },
  { ending = "npz", text = "NumPy: traces of the robot, simulated again, its body and weights",
    options = { record = true }, read = evogym.read_npz, write = write_npz, lost = WITH_NUMBER },
}

function formats.ending_of(path) return (path:match "%.([%w]+)$" or ""):lower() end

--- The format of a path's ending that can be read or written.
---@param way "read"|"write"
---@return limax.convert.format|nil
---@return string[] endings of all such formats, with their dots
function formats.find(path, way)
  local found, endings, ending = nil, {}, formats.ending_of(path)
  for _, format in ipairs(formats.list) do
    if format[way] then endings[#endings + 1] = "." .. format.ending end
    if format[way] and format.ending == ending then found = format end
  end
  return found, endings
end

-- Fields of a robot file besides the body.
local FIELDS = { "scene", "simulation", "fitness", "score", "outcome", "id", "generation",
  "parents", "origin" }

--- Notes what a format always loses of a robot, and fields that the robot has and the format not.
function formats.note_losses(format, robot, notes)
  if not format.lost then return end
  for _, text in ipairs(format.lost) do notes[#notes + 1] = text end
  local lost = {}
  for _, field in ipairs(FIELDS) do
    if robot.description[field] ~= nil and not (format.kept or {})[field] then
      lost[#lost + 1] = field
    end
  end
  if lost[1] then notes[#notes + 1] = table.concat(lost, ", ") end
end

return formats
