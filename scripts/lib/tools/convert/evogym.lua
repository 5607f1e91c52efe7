--- evogym.lua: two-dimensional robots of EvoGym, one voxel thick. Their files: .json with a grid
--- and the cells of one object, .npy with the rows of a body, .npz with that and the connections.
--- The first row of an array is the highest; here x stays x, and up becomes z.

local arrays = require "limax.tools.convert.arrays"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local input = require "limax.tools.convert.input"
local robot_file = require "limax.robot.robot_file"

local evogym = {}

--- What stands for EvoGym's kinds of voxel, by number: empty, rigid, soft, the horizontal and the
--- vertical actuator, and fixed.
evogym.LETTERS = { [0] = ".", "b", "s", "e", "c", "b" }

local MOST_KIND = 5

-- The description of rows of kinds, the highest first.
local function describe(path, rows, notes)
  local width, height = #(rows[1] or {}), #rows
  input.check_lattice(path, { width, 1, height })
  local voxels, actuators, fixed = {}, false, false
  for z = 1, height do
    local line = {}
    for x, kind in ipairs(rows[height + 1 - z]) do
      local letter = evogym.LETTERS[kind]
      if not letter then
        input.refuse(path, "row %d, column %d is %g; legal are whole numbers from 0 to %d",
          height + 1 - z, x, kind, MOST_KIND)
      end
      actuators, fixed = actuators or kind == 3 or kind == 4, fixed or kind == 5
      line[x] = letter
    end
    voxels[z] = { table.concat(line) }
  end
  if actuators then
    notes[#notes + 1] = "actuators: EvoGym's stretch along one axis, as a controller says;"
      .. " horizontal ones became expanding muscles, vertical ones contracting ones"
  end
  if fixed then notes[#notes + 1] = "fixed voxels: they became bone; the effect anchors holds" end
  notes[#notes + 1] = "materials: EvoGym's springs; limax's own table takes their place"
  return { schema = robot_file.schema, lattice = { width, 1, height },
    edge = defaults.fields.simulation.edge.value, voxels = voxels,
    weights = { stiffness = 1, amplitude = 1, phase = 1 },
    materials = engine.materials(defaults.materials):table() }
end

local function rows_of(path, name, array)
  if #array.shape ~= 2 then
    input.refuse(path, "%s has %d dimensions; legal is 2, rows and columns", name, #array.shape)
  end
  input.check_lattice(path, { array.shape[2], 1, array.shape[1] })
  local rows, at = {}, 0
  for y = 1, array.shape[1] do
    rows[y] = {}
    for x = 1, array.shape[2] do
      at = at + 1
      rows[y][x] = array.data[at]
    end
  end
  return rows
end

local function decoded(path, name, bytes)
  local array, message = arrays.decode(bytes)
  if not array then input.refuse(path, "%s %s", name, message) end
  return array
end

-- EvoGym may leave neighbours apart; limax joins all of them.
local function note_connections(rows, connections, notes)
  local neighbours = 0
  for y, row in ipairs(rows) do
    for x, kind in ipairs(row) do
      if kind ~= 0 and (row[x + 1] or 0) ~= 0 then neighbours = neighbours + 1 end
      if kind ~= 0 and rows[y + 1] and rows[y + 1][x] ~= 0 then neighbours = neighbours + 1 end
    end
  end
  if connections < neighbours then
    notes[#notes + 1] = ("connections: %d neighbouring voxels are apart there, and joined here")
      :format(neighbours - connections)
  end
end

--- Reads a body of a .npy file.
---@param path string
---@param _ table
---@param notes string[]
---@return limax.robot.description
function evogym.read_npy(path, _, notes)
  return describe(path, rows_of(path, "the array", decoded(path, "the array", input.read(path))),
    notes)
end

--- Reads the body of a .npz file: the array `body`, `structure` or `arr_0`.
---@param path string
---@param _ table
---@param notes string[]
---@return limax.robot.description
function evogym.read_npz(path, _, notes)
  local by_name, message = arrays.unpack(input.read(path))
  if not by_name then input.refuse(path, "%s", message) end
  for _, name in ipairs { "body", "structure", "arr_0" } do
    if by_name[name] then
      local shown = ("the array %q"):format(name)
      local rows = rows_of(path, shown, decoded(path, shown, by_name[name]))
      local joined = by_name.connections or by_name.arr_1
      if joined then
        joined = decoded(path, "the array of connections", joined)
        note_connections(rows, #joined.data / 2, notes)
      end
      return describe(path, rows, notes)
    end
  end
  input.refuse(path, "has no array \"body\", \"structure\" or \"arr_0\"")
end

-- A whole number of a JSON file within a range.
local function whole(path, field, value, least, most)
  if type(value) ~= "number" or value ~= math.floor(value) or value < least or value > most then
    input.refuse(path, "%s: expected a whole number from %d to %d", field, least, most)
  end
  return value
end

--- Is this decoded JSON a world of EvoGym?
---@param decoded_json any
---@return boolean
function evogym.is_world(decoded_json)
  return type(decoded_json) == "table" and type(decoded_json.objects) == "table"
    and decoded_json.grid_width ~= nil
end

--- The robot of a world: its object "robot", or the only one there is.
---@param path string
---@param world table decoded
---@param notes string[]
---@return limax.robot.description
function evogym.of_world(path, world, notes)
  local most = input.MOST_VOXELS
  local width = whole(path, "grid_width", world.grid_width, 1, most)
  local height = whole(path, "grid_height", world.grid_height, 1, most)
  input.check_lattice(path, { width, 1, height })
  local names = {}
  for name in pairs(world.objects) do names[#names + 1] = tostring(name) end
  table.sort(names)
  local name = world.objects.robot and "robot" or names[1]
  if not name or #names > 1 and name ~= "robot" then
    input.refuse(path, "objects has %d entries; expected one, or one that is called \"robot\"",
      #names)
  end
  local object = world.objects[name]
  if type(object) ~= "table" or type(object.indices) ~= "table" or type(object.types) ~= "table"
    or #object.indices ~= #object.types then
    input.refuse(path, "objects.%s: expected the lists indices and types, of one length", name)
  end
  local rows, left, right, low, high = {}, width, 1, height, 1
  for i, index in ipairs(object.indices) do
    local field = ("objects.%s.indices[%d]"):format(name, i)
    whole(path, field, index, 0, width * height - 1)
    -- cells are counted along rows, the lowest first
    local x, y = index % width + 1, math.floor(index / width) + 1
    rows[y] = rows[y] or {}
    if rows[y][x] then input.refuse(path, "%s: cell %d is there twice", field, index) end
    rows[y][x] = whole(path, ("objects.%s.types[%d]"):format(name, i), object.types[i], 0,
      MOST_KIND)
    left, right = math.min(left, x), math.max(right, x)
    low, high = math.min(low, y), math.max(high, y)
  end
  if #object.indices == 0 then input.refuse(path, "objects.%s has no voxels", name) end
  local cut = {}
  for y = high, low, -1 do
    local row = {}
    for x = left, right do row[#row + 1] = rows[y] and rows[y][x] or 0 end
    cut[#cut + 1] = row
  end
  if type(object.neighbors) == "table" then
    local ends = 0
    for _, list in pairs(object.neighbors) do
      ends = ends + (type(list) == "table" and #list or 0)
    end
    note_connections(cut, ends / 2, notes)
  end
  if #names > 1 then notes[#notes + 1] = "the world's other objects" end
  return describe(path, cut, notes)
end

return evogym
