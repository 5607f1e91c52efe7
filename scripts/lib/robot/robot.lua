--- robot.lua: one robot, by hand or from a file, to be simulated, looked at and saved:
--- `limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }` or `limax.robot "champion.json"`.

local body = require "limax.robot.body"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local prepared = require "limax.robot.prepared"
local robot_file = require "limax.robot.robot_file"
local robot_in_motion = require "limax.robot.robot_in_motion"
local robot_of_genome = require "limax.robot.robot_of_genome"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"

local robot = {}

local function fail(pattern, ...) engine.fail(pattern:format(...)) end

---@class limax.robot
---@field description limax.robot.description the plain table of a robot file
---@field body limax.robot.body what it consists of
---@field materials limax.materials the table that its letters refer to
---@field population limax.population of the engine, with this robot only
local Robot = {}

--- The methods of robots; experiment/replay.lua adds `replay`.
robot.methods = Robot

function Robot.__index(_, key)
  local own = Robot[key]
  if own == nil and scored_robot.measures_by(key) then
    fail("%s: this robot has not been simulated: robot:simulate { duration = 2 }:%s() does", key,
      key)
  end
  return own
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

-- A weight as a script gives it (a number, a function of x, y, z, or [x][y][z]) in the form of a
-- file: one number or [z][y][x].
local function weight_layers(given, lattice, name)
  if given == nil then return 1 end
  if type(given) == "number" then return given end
  if type(given) ~= "table" and type(given) ~= "function" then
    fail("limax.robot: weights.%s: expected a number, [x][y][z] or a function (x, y, z), got %s",
      name, schema.show(given))
  end
  local layers = {}
  for z = 1, lattice[3] do
    layers[z] = {}
    for y = 1, lattice[2] do
      layers[z][y] = {}
      for x = 1, lattice[1] do
        local value
        if type(given) == "function" then
          value = given(x, y, z)
        else
          value = given[x] and given[x][y] and given[x][y][z]
        end
        if type(value) ~= "number" then
          fail("limax.robot: weights.%s: expected a number at voxel (%d, %d, %d), got %s", name,
            x, y, z, schema.show(value))
        end
        layers[z][y][x] = value
      end
    end
  end
  return layers
end

local weight_rule = schema.fields { stiffness = function(v) return v end,
  amplitude = function(v) return v end, phase = function(v) return v end }

local lattice_rule = schema.list(schema.number(defaults.fields.experiment.lattice), { count = 3,
  expected = "a list { nx, ny, nz } of voxels" })

local rules = schema.fields {
  voxels = schema.text(".*", "letters: one block of lines per layer, the lowest first"),
  weights = function(given, path)
    if type(given) == "number" then
      return { stiffness = given, amplitude = given, phase = given }
    end
    return weight_rule(given, path)
  end,
  materials = function(given) return given end,
  lattice = lattice_rule,
  edge = schema.number(defaults.fields.simulation.edge),
}

