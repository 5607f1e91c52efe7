--- encoding.lua: how a genome is read: the Gaussian positional encoding of the voxel centres and
--- the layers of the network. The encoding is drawn once for a seed and repetition.

local ffi = require "ffi"
local C = require("limax.engine.abi").C
local fields = require "limax.engine.fields"
local object = require "limax.engine.object"
local schema = require "limax.engine.schema"
local view = require "limax.engine.view"

local class = object.class("encoding", "encoding")
local methods = class.methods

-- lengths and counts of the interface are 32-bit
local MOST = 2147483647

local lattice_rule = schema.numbers(3, { integer = true })
local genome = fields.of "genome"
local hidden_width = genome.hidden.value

-- Options that an experiment's `genome` has too.
local genome_rules = {
  features = schema.field(genome.features), sigma = schema.field(genome.sigma),
  hidden = schema.list(schema.field(genome.hidden), { most = tonumber(C.LIMAX_MAX_HIDDEN),
    default = { hidden_width, hidden_width }, expected = "a list of up to 8 layer widths" }),
  initial_scale = schema.field(genome.initial_scale),
}
local options_rule = schema.fields {
  lattice = lattice_rule, features = genome_rules.features, sigma = genome_rules.sigma,
  hidden = genome_rules.hidden, initial_scale = genome_rules.initial_scale,
  materials = schema.whole(-MOST, MOST, 5), seed = schema.seed,
  repetition = schema.whole(1, MOST, 1),
}

---@class limax.encoding : limax.object
---@field genes integer numbers in a genome
---@field lattice integer[]
---@field features_count integer m, rows of the matrix

---@class limax.encoding_options
---@field lattice integer[] voxels along x, y, z
---@field features integer|nil m, rows of the matrix; 16
---@field sigma number|nil standard deviation of its entries; 1
---@field hidden integer[]|nil width of each hidden layer; { 32, 32 }
---@field materials integer|nil classes of the softmax; 5
---@field initial_scale number|nil factor on the initial weights; 1
---@field seed number|string|nil 1
---@field repetition integer|nil 1

--- Makes an encoding.
---@param options limax.encoding_options
---@return limax.encoding
local function encoding(options)
  options = schema.demand(options_rule, options, "encoding")
  local o = ffi.new "limax_encoding_options"
  local lattice = schema.demand(lattice_rule, options.lattice, "encoding.lattice")
  for axis = 1, 3 do o.lattice[axis - 1] = lattice[axis] end
  o.hidden_count = #options.hidden
  for i, width in ipairs(options.hidden) do o.hidden[i - 1] = width end
  for _, name in ipairs { "features", "sigma", "initial_scale", "materials", "repetition" } do
    o[name] = options[name]
  end
  o.seed = schema.uint64(options.seed or 1, "encoding.seed")
  local self = object.make(class, "encoding",
    function(out) return C.limax_encoding_create(o, out) end,
    { lattice = lattice, features_count = o.features,
      voxels = lattice[1] * lattice[2] * lattice[3] })
  object.set(self, "genes", C.limax_encoding_genes(self.handle))
  return self
end

--- B, the matrix of the encoding.
---@return limax.view [feature][3]
function methods:matrix()
  local handle = object.handle("encoding:matrix", self, class)
  return view.new(self, "an encoding's matrix", "double", C.limax_encoding_matrix(handle),
    { self.features_count, 3 })
end

--- The network's inputs: the cosine rows, then the sine rows.
---@return limax.view [2 feature][voxel], voxel = 1 + x + nx (y + ny z) with x, y, z from 0
function methods:features()
  local handle = object.handle("encoding:features", self, class)
  return view.new(self, "an encoding's features", "float", C.limax_encoding_features(handle),
    { 2 * self.features_count, self.voxels })
end

return { class = class, encoding = encoding, genome_rules = genome_rules }
