--- robot.lua: one robot, by hand or from a file, to be simulated, inspected and saved:
--- `limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }` or `limax.robot "champion.json"`.

local body = require "limax.robot.body"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local fault = require "limax.engine.fault"
local modes = require "limax.robot.modes"
local output = require "limax.base.output"
local prepared = require "limax.robot.prepared"
local robot_file = require "limax.robot.robot_file"
local robot_in_motion = require "limax.robot.robot_in_motion"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local settings = require "limax.settings.settings"
local strict = require "limax.engine.strict"

local robot = {}

local function fail(pattern, ...) engine.fail(pattern:format(...)) end

---@class limax.robot
---@field description limax.robot.description the plain table of a robot file
---@field body limax.robot.body what it consists of
---@field materials limax.materials the table that its letters refer to
---@field population limax.population of the engine, with this robot only
local Robot = strict.methods "robot"

--- The methods of robots; experiment/replay.lua adds `replay`, and `describe_genome` to the module.
robot.methods = Robot

local has_field = { description = true, body = true, materials = true, population = true }

function Robot.__index(_, key)
  local own = Robot[key]
  if own ~= nil then return own end
  if scored_robot.measures_by(key) then
    fail("%s: this robot has not been simulated: use robot:simulate { duration = 2 }:%s()", key,
      key)
  end
  strict.unknown("a robot", key, Robot, has_field)
end

function Robot.__tostring(self)
  local size = self.body.size
  return ("%s\n\n%d voxels, %dx%dx%d, %d masses, %d springs, %.4g kg"):format(self.body.letters,
    self.body.voxels, size[1], size[2], size[3], self.body.masses, self.body.springs,
    self.body.mass)
end

local function object(description, materials)
  local population = robot_file.build(description, materials)
  if population:body(1).status == "no voxel" then
    fail "limax.robot: the body is empty: every letter is ."
  end
  return setmetatable({ description = description, materials = materials, population = population,
    body = body.view(body.record(population, 1, materials)) }, Robot)
end

--- The robot of a plain description.
---@param description limax.robot.description
---@return limax.robot
function robot.of(description)
  return object(description, engine.materials(description.materials))
end

-- ---- by hand ------------------------------------------------------------------------------------

-- A weight of a script (a number, a function of x, y, z, or [x][y][z]) in the form of a file: one
-- number or [z][y][x].
local function weight_layers(weight, lattice, name)
  if weight == nil then return 1 end
  if type(weight) == "number" then return weight end
  if type(weight) ~= "table" and type(weight) ~= "function" then
    fail("limax.robot: weights.%s: expected a number, [x][y][z] or a function (x, y, z), got %s",
      name, schema.show(weight))
  end
  local nx, ny, nz = unpack(lattice)
  return body.grid({ nz, ny, nx }, function(z, y, x)
    local value
    if type(weight) == "function" then
      value = weight(x, y, z)
    else
      value = weight
      local path = "limax.robot: weights." .. name
      for _, index in ipairs { x, y, z } do
        if type(value) ~= "table" then schema.refuse(path, "numbers as [x][y][z]", value) end
        value, path = value[index], ("%s[%d]"):format(path, index)
      end
    end
    if type(value) ~= "number" then
      fail("limax.robot: weights.%s: expected a number at voxel (%d, %d, %d), got %s", name, x, y,
        z, schema.show(value))
    end
    return value
  end)
end

local weight_rule =
  schema.fields { stiffness = schema.any, amplitude = schema.any, phase = schema.any }

local rules = schema.fields {
  voxels = schema.text(".*", "letters: one block of lines per layer, the lowest first"),
  weights = function(value, path)
    if type(value) == "number" then
      return { stiffness = value, amplitude = value, phase = value }
    end
    return weight_rule(value, path)
  end,
  control = robot_file.control_rule,
  materials = schema.any,
  lattice = settings.lattice(),
  edge = schema.number(defaults.fields.simulation.edge),
}

---@class limax.robot.by_hand
--- `voxels` holds the materials' letters: layers separated by an empty line, the lowest first; the
--- first line of a layer is y = 1, and letters run along x. Groups of voxels that share no corner
--- are still one robot, with a note. Each weight is a number from 0 to 1, [x][y][z] or a function
--- (x, y, z); 1 if absent.
---@field voxels string
---@field weights? number|{ stiffness?: any, amplitude?: any, phase?: any }
---@field control? number[] genes of control, for a scene with a controller
---@field materials? string|table|limax.materials "paper" if absent
---@field lattice? integer[] larger than the letters: the rest is empty
---@field edge? number m

local noted_groups = false

-- Prints a note about the first robot by hand whose voxels do not all touch.
local function note_groups(made)
  local groups = noted_groups and 1 or body.groups(made.population:voxels(1):table())
  if groups == 1 then return made end
  noted_groups = true
  output.warn(("%s: limax.robot: its voxels are %d groups that do not touch: nothing joins"
    .. " them, and they are simulated and measured as one robot\n"):format(fault.where(), groups))
  return made
end

