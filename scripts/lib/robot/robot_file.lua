--- robot_file.lua: one robot as a JSON file, schema limax.robot/1, read and written without loss:
--- lattice, edge, voxels as layers of letters, weights, materials, and all that is needed to
--- simulate it again to the same score.

local body = require "limax.robot.body"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local host = require "limax.host"
local record_rules = require "limax.settings.record_rules"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"

local robot_file = {}

robot_file.schema = "limax.robot/1"

--- The three weights of a voxel, in the engine's order. Each multiplies the material's own number.
robot_file.weights = { "stiffness", "amplitude", "phase" }

---@class limax.robot.description the plain table that a file holds
---@field schema string
---@field lattice integer[] voxels along x, y, z
---@field edge number m
---@field voxels string[][] letters, [z][y], lowest layer first, letters along x
---@field weights table<string, number|number[][][]> one number for all voxels, or [z][y][x]; 0 to 1
---@field control? number[] genes of control
---@field materials table as a material file holds it
---@field scene? table
---@field simulation? table settings, with the rates of the recorded traces as `record`
---@field fitness? any name, { name = ... } or the record of a function
---@field score? number what that fitness gave
---@field outcome? table what the simulation measured
---@field trials? table[] scene and simulation of each trial, and the materials that are its own
---@field id? integer
---@field generation? integer
---@field parents? integer[]
---@field origin? string

-- Nine digits identify a 32-bit float.
local function short(number) return tonumber(("%.9g"):format(number)) end

