--- evogym.lua: two-dimensional robots of EvoGym become one voxel thick: .npy holds the rows of a
--- body, .npz also its connections, .json a world with the cells of its objects. x stays x, up
--- becomes z.

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
  connections = "connections: %d pairs of neighbouring voxels that are separate there are joined",
  objects = "the world's other objects",
}

-- The number of pairs of neighbouring voxels: limax joins them all.
local function neighbours_of(rows)
  local count = 0
  for y, row in ipairs(rows) do
    for x, kind in ipairs(row) do
      if kind ~= 0 and (row[x + 1] or 0) ~= 0 then count = count + 1 end
      if kind ~= 0 and ((rows[y + 1] or {})[x] or 0) ~= 0 then count = count + 1 end
    end
  end
  return count
end

-- The description of a body; the first of its rows is the highest.
local function describe(path, rows, connections, notes)
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
  local apart = connections and neighbours_of(rows) - connections or 0
  if apart > 0 then notes[#notes + 1] = NOTES.connections:format(apart) end
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
function evogym.read_npy(path, _, notes)
  return describe(path, rows_of(path, decoded(path, input.read(path))), nil, notes)
end

--- Reads the array `body`, `structure` or `arr_0` of a .npz file, with its connections.
function evogym.read_npz(path, _, notes)
  local by_name, message = npy.unpack(input.read(path))
  if not by_name then input.refuse(path, "%s", message) end
  local found = by_name.body or by_name.structure or by_name.arr_0
  if not found then input.refuse(path, 'has no array "body", "structure" or "arr_0"') end
  local rows = rows_of(path, decoded(path, found))
  local joined = by_name.connections or by_name.arr_1
  return describe(path, rows, joined and decoded(path, joined).count / 2, notes)
end

--- Is this decoded JSON a world of EvoGym?
function evogym.is_world(value)
  return type(value) == "table" and type(value.objects) == "table" and value.grid_width ~= nil
end

-- A whole number of a JSON file.
local function whole(path, field, value, minimum, maximum)
  if type(value) ~= "number" or value ~= math.floor(value) or value < minimum
    or value > maximum then
    input.refuse(path, "%s: expected a whole number from %d to %d", field, minimum, maximum)
  end
  return value
end

-- The robot among a world's objects: the one of that name, or the only one.
local function robot_of(path, objects)
  local name, count = nil, 0
  for each in pairs(objects) do name, count = each, count + 1 end
  if objects.robot then name = "robot" end
  if not name or count > 1 and name ~= "robot" then
    input.refuse(path, 'objects has %d entries; expected one, or one named "robot"', count)
  end
  local robot = objects[name]
  if type(robot) ~= "table" or type(robot.indices) ~= "table" or type(robot.types) ~= "table"
    or #robot.indices ~= #robot.types or #robot.indices == 0 then
    input.refuse(path, "objects.%s: expected lists indices and types of the same length", name)
  end
  return robot, "objects." .. name, count
end

--- The robot of a world, cut out of its grid.
function evogym.of_world(path, world, notes)
  local width = whole(path, "grid_width", world.grid_width, 1, input.MAX_VOXELS)
  local height = whole(path, "grid_height", world.grid_height, 1, input.MAX_VOXELS)
  input.check_lattice(path, { width, 1, height })
  local robot, name, objects = robot_of(path, world.objects)
  local kinds, left, right, low, high = {}, width, 0, height, 0
  for i, index in ipairs(robot.indices) do
    whole(path, ("%s.indices[%d]"):format(name, i), index, 0, width * height - 1)
    if kinds[index] then input.refuse(path, "%s: index %d occurs twice", name, index) end
    kinds[index] = whole(path, ("%s.types[%d]"):format(name, i), robot.types[i], 0, MAX_KIND)
    -- cells are counted along rows, the lowest first
    local x, y = index % width, math.floor(index / width)
    left, right = math.min(left, x), math.max(right, x)
    low, high = math.min(low, y), math.max(high, y)
  end
  local rows = {}
  for y = high, low, -1 do
    local row = {}
    for x = left, right do row[#row + 1] = kinds[x + width * y] or 0 end
    rows[#rows + 1] = row
  end
  local connections = type(robot.neighbors) == "table" and 0 or nil
  for _, list in pairs(connections and robot.neighbors or {}) do
    connections = connections + (type(list) == "table" and #list / 2 or 0)
  end
  if objects > 1 then notes[#notes + 1] = NOTES.objects end
  return describe(path, rows, connections, notes)
end

return evogym
