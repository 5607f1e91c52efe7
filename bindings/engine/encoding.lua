--- encoding.lua: how a genome is read: the Gaussian positional encoding of the voxel centres and
--- the layers of the network whose weights the genome is. Drawn once for a seed and repetition.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local arguments = require "limax.engine.arguments"
local memory = require "limax.engine.memory"
local object = require "limax.engine.object"
local view = require "limax.engine.view"

local C = abi.C
local class = object.class("encoding", C.limax_encoding_free)
local methods = class.__index

-- lengths and counts of the interface are 32-bit
local MOST = 2147483647

local OPTIONS = {
  "lattice", "features", "sigma", "hidden", "materials", "initial_scale", "seed", "repetition",
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
  arguments.known("encoding", arguments.table("encoding", options), OPTIONS)
  local o = ffi.new "limax_encoding_options"
  local lattice = arguments.list("encoding: lattice", options.lattice, 3, -MOST, MOST)
  for axis = 1, 3 do o.lattice[axis - 1] = lattice[axis] end
  local function number(name, default)
    local value = options[name]
    return arguments.number("encoding: " .. name, value == nil and default or value)
  end
  local function integer(name, default)
    local value = options[name]
    return arguments.integer("encoding: " .. name, value == nil and default or value, -MOST, MOST)
  end
  o.features, o.sigma = integer("features", 16), number("sigma", 1)
  local hidden = arguments.table("encoding: hidden", options.hidden or { 32, 32 })
  if #hidden > C.LIMAX_MAX_HIDDEN then
    arguments.refuse("encoding: hidden",
      ("at most %d layers"):format(tonumber(C.LIMAX_MAX_HIDDEN)), #hidden)
  end
  o.hidden_count = #hidden
  for i, width in ipairs(hidden) do
    o.hidden[i - 1] = arguments.integer(("encoding: hidden[%d]"):format(i), width, -MOST, MOST)
  end
  o.materials, o.initial_scale = integer("materials", 5), number("initial_scale", 1)
  o.seed = arguments.seed("encoding: seed", options.seed == nil and 1 or options.seed)
  o.repetition = arguments.integer("encoding: repetition", options.repetition or 1, 1, MOST)
  memory.collect()
  local out = ffi.new "limax_encoding *[1]"
  abi.check(C.limax_encoding_create(o, out), "encoding")
  return object.new(class, out[0], {
    genes = C.limax_encoding_genes(out[0]), lattice = lattice, features_count = o.features,
  })
end

--- B, the matrix that voxel centres are multiplied with.
---@return limax.view [feature][3]
function methods:matrix()
  local handle = object.handle("encoding:matrix", self, class)
  return view.new {
    what = "an encoding's matrix", data = C.limax_encoding_matrix(handle), element = "double",
    shape = { self.features_count, 3 }, life = self.life, owner = self,
  }
end

--- The network's inputs: the cosine rows, then the sine rows.
---@return limax.view [2 feature][voxel], voxel = 1 + x + nx (y + ny z) with x, y, z from 0
function methods:features()
  local handle = object.handle("encoding:features", self, class)
  local lattice = self.lattice
  return view.new {
    what = "an encoding's features", data = C.limax_encoding_features(handle), element = "float",
    shape = { 2 * self.features_count, lattice[1] * lattice[2] * lattice[3] },
    life = self.life, owner = self,
  }
end

return { class = class, encoding = encoding }
