--- bodies.lua: the bodies of a population: materials and weights of each voxel. Voxels are material
--- indices as the engine stores them: from 0, the empty one. Adds its methods to the population's
--- class.

local ffi = require "ffi"
local bit = require "bit"
local abi = require "limax.engine.abi"
local fault = require "limax.engine.fault"
local materials = require "limax.engine.materials"
local names = require "limax.engine.names"
local object = require "limax.engine.object"
local schema = require "limax.engine.schema"
local view = require "limax.engine.view"

local C = abi.C

local WEIGHTS = { "stiffness", "amplitude", "phase" }
local IS_WEIGHT = { stiffness = true, amplitude = true, phase = true }

---@class limax.body
---@field status "unknown"|"valid"|"no voxel"|"no muscle"
---@field voxels integer that are not empty
---@field counts integer[] voxels of each material, the empty one first
---@field masses integer
---@field springs integer
---@field size integer[] extent in voxels along x, y, z
---@field hash string 16 hexadecimal digits; equal bodies have equal hashes

---@class limax.diversity
---@field hamming number mean share of voxels in which two of the robots differ
---@field genotype number|nil root mean square over genes of the deviation; nil without genomes
---@field distinct integer different bodies
---@field robots integer
---@field material_shares number[] of each material over all voxels, the empty one first

local function voxels_of(handle, what)
  return abi.pointer(C.limax_population_voxels(handle), what)
end
local function weights_of(handle, what)
  return abi.pointer(C.limax_population_weights(handle), what)
end

-- Calls `take(offset, value)` for each voxel of `voxels`: a flat list (x runs fastest, then y, then
-- z), or nested lists or a view [x][y][z].
local function each_voxel(what, voxels, lattice, take)
  local nx, ny, nz = lattice[1], lattice[2], lattice[3]
  if view.is_view(voxels) then voxels = voxels:table() end
  if type(voxels) ~= "table" then schema.refuse(what, "a list of voxels", voxels) end
  local function length(place, list, expected)
    local count = type(list) == "table" and #list
    if count ~= expected then
      schema.refuse(place, ("a list of %d"):format(expected), list, count)
    end
  end
  if type(voxels[1]) ~= "table" then
    length(what, voxels, nx * ny * nz)
    for i = 1, nx * ny * nz do take(i - 1, voxels[i], what, i) end
    return
  end
  length(what, voxels, nx)
  for x = 1, nx do
    length(("%s[%d]"):format(what, x), voxels[x], ny)
    for y = 1, ny do
      length(("%s[%d][%d]"):format(what, x, y), voxels[x][y], nz)
      for z = 1, nz do take(x - 1 + nx * (y - 1 + ny * (z - 1)), voxels[x][y][z], what, x, y, z) end
    end
  end
end

local function place(what, x, y, z)
  return y and ("%s[%d][%d][%d]"):format(what, x, y, z) or ("%s[%d]"):format(what, x)
end

-- A function that turns a voxel of a script, an index, letter or name, into a material index.
local function material_reader(table_of_materials)
  local index_of
  return function(value, what, x, y, z)
    if type(value) == "number" and value >= 0 and value < C.LIMAX_MAX_MATERIALS
      and value == math.floor(value) then
      return value
    end
    if type(value) == "string" and table_of_materials then
      if not index_of then
        index_of = {}
        for i = 1, table_of_materials.count do
          local material = table_of_materials:get(i)
          index_of[material.letter], index_of[material.name] = i - 1, i - 1
        end
      end
      if index_of[value] then return index_of[value] end
      schema.refuse(place(what, x, y, z), "a material of " .. tostring(table_of_materials),
        value)
    end
    local most = tonumber(C.LIMAX_MAX_MATERIALS) - 1
    schema.refuse(place(what, x, y, z), ("a material index from 0 to %d%s"):format(most,
      table_of_materials and ", a letter or a name"
        or "; letters need the material table as fourth argument"), value)
  end
end

local function weight_taker(target)
  return function(offset, value, what, x, y, z)
    if type(value) ~= "number" or not (value >= 0 and value <= 1) then
      schema.refuse(place(what, x, y, z), "a weight from 0 to 1", value)
    end
    target[offset] = value
  end
end