local function by_hand(fields)
  local checked, message = rules(fields, "limax.robot")
  if not checked then engine.fail(message) end
  if not checked.voxels then
    fail 'limax.robot: voxels: is missing; expected letters, such as "ecs\\nece\\n\\nsbs\\ncec"'
  end
  local materials = robot_file.materials(checked.materials)
  local layers = body.layers(checked.voxels)
  local size, wrong = body.measure_layers(layers, materials)
  if not size then engine.fail("limax.robot: voxels: " .. wrong) end
  local lattice = checked.lattice or size
  for axis = 1, 3 do
    if lattice[axis] < size[axis] then
      fail("limax.robot: lattice: the letters need %d x %d x %d voxels, it has %d x %d x %d",
        size[1], size[2], size[3], lattice[1], lattice[2], lattice[3])
    end
  end
  local weights = {}
  for _, name in ipairs(robot_file.weights) do
    weights[name] = weight_layers(checked.weights[name], lattice, name)
  end
  return note_groups(object({ schema = robot_file.schema, lattice = lattice, edge = checked.edge,
    voxels = layers, weights = weights, control = checked.control,
    materials = materials:table() }, materials))
end

---@class limax.robot.of_genome
---@field genome "random"|number[]|limax.view a random one, or its numbers
---@field lattice? integer[] voxels along x, y, z; { 5, 5, 5 }
---@field materials? string|table|limax.materials "paper" if absent
---@field edge? number m
---@field features? integer of the encoding, as in an experiment's `genome`; 16
---@field sigma? number 0.15
---@field encoding? any as in an experiment's `genome`; "fourier"
---@field hidden? integer[] { 32, 32 }
---@field initial_scale? number of random genomes; 1
---@field seed? number|string of the encoding, and of a random genome; 1
---@field repetition? integer 1
---@field control? number[] genes of control, for a scene with a controller
---@field individual? integer which robot of the initial population a random genome is; 1

--- A robot by hand or of a genome (tables), from a robot file (its path), or the body of a robot
--- that was simulated.
---@param source string|limax.robot.by_hand|limax.robot.of_genome|limax.scored_robot
---@return limax.robot
function robot.new(source)
  if type(source) == "string" then
    return object(robot_file.read(schema.demand(schema.path, source, "limax.robot")))
  end
  if scored_robot.is(source) then return robot.of(source:table()) end
  if type(source) ~= "table" then
    fail("limax.robot: expected a table { voxels = ... } or the name of a robot file, got %s",
      schema.show(source))
  end
  if source.genome ~= nil and source.voxels == nil then
    return object(robot.describe_genome(source))
  end
  return by_hand(source)
end

--- A copy of this robot with another material in one voxel, and the same weights.
---@param x integer from 1
---@param y integer from 1
---@param z integer from 1, the lowest layer
---@param letter string of a material, `.` takes the voxel away
---@return limax.robot
function Robot:edit(x, y, z, letter)
  local description = self:table()
  for axis, index in ipairs { x or 0, y or 0, z or 0 } do
    local size = description.lattice[axis]
    if type(index) ~= "number" or index % 1 ~= 0 or index < 1 or index > size then
      fail("edit: %s: expected a whole number from 1 to %d (voxels), got %s",
        ("xyz"):sub(axis, axis), size, schema.show(index))
    end
  end
  if type(letter) ~= "string" or #letter ~= 1 or not self.materials:index(letter) then
    fail("edit: expected the letter of a material, got %s; the letters are %s",
      schema.show(letter), body.letters_of(self.materials))
  end
  local line = description.voxels[z][y]
  description.voxels[z][y] = line:sub(1, x - 1) .. letter .. line:sub(x + 1)
  -- they belong to the unedited body
  description.score, description.outcome = nil, nil
  return robot.of(description)
end

-- ---- simulating ---------------------------------------------------------------------------------

--- Simulates this robot: it settles, then its muscles run for `duration`. One whose file holds
--- trials is simulated in each of them, unless `options` name a scene or a trial.
---@param options? limax.robot.simulate_options
---@return limax.scored_robot
function Robot:simulate(options) return scored_robot.simulate(self, options) end

--- Prepares the same simulation, to be advanced step by step; of several trials the first one, or
--- the one that `options` name.
---@param options? limax.robot.simulate_options
---@return limax.robot_in_motion
function Robot:begin(options)
  local simulation, result, control = prepared.simulation(self, options)
  return robot_in_motion.new(simulation, function() return scored_robot.new(result()) end, control)
end

--- Natural frequencies, mode shapes and damping ratios of small vibrations: of the free, undeformed
--- body, or with `standing = true` of the body at rest in its scene, on the ground or held by
--- anchors.
---@param count? integer modes, the lowest frequencies first; 6
---@param options? limax.robot.modes_options
---@return limax.robot.modes
function Robot:modes(count, options) return modes.of(self, count, options) end

--- The plain table that a robot file holds.
---@return limax.robot.description
function Robot:table()
  local description = robot_file.describe(self.population, 1, self.materials, self.description.edge)
  for _, name in ipairs { "scene", "simulation", "trials", "fitness", "score", "outcome", "id",
    "generation", "parents", "origin" } do
    description[name] = self.description[name]
  end
  return description
end

--- Writes this robot to a file without loss.
---@param path string
function Robot:save(path) robot_file.write(path, self:table()) end

-- limax.robot(...) is robot.new(...)
return setmetatable(robot, { __call = function(_, ...) return robot.new(...) end })