-- Converts [x][y][z] of the engine to [z][y][x] of a file, or to one number if all are equal.
local function as_layers(grid)
  local same, first = true, short(grid[1][1][1])
  local layers = body.grid({ #grid[1][1], #grid[1], #grid }, function(z, y, x)
    local value = short(grid[x][y][z])
    same = same and value == first
    return value
  end)
  return same and first or layers
end

local function as_grid(layers)
  if type(layers) == "number" then return layers end
  return body.grid({ #layers[1][1], #layers[1], #layers }, function(x, y, z)
    return layers[z][y][x]
  end)
end

--- The materials that a script names, or a copy of those that it made and may change later; the
--- paper's if it names none.
---@param named? string|table|limax.materials
function robot_file.materials(named)
  if type(named) == "table" and named.get then return named:copy() end
  return engine.materials(named or defaults.materials)
end

-- Genes of control as a file holds them; nil without any.
local function control_of(population, i)
  local genes = population:control(i)
  for k = 1, #(genes or {}) do genes[k] = short(genes[k]) end
  return genes
end

--- One robot of an engine's population as a plain table.
---@param edge number m
function robot_file.describe(population, i, materials, edge)
  local layers = body.layers(body.letters(population, i, materials))
  local weights, grids = {}, population:weights(i):table()
  for k, name in ipairs(robot_file.weights) do weights[name] = as_layers(grids[k]) end
  return { schema = robot_file.schema, lattice = { #layers[1][1], #layers[1], #layers },
    edge = edge, voxels = layers, weights = weights, materials = materials:table(),
    control = control_of(population, i) }
end

--- Puts the body of a description into an engine's population, as its robot i.
---@param population limax.population of the description's lattice
function robot_file.place(population, i, description, materials)
  local weights = {}
  for _, name in ipairs(robot_file.weights) do
    weights[name] = as_grid(description.weights[name])
  end
  population:set_body(i, body.lattice(description.voxels, description.lattice), weights, materials)
end

--- An engine's population with the genes of control of these descriptions, still without bodies.
---@param descriptions limax.robot.description[] with as many genes of control each
function robot_file.population(descriptions, lattice)
  local count = #(descriptions[1].control or {})
  local options = { lattice = lattice, count = #descriptions }
  if count == 0 then return engine.population(options) end
  options.encoding = engine.encoding { lattice = lattice, network = "none", genes = 0,
    control_genes = count }
  local population = engine.population(options)
  local genes = population:control_view()
  for i, description in ipairs(descriptions) do
    for k = 1, count do genes[i][k] = description.control[k] end
  end
  return population
end

--- The body of a description as an engine's population of one robot, checked.
function robot_file.build(description, materials)
  local population = robot_file.population({ description }, description.lattice)
  robot_file.place(population, 1, description, materials)
  population:check(materials, { require_muscle = false })
  return population
end

--- The rule of a list of genes of control, as 32-bit floats.
robot_file.control_rule = schema.list(schema.number { unit = "", minimum = -3.4028234663852886e38,
  maximum = 3.4028234663852886e38 }, { most = 4096, expected = "a list of at most 4096 numbers" })

local function schema_rule(value, path)
  if value == robot_file.schema then return value end
  return nil, ("%s: expected %q, got %s"):format(path, robot_file.schema, schema.show(value))
end

local weight = schema.number { value = 1, unit = "1", minimum = 0, maximum = 1,
  reason = "the material's own number" }
local count = schema.number { unit = "", minimum = 0, maximum = 2 ^ 53, integer = true }
local number = schema.number { unit = "" }
local letters = schema.list(schema.text("[^%s]+", "a line of letters"),
  { expected = "a layer: a list of lines of letters" })

local optional, required = settings.optional, schema.required

-- The settings and the rates of the traces, which an experiment has in two tables.
local function simulation_rule(value, path)
  if type(value) ~= "table" then return schema.table(value, path) end
  local own = {}
  for name, entry in pairs(value) do own[name] = name ~= "record" and entry or nil end
  local _, message = settings.simulation(own, path)
  if not message and value.record ~= nil then
    message = select(2, settings.record(value.record, path .. ".record"))
  end
  if message then return nil, message end
  return value
end

local trial_rule = schema.fields { scene = required(schema.table),
  simulation = required(simulation_rule), materials = schema.table }

local check_fields = schema.fields {
  schema = schema_rule,
  lattice = required(settings.lattice()),
  edge = schema.number(defaults.fields.simulation.edge),
  voxels = required(schema.list(letters, { expected = "a list of layers" })),
  weights = required(schema.table),
  control = robot_file.control_rule,
  materials = required(schema.table),
  scene = schema.table,
  simulation = simulation_rule,
  trials = schema.list(trial_rule, { expected = "a list of trials" }),
  fitness = schema.any,
  score = optional(number),
  outcome = record_rules.outcome,
  id = optional(count), generation = optional(count),
  parents = schema.list(count, { most = 2, expected = "a list of ids" }),
  origin = schema.text("[%w_ ]+", "a word"),
}

-- One weight of every voxel: a number, or [z][y][x] of the lattice's size.
local function weight_rule(lattice)
  local function list(rule, axis, what)
    local count_of = lattice[axis]
    return schema.list(rule, { count = count_of, expected = what:format(count_of) })
  end
  local line = list(weight, 1, "%d numbers along x")
  local layers = list(list(line, 2, "%d lines along y"), 3, "%d layers along z")
  return function(value, path)
    if type(value) == "table" then return layers(value, path) end
    return weight(value, path)
  end
end

-- An object of the engine; nil, message without the place in this file.
local function made(make, value)
  local ok, object = pcall(make, value)
  if ok then return object end
  return nil, "robot." .. (tostring(object):gsub("^[^\n]-:%d+: ", ""))
end

--- Checks a decoded file as a whole; `nil, message` on the first field that is wrong.
---@return limax.robot.description|nil
---@return string|nil message
---@return limax.materials|nil
function robot_file.check(decoded)
  local description, message = check_fields(decoded, "robot")
  if not description then return nil, message end
  local lattice = description.lattice
  local rule = weight_rule(lattice)
  local check_weights = schema.fields { stiffness = rule, amplitude = rule, phase = rule }
  description.weights, message = check_weights(description.weights, "robot.weights")
  if not description.weights then return nil, message end

  local materials
  materials, message = made(engine.materials, description.materials)
  if message then return nil, message end
  for k = 0, #(description.trials or {}) do
    local world = k == 0 and description or description.trials[k]
    local scene, refusal = made(engine.scene, world.scene or {})
    if not scene then return nil, refusal end
    scene:free()
    refusal = world.materials and select(2, made(engine.materials, world.materials))
    if refusal then return nil, refusal end
  end
  local size
  size, message = body.measure_layers(description.voxels, materials)
  if not size then return nil, "robot.voxels: " .. message end
  for axis = 1, 3 do
    if size[axis] ~= lattice[axis] then
      return nil, ("robot.voxels: the lattice is %d x %d x %d voxels, the letters %d x %d x %d")
        :format(lattice[1], lattice[2], lattice[3], size[1], size[2], size[3])
    end
  end
  return description, nil, materials
end

--- Reads a robot file. An error raises at the user's line, with file, field, value and range.
---@return limax.robot.description
---@return limax.materials
function robot_file.read(path)
  local text, refusal = source.read(path)
  if not text then engine.fail(("robot file %s"):format(refusal)) end
  local decoded, message = host.json.decode(text, path)
  if decoded == nil and not text:find "^%s*{" then
    engine.fail(("%s is not a robot file, which is JSON: robot:save(FILE) and limax convert write"
      .. " one"):format(path))
  end
  if decoded == nil then engine.fail(message) end
  local description, wrong, materials = robot_file.check(decoded)
  if not description then engine.fail(("%s: %s"):format(path, wrong)) end
  return description, materials
end

--- The text of a robot file.
function robot_file.text(description)
  return host.json.encode(description, { indent = 2 }) .. "\n"
end

--- Writes a robot file, whole or not at all.
function robot_file.write(path, description)
  schema.demand(schema.path, path, "save: path")
  local ok, message = host.file.write_atomic(path, robot_file.text(description))
  if not ok then engine.fail(message) end
end

return robot_file