--- Adds the methods that concern bodies.
---@param class table the population's
return function(class)
  local methods = class.__index

  local function index(self, what, i)
    local handle = object.handle(what, self, class)
    schema.index(what, i, self.count)
    return handle, i - 1
  end

  --- Material indices of robot i, from 0 (the empty one).
  ---@param i integer
  ---@return limax.view [x][y][z]
  function methods:voxels(i)
    local handle, robot = index(self, "population:voxels", i)
    local n = self.lattice
    return view.new {
      what = "voxels", data = voxels_of(handle, "population:voxels") + robot * self.voxels_each,
      element = "uint8_t", shape = { n[1], n[2], n[3] }, strides = { 1, n[1], n[1] * n[2] },
      life = self.bodies_life, owner = self,
    }
  end

  --- The voxels of robot i as text: a letter for each, lines along x, an empty line between layers,
  --- the lowest first.
  ---@param i integer
  ---@param letters string of all materials, the empty one first
  ---@return string
  function methods:text(i, letters)
    local handle, robot = index(self, "population:text", i)
    schema.demand(schema.string, letters, "population:text: letters")
    local n = self.lattice
    local all = ffi.new("char[?]", C.LIMAX_MAX_MATERIALS, letters)
    local size = (n[1] + 1) * n[2] * n[3] + n[3]
    local out = ffi.new("char[?]", size)
    abi.check(C.limax_population_text(handle, robot, all, out), "population:text")
    local text = ffi.string(out)
    -- less the last line end, and the zero byte after it
    if #text ~= size - 2 then
      schema.refuse("population:text: letters", "a letter for each material", letters)
    end
    return text
  end

  --- Weights of robot i: stiffness, amplitude and phase of each voxel, 0 to 1.
  ---@param i integer
  ---@return limax.view [3][x][y][z]
  function methods:weights(i)
    local handle, robot = index(self, "population:weights", i)
    local n, each = self.lattice, self.voxels_each
    return view.new {
      what = "weights", data = weights_of(handle, "population:weights") + 3 * robot * each,
      element = "float", shape = { 3, n[1], n[2], n[3] },
      strides = { each, 1, n[1], n[1] * n[2] }, life = self.bodies_life, owner = self,
    }
  end

  --- What is known about the body of robot i after `express` or `check`.
  ---@param i integer
  ---@return limax.body
  function methods:body(i)
    local handle, robot = index(self, "population:body", i)
    local body = C.limax_population_bodies(handle) + robot
    local counts = {}
    for m = 1, self.materials_count do counts[m] = body.counts[m - 1] end
    return {
      status = names.body_status.text[body.status], voxels = body.voxels, counts = counts,
      masses = body.masses, springs = body.springs, hash = bit.tohex(body.hash, 16),
      size = { body.size[0], body.size[1], body.size[2] },
    }
  end

  --- Writes the body of robot i by hand; call `population:check` before it is simulated.
  ---@param i integer
  ---@param voxels table|limax.view indices from 0, letters, names: [x][y][z], or one list, x first
  ---@param weights table|limax.view|nil { stiffness=, amplitude=, phase= }: numbers or as `voxels`
  ---@param table_of_materials limax.materials|nil what letters and names refer to
  function methods:set_body(i, voxels, weights, table_of_materials)
    local handle, robot = index(self, "population:set_body", i)
    if table_of_materials ~= nil then
      object.handle("population:set_body: materials", table_of_materials, materials.class)
    end
    local each = self.voxels_each
    -- read everything before writing anything, so that an error changes nothing
    local new_voxels = ffi.new("uint8_t[?]", each)
    local read = material_reader(table_of_materials)
    each_voxel("voxels", voxels, self.lattice, function(offset, value, ...)
      new_voxels[offset] = read(value, ...)
    end)
    local new_weights = ffi.new("float[?]", 3 * each)
    if view.is_view(weights) then
      weights = { stiffness = weights[1], amplitude = weights[2], phase = weights[3] }
    end
    weights = schema.demand(schema.table, weights or {}, "weights")
    schema.known(weights, IS_WEIGHT, "weights")
    for w, name in ipairs(WEIGHTS) do
      local own, target = weights[name], new_weights + (w - 1) * each
      local take = weight_taker(target)
      if own == nil then own = 1 end
      if type(own) == "number" then
        for offset = 0, each - 1 do take(offset, own, "weights." .. name, 1) end
      else
        each_voxel("weights." .. name, own, self.lattice, take)
      end
    end
    ffi.copy(voxels_of(handle, "population:set_body") + robot * each, new_voxels, each)
    ffi.copy(weights_of(handle, "population:set_body") + 3 * robot * each, new_weights,
      3 * each * ffi.sizeof "float")
    object.end_views(self.bodies_life, "a body of its population was set")
  end

  --- How different the bodies and genomes of some robots are. Takes time linear in their number.
  ---@param robots integer[]
  ---@return limax.diversity
  function methods:diversity(robots)
    local handle = object.handle("population:diversity", self, class)
    local count = #schema.demand(schema.table, robots, "population:diversity")
    if count == 0 then
      fault.raise "population:diversity: expected a list of robots, got an empty one"
    end
    local list = ffi.new("int32_t[?]", count)
    for k = 1, count do
      list[k - 1] = schema.index(("population:diversity: robot %d of the list"):format(k),
        robots[k], self.count) - 1
    end
    local out = ffi.new "limax_diversity"
    abi.check(C.limax_population_diversity(handle, list, count, out), "population:diversity")
    local shares = {}
    for m = 1, self.materials_count do shares[m] = out.material_shares[m - 1] end
    local genotype = out.genotype
    if genotype ~= genotype then genotype = nil end
    return {
      hamming = out.hamming, genotype = genotype, distinct = out.distinct, robots = out.robots,
      material_shares = shares,
    }
  end
end
