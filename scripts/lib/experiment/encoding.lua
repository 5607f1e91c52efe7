--- encoding.lua: encodings, which turn genes into bodies. An encoding is a table of functions that
--- work on many robots at once (batch.lua); the engine does what it leaves out. `genome = {
--- encoding = "cppn" }` names one of the library, `{ "symmetric", of = "cppn" }` gives it options,
--- and a table with `genes` and `express` is a script's own.

local choice = require "limax.base.choice"
local engine = require "limax.engine"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local encoding = strict.module "limax.encoding"

---@class limax.encoding.definition
---@field name string
---@field network "fourier"|"cppn"|"direct"|nil of the engine, which then counts the genes
---@field genes integer|fun(context: limax.encoding.context): integer of a robot, without a network
---@field initialize? fun(robots: limax.batch) the genes of new robots; else N(0, initial_scale^2)
---@field control_genes integer|nil that follow the others; of the scene's controller
---@field express fun(robots: limax.batch) genes to voxels and weights
---@field cross? fun(robots: limax.batch) genes of the parents to genes of the offspring
---@field mutate? fun(robots: limax.batch) changes the genes of the offspring

---@class limax.encoding.context
---@field lattice integer[] voxels along x, y, z
---@field voxels integer of a lattice
---@field materials integer number of materials, the empty one included
---@field get fun(spec: any): limax.encoding.definition another encoding

--- The encodings of the library, by name: their options, and the fields of `genome` that they use.
---@type table<string, limax.choice.entry>
encoding.entries = {}

-- An encoding of the engine.
local function by_engine(network, ...)
  local fields = { initial_scale = true }
  for _, name in ipairs { ... } do fields[name] = true end
  return { fields = fields, make = function() return { network = network } end }
end

--- fourier: the paper's network, which reads the Gaussian positional encoding of a voxel's centre.
--- Tancik et al., "Fourier features let networks learn high frequency functions in low dimensional
--- domains", 2020.
encoding.entries.fourier = by_engine("fourier", "features", "sigma", "hidden")

--- cppn: a network that reads the centre itself and its distance from the middle, and has periodic
--- and Gaussian units, which repeat and mirror patterns. Stanley, "Compositional pattern producing
--- networks: a novel abstraction of development", 2007.
encoding.entries.cppn = by_engine("cppn", "hidden")

--- direct: every voxel has a gene for each material, of which the largest wins, and one for each
--- weight, which passes through a logistic function.
encoding.entries.direct = by_engine "direct"

--- symmetric: the bodies of another encoding, `of`, mirrored along an axis.
encoding.entries.symmetric = require "limax.experiment.encodings.symmetric"

--- l_system: a body that grows by rewriting words of a small grammar, in Lua only.
encoding.entries.l_system = require "limax.experiment.encodings.l_system"

local function a_function(value, path)
  if value == nil or type(value) == "function" then return value end
  return nil, ("%s: expected a function, got %s"):format(path, schema.show(value))
end

local function genes_rule(value, path)
  if type(value) == "function" then return value end
  return schema.required(schema.whole(1, 1e6))(value, path)
end

local own_fields = schema.fields { name = schema.string, genes = genes_rule,
  initialize = a_function, express = schema.required(a_function), cross = a_function,
  mutate = a_function }

-- The definition of a script's own encoding.
local function own(spec, context)
  local definition, message = own_fields(spec, "genome.encoding")
  if not definition then engine.fail(message) end
  definition.name = definition.name or "function"
  if type(definition.genes) == "function" then
    local count = definition.genes(context)
    definition.genes, message = schema.required(schema.whole(1, 1e6))(count,
      "genome.encoding.genes: its result")
    if message then engine.fail(message) end
  end
  return definition
end

--- The fields of `genome` besides `require_muscle` that an encoding uses.
---@param spec any
---@return table<string, true>
function encoding.fields(spec)
  if type(spec) == "table" and spec[1] == nil then return { initial_scale = true } end
  local entry = encoding.entries[choice.read("genome.encoding", spec, encoding.entries)]
  if entry.fields then return entry.fields end
  -- one that wraps another
  return encoding.fields(type(spec) == "table" and spec.of or "fourier")
end

local shape_rule = schema.record { lattice = schema.required(schema.numbers(3)),
  materials = schema.required(schema.number {}) }

--- The encoding that an experiment names.
---@param spec string|table
---@param shape { lattice: integer[], materials: integer }
---@return limax.encoding.definition
function encoding.get(spec, shape)
  schema.demand(shape_rule, shape, "limax.encoding.get: shape")
  local context = { lattice = shape.lattice, materials = shape.materials,
    voxels = shape.lattice[1] * shape.lattice[2] * shape.lattice[3],
    get = function(inner) return encoding.get(inner, shape) end }
  if type(spec) == "table" and spec[1] == nil then return own(spec, context) end
  if type(spec) == "function" then
    engine.fail("genome.encoding: expected a name or a table, got a function; write "
      .. "{ genes = n, express = function(robots) ... end }")
  end
  local name, options = choice.read("genome.encoding", spec, encoding.entries)
  local definition = encoding.entries[name].make(options, context)
  definition.name = name
  definition.by_engine = definition.express == nil
  definition.express = definition.express or function(robots) robots:express() end
  return definition
end

--- The engine's encoding of a definition.
---@param definition limax.encoding.definition
---@param genome table the fields of an experiment's `genome`
---@param shape { lattice: integer[], materials: integer, seed: any, repetition: integer }
---@return limax.encoding
function encoding.of_engine(definition, genome, shape)
  local what = "limax.encoding.of_engine: "
  schema.demand(schema.table, definition, what .. "definition")
  schema.demand(schema.table, genome, what .. "genome")
  schema.demand(schema.table, shape, what .. "shape")
  return engine.encoding { network = definition.network or "none", genes = definition.genes,
    features = genome.features, sigma = genome.sigma, hidden = genome.hidden,
    initial_scale = genome.initial_scale, control_genes = definition.control_genes,
    control_spread = genome.control_spread, lattice = shape.lattice, materials = shape.materials,
    seed = shape.seed, repetition = shape.repetition }
end

return strict.close("limax.encoding", encoding)
