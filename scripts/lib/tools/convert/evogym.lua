--- evogym.lua: two-dimensional robots of EvoGym become one voxel thick: .npy and .npz hold the
--- rows of a body. x stays x, up becomes z.

local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local input = require "limax.tools.convert.input"
local npy = require "limax.base.npy"
local robot_file = require "limax.robot.robot_file"

local evogym = {}

-- Letters for EvoGym's kinds of voxel: empty, rigid, soft, horizontal and vertical actuator, fixed.
local LETTERS = { [0] = ".", "b", "s", "e", "c", "b" }
local MAX_KIND = 5

local NOTES = {
  actuators = "actuators: EvoGym's stretch along one axis under a controller; horizontal ones"
    .. " became expanding muscles, vertical ones contracting muscles",
  fixed = "fixed voxels: they became bone; the effect anchors holds a part of a body",
  materials = "materials: EvoGym's springs are replaced by limax's material table",
  connections = "connections: all neighbouring voxels are joined",
}

-- The description of a body; the first of its rows is the highest.
local function describe(path, rows, notes)
  local width, height, has = #(rows[1] or {}), #rows, {}
  input.check_lattice(path, { width, 1, height })
  local voxels = {}
  for z = 1, height do
    local y, line = height + 1 - z, {}
    for x, kind in ipairs(rows[y]) do
      if not LETTERS[kind] then
        input.refuse(path, "row %d, column %d is %g; expected a whole number from 0 to %d", y, x,
          kind, MAX_KIND)
      end
      line[x], has[kind] = LETTERS[kind], true
    end
    voxels[z] = { table.concat(line) }
  end
  if has[3] or has[4] then notes[#notes + 1] = NOTES.actuators end
  if has[5] then notes[#notes + 1] = NOTES.fixed end
  notes[#notes + 1] = NOTES.materials
  return { schema = robot_file.schema, lattice = { width, 1, height },
    edge = defaults.fields.simulation.edge.value, voxels = voxels,
    weights = { stiffness = 1, amplitude = 1, phase = 1 },
    materials = engine.materials(defaults.materials):table() }
end

local function decoded(path, bytes)
  local array, message = npy.decode(bytes)
  local generation = path:match "r%d+/robots/g(%d+)%.npy$"
  if not array and generation then
    input.refuse(path, "is a population of limax, not a body of EvoGym; name the run: limax convert"
      .. " %s FILE --generation %d", path:match "^(.*)/r%d+/robots/" or ".", tonumber(generation))
  end
  if not array then input.refuse(path, "%s", message) end
  return array
end

local function rows_of(path, array)
  if #array.shape ~= 2 then
    input.refuse(path, "has %d dimensions; expected 2, rows and columns", #array.shape)
  end
  local height, width = unpack(array.shape)
  input.check_lattice(path, { width, 1, height })
  local rows, numbers = {}, npy.numbers(array)
  for y = 1, height do
    rows[y] = {}
    for x = 1, width do rows[y][x] = numbers[x + (y - 1) * width] end
  end
  return rows
end

--- Reads a body from a .npy file.
function evogym.read_npy(path, notes)
  return describe(path, rows_of(path, decoded(path, input.read(path))), notes)
end

--- Reads the array `body`, `structure` or `arr_0` of a .npz file.
function evogym.read_npz(path, notes)
  local by_name, message = npy.unpack(input.read(path))
  if not by_name then input.refuse(path, "%s", message) end
  local found = by_name.body or by_name.structure or by_name.arr_0
  if not found then input.refuse(path, 'has no array "body", "structure" or "arr_0"') end
  if by_name.connections or by_name.arr_1 then notes[#notes + 1] = NOTES.connections end
  return describe(path, rows_of(path, decoded(path, found)), notes)
end

return evogym
