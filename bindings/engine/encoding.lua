--- encoding.lua: encodings of genomes: the inputs that a network computes from the voxel centres,
--- and its layers. The positional encoding is drawn once for a seed and repetition.

local ffi = require "ffi"
local C = require("limax.engine.abi").C
local fault = require "limax.engine.fault"
local fields = require "limax.engine.fields"
local names = require "limax.engine.names"
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
  control_spread = schema.field(genome.control_spread),
}
local options_rules = {
  lattice = lattice_rule, materials = schema.whole(-MOST, MOST, 5), seed = schema.seed,
  repetition = schema.whole(1, MOST, 1), network = schema.choice(names.network.names),
  genes = schema.whole(0, 2 ^ 24), control_genes = schema.whole(0, 4096, 0),
}
for name, rule in pairs(genome_rules) do options_rules[name] = rule end
local options_rule = schema.fields(options_rules)

---@class limax.encoding : limax.object
---@field genes integer numbers in a genome
---@field control_genes integer the last of these, which give no body
---@field lattice integer[]
---@field network string
---@field features_count integer m, rows of the matrix; 0 if the network has none

---@class limax.encoding_options
---@field lattice integer[] voxels along x, y, z
---@field network "fourier"|"cppn"|"direct"|"none"|nil what the genes are; "fourier"
---@field genes integer|nil of a genome of network "none", without those of control
---@field control_genes integer|nil that follow the others in a genome, 0 to 4096; 0
---@field control_spread number|nil standard deviation of their initial values; 0
---@field features integer|nil m, rows of the matrix, of "fourier"; 16
---@field sigma number|nil standard deviation of its entries; 0.15
---@field hidden integer[]|nil width of each hidden layer, of "fourier" and "cppn"; { 32, 32 }
---@field materials integer|nil classes of the softmax; 5
---@field initial_scale number|nil factor on the initial weights; 1
---@field seed number|string|nil 1
---@field repetition integer|nil 1

--- Makes an encoding: of the Gaussian positional encoding and a network ("fourier"), of a network
--- with sines, Gaussians, tanh and absolute values that reads x, y, z and the distance from the
--- middle ("cppn"), of genes that are the outputs for every voxel ("direct"), or of `genes` numbers
--- from which a script makes the bodies ("none"). Options that a network does not need are ignored.
---@param options limax.encoding_options
---@return limax.encoding
local function encoding(options)
  options = schema.demand(options_rule, options, "encoding")
  local o = ffi.new "limax_encoding_options"
  local lattice = schema.demand(lattice_rule, options.lattice, "encoding.lattice")
  for axis = 1, 3 do o.lattice[axis - 1] = lattice[axis] end
  o.hidden_count = #options.hidden
  for i, width in ipairs(options.hidden) do o.hidden[i - 1] = width end
  for _, name in ipairs { "features", "sigma", "initial_scale", "materials", "repetition",
    "control_genes", "control_spread" } do
    o[name] = options[name]
  end
  options.network = options.network or "fourier"
  o.network = names.network.value[options.network]
  if options.network == "none" then
    o.genes = schema.demand(options_rules.genes, options.genes, "encoding.genes")
  elseif options.genes then
    fault.raise(('encoding.genes: only network "none" takes it; the genes of %q follow from its '
      .. "other options"):format(options.network))
  end
  o.seed = schema.uint64(options.seed or 1, "encoding.seed")
  local self = object.make(class, "encoding",
    function(out) return C.limax_encoding_create(o, out) end,
    { lattice = lattice, network = options.network,
      features_count = options.network == "fourier" and o.features or 0,
      voxels = lattice[1] * lattice[2] * lattice[3] })
  object.set(self, "genes", C.limax_encoding_genes(self.handle))
  object.set(self, "control_genes", C.limax_encoding_control_genes(self.handle))
  return self
end

--- B, the matrix of an encoding of network "fourier".
---@return limax.view [feature][3]
function methods:matrix()
  local handle = object.handle("encoding:matrix", self, class)
  if self.network ~= "fourier" then
    fault.raise(("encoding:matrix: an encoding of network %q has none"):format(self.network))
  end
  return view.new(self, "an encoding's matrix", "double", C.limax_encoding_matrix(handle),
    { self.features_count, 3 })
end

return { class = class, encoding = encoding, genome_rules = genome_rules }