-- Lines filled up with empty voxels to the lattice.
local function filled(layers, lattice)
  local full = {}
  for z = 1, lattice[3] do
    full[z] = {}
    for y = 1, lattice[2] do
      local line = layers[z] and layers[z][y] or ""
      full[z][y] = line .. ("."):rep(lattice[1] - #line)
    end
  end
  return full
end

---@class limax.robot.given
--- `voxels` holds the materials' letters: layers parted by an empty line, the lowest first; the
--- first line of a layer is y = 1, and letters run along x. Each weight is a number from 0 to 1,
--- [x][y][z] or a function (x, y, z); 1 if absent.
---@field voxels string
---@field weights? number|{ stiffness?: any, amplitude?: any, phase?: any }
---@field materials? string|table|limax.materials "paper" if absent
---@field lattice? integer[] larger than the letters say: the rest is empty
---@field edge? number m

local function by_hand(given)
  local checked, message = rules(given, "limax.robot")
  if not checked then engine.fail(message) end
  if not checked.voxels then
    fail 'limax.robot: voxels: is missing; expected letters, such as "ecs\\nece\\n\\nsbs\\ncec"'
  end
  local materials = checked.materials or defaults.materials
  if not (type(materials) == "table" and materials.get) then
    materials = engine.materials(materials)
  end
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
  return object({ schema = robot_file.schema, lattice = lattice, edge = checked.edge,
    voxels = filled(layers, lattice), weights = weights, materials = materials:table() }, materials)
end

---@class limax.robot.of_genome
---@field genome "random"|number[]|limax.view a random one, or its numbers
---@field lattice? integer[] voxels along x, y, z; { 5, 5, 5 }
---@field materials? string|table|limax.materials "paper" if absent
---@field edge? number m
---@field features? integer of the encoding, as in an experiment's `genome`; 16
---@field sigma? number 1
---@field hidden? integer[] { 32, 32 }
---@field initial_scale? number of random genomes; 1
---@field seed? number|string of the encoding, and of a random genome; 1
---@field repetition? integer 1
---@field individual? integer which robot of the initial population a random genome is; 1

--- A robot by hand, of a genome (tables), from a robot file (its path), or again the body of one
--- that was simulated.
---@param given string|limax.robot.given|limax.robot.of_genome|limax.scored_robot
---@return limax.robot
function robot.new(given)
  if type(given) == "string" then return object(robot_file.read(given)) end
  if scored_robot.is(given) then return robot.of(given:table()) end
  if type(given) ~= "table" then
    fail("limax.robot: expected a table { voxels = ... } or the name of a robot file, got %s",
      schema.show(given))
  end
  if given.genome ~= nil and given.voxels == nil then
    return object(robot_of_genome.describe(given))
  end
  return by_hand(given)
end

--- This robot with one voxel of another material; weights stay. The robot itself does not change.
---@param x integer from 1
---@param y integer from 1
---@param z integer from 1, the lowest layer
---@param letter string of a material, `.` takes the voxel away
---@return limax.robot
function Robot:edit(x, y, z, letter)
  local description = self:table()
  for axis, given in ipairs { x or 0, y or 0, z or 0 } do
    local size = description.lattice[axis]
    if type(given) ~= "number" or given % 1 ~= 0 or given < 1 or given > size then
      fail("edit: %s: expected a whole number from 1 to %d (voxels), got %s",
        ("xyz"):sub(axis, axis), size, schema.show(given))
    end
  end
  if type(letter) ~= "string" or #letter ~= 1 or not self.materials:index(letter) then
    fail("edit: expected the letter of a material, got %s; the letters are %s",
      schema.show(letter), body.legal_letters(self.materials))
  end
  local line = description.voxels[z][y]
  description.voxels[z][y] = line:sub(1, x - 1) .. letter .. line:sub(x + 1)
  -- what the file said about another body's walk
  description.score, description.outcome = nil, nil
  return robot.of(description)
end

-- ---- simulating ---------------------------------------------------------------------------------

--- Simulates this robot: it settles, then its muscles run for `duration`.
---@param options? limax.robot.simulate_options
---@return limax.scored_robot
function Robot:simulate(options) return scored_robot.simulate(self, options) end

--- The same, to be taken step by step.
---@param options? limax.robot.simulate_options
---@return limax.robot_in_motion
function Robot:begin(options)
  local simulation, result = prepared.simulation(self, options)
  return robot_in_motion.new(simulation, function() return scored_robot.new(result()) end)
end

--- The plain table that a robot file holds.
---@return limax.robot.description
function Robot:table()
  local description = robot_file.describe(self.population, 1, self.materials, self.description.edge)
  for _, name in ipairs { "scene", "simulation", "fitness", "score", "outcome", "id", "generation",
    "parents", "origin" } do
    description[name] = self.description[name]
  end
  return description
end

--- Writes this robot to a file without loss.
---@param path string
function Robot:save(path) robot_file.write(path, self:table()) end

-- limax.robot(given) is robot.new(given)
return setmetatable(robot, { __call = function(_, given) return robot.new(given) end })
