--- bodies.lua: the class of populations, with the methods that concern bodies: materials and
--- weights of each voxel. Voxels are material indices as the engine stores them: from 0, the empty
--- one. population.lua adds the other methods.

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
local class = object.class("population", "population")
local methods = class.methods

local WEIGHTS = { "stiffness", "amplitude", "phase" }
local MOST_MATERIALS = tonumber(C.LIMAX_MAX_MATERIALS)
local materials_rule = schema.whole(1, MOST_MATERIALS, MOST_MATERIALS)
local WEIGHT = { minimum = 0, maximum = 1 }
local weight_rule = schema.number(WEIGHT)
local weights_rule =
  schema.fields { stiffness = schema.any, amplitude = schema.any, phase = schema.any }

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
---@field control number|nil the same of the genes of control, which genotype leaves out
---@field distinct integer different bodies
---@field robots integer
---@field material_shares number[] of each material over all voxels, the empty one first

local function voxels_of(handle, what)
  return abi.pointer(C.limax_population_voxels(handle), what)
end
local function weights_of(handle, what)
  return abi.pointer(C.limax_population_weights(handle), what)
end

-- Writes the number of each voxel, as `rule` reads it, to `target`. `voxels` is a flat list (x runs
-- fastest, then y, then z), or nested lists or a view [x][y][z].
local function write_voxels(target, what, voxels, lattice, rule)
  local nx, ny, nz = lattice[1], lattice[2], lattice[3]
  local function list(entry_rule, count)
    return schema.list(entry_rule, { count = count, expected = ("a list of %d"):format(count) })
  end
  if view.is_view(voxels) then voxels = voxels:table() end
  if type(voxels) ~= "table" then schema.refuse(what, "a list of voxels", voxels) end
  if type(voxels[1]) ~= "table" then
    for i, number in ipairs(schema.demand(list(rule, nx * ny * nz), voxels, what)) do
      target[i - 1] = number
    end
    return
  end
  for x, plane in ipairs(schema.demand(list(list(list(rule, nz), ny), nx), voxels, what)) do
    for y, row in ipairs(plane) do
      for z, number in ipairs(row) do
        target[x - 1 + nx * (y - 1 + ny * (z - 1))] = number
      end
    end
  end
end

-- The rule of a voxel of a script, an index, letter or name: gives the material index.
local function material_rule(table_of_materials)
  local most, indices = tonumber(C.LIMAX_MAX_MATERIALS) - 1, {}
  return function(value, path)
    if type(value) == "number" and value >= 0 and value <= most and value == math.floor(value) then
      return value
    end
    local expected = ("a material index from 0 to %d%s"):format(most, table_of_materials
      and ", a letter or a name" or "; letters need the material table as fourth argument")
    if type(value) == "string" and table_of_materials then
      indices[value] = indices[value] or table_of_materials:index(value)
      if indices[value] then return indices[value] - 1 end
      expected = "a material of " .. tostring(table_of_materials)
    end
    return nil, ("%s: expected %s, got %s"):format(path, expected, schema.show(value))
  end
end

--- Material indices of robot i, from 0 (the empty one).
---@param i integer
---@return limax.view [x][y][z]
function methods:voxels(i)
  local handle, robot = object.entry("population:voxels", self, class, i)
  local n, data = self.extent, voxels_of(handle, "population:voxels") + robot * self.voxels_each
  return view.new(self, "voxels", "uint8_t", data, { n[1], n[2], n[3] },
    { strides = { 1, n[1], n[1] * n[2] }, life = self.bodies_life })
end

-- The voxels of some robots as texts, and the size of each, with a line end and a zero byte at its
-- end.
local function texts_of(self, handle, first, count, letters)
  local n = self.extent
  local all = ffi.new("char[?]", C.LIMAX_MAX_MATERIALS, letters)
  local size = (n[1] + 1) * n[2] * n[3] + n[3]
  local out = ffi.new("char[?]", math.max(1, count * size))
  abi.check(C.limax_population_text(handle, first, count, all, out), "population:text")
  return out, size
end

--- The voxels of robot i as text: a letter for each, lines along x, an empty line between layers,
--- the lowest first.
---@param i integer
---@param letters string of all materials, the empty one first
---@return string
function methods:text(i, letters)
  local what = "population:text"
  local handle, first = object.entry(what, self, class, i)
  schema.demand(schema.string, letters, what .. ": letters")
  local out, size = texts_of(self, handle, first, 1, letters)
  local text = ffi.string(out, size - 2)
  if text:find("%z") then
    schema.refuse(what .. ": letters", "a letter for each material", letters)
  end
  return text
end

--- The same of all robots, in memory: char[count][size], each with a line end and a zero byte at
--- its end, and the size.
function class.texts(self, letters)
  return texts_of(self, object.handle("texts", self, class), 0, self.count, letters)
end

--- The bodies of all robots: limax_body[count] of the engine.
function class.shapes(self)
  return abi.pointer(C.limax_population_bodies(object.handle("shapes", self, class)), "shapes")
end

-- Ends all views of bodies.
function class.end_bodies(self, why)
  object.end_views(self.bodies_life, why)
  object.end_views(self.writing_life, why)
end

-- A view through which a script writes the array that `read` returns for the population, of robot i
-- or of all; `shape` is that of a robot. The bodies are unknown until they are checked.
local function writable(self, what, noun, i, read, element, shape, range)
  local handle = object.handle(what, self, class)
  local first = i and schema.index(what, i, self.count) - 1 or 0
  local data = read(handle, what)
  abi.check(C.limax_population_forget(handle, first, i and 1 or self.count), what)
  local each = 1
  for _, length in ipairs(shape) do each = each * length end
  if i then
    noun, data = ("%s of robot %d"):format(noun, i), data + first * each
  else
    table.insert(shape, 1, self.count)
  end
  return view.new(self, noun, element, data, shape, { life = self.writing_life, range = range })
end

--- Material indices, from 0 (the empty one), for a script to write: `view[voxel] = material`, voxel
--- = 1 + x + nx (y + ny z) with x, y, z from 0. The body is unknown until `population:check`, which
--- ends the view, as express, set_body and free do.
---@param i integer|nil the robot; all if left out
---@param count integer|nil of materials; as many as a table can have if left out
---@return limax.view [voxel], or [robot][voxel] of all
function methods:voxels_view(i, count)
  local what = "population:voxels_view"
  local most = schema.demand(materials_rule, count, what .. ": count") - 1
  return writable(self, what, "voxels", i, voxels_of, "uint8_t", { self.voxels_each },
    { minimum = 0, maximum = most, integer = true })
end

--- Stiffness, amplitude and phase, 0 to 1, for a script to write: `view[1][voxel] = weight`; voxels
--- and end as for `voxels_view`.
---@param i integer|nil the robot; all if left out
---@return limax.view [3][voxel], or [robot][3][voxel] of all
function methods:weights_view(i)
  return writable(self, "population:weights_view", "weights", i, weights_of, "float",
    { 3, self.voxels_each }, WEIGHT)
end

--- Weights of robot i: stiffness, amplitude and phase of each voxel, 0 to 1.
---@param i integer
---@return limax.view [3][x][y][z]
function methods:weights(i)
  local handle, robot = object.entry("population:weights", self, class, i)
  local n, each = self.extent, self.voxels_each
  local data = weights_of(handle, "population:weights") + 3 * robot * each
  return view.new(self, "weights", "float", data, { 3, n[1], n[2], n[3] },
    { strides = { each, 1, n[1], n[1] * n[2] }, life = self.bodies_life })
end

--- The body of robot i: status, counts, size, as `express` or `check` found them.
---@param i integer
---@return limax.body
function methods:body(i)
  local handle, robot = object.entry("population:body", self, class, i)
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
  local handle, robot = object.entry("population:set_body", self, class, i)
  if table_of_materials ~= nil then
    object.handle("population:set_body: materials", table_of_materials, materials.class)
  end
  local each = self.voxels_each
  -- read everything before writing anything, so that an error changes nothing
  local new_voxels, new_weights = ffi.new("uint8_t[?]", each), ffi.new("float[?]", 3 * each)
  write_voxels(new_voxels, "voxels", voxels, self.extent, material_rule(table_of_materials))
  if view.is_view(weights) then
    weights = { stiffness = weights[1], amplitude = weights[2], phase = weights[3] }
  end
  weights = schema.demand(weights_rule, weights, "weights")
  for w, name in ipairs(WEIGHTS) do
    local own = weights[name]
    if own == nil then own = 1 end
    if type(own) == "number" then
      local all = {}
      for voxel = 1, each do all[voxel] = own end
      own = all
    end
    write_voxels(new_weights + (w - 1) * each, "weights." .. name, own, self.extent, weight_rule)
  end
  ffi.copy(voxels_of(handle, "population:set_body") + robot * each, new_voxels, each)
  ffi.copy(weights_of(handle, "population:set_body") + 3 * robot * each, new_weights,
    3 * each * ffi.sizeof "float")
  abi.check(C.limax_population_forget(handle, robot, 1), "population:set_body")
  class.end_bodies(self, "a body of its population was set")
end

-- A list of robots as the engine counts them, and its length.
local function set_of(self, robots)
  local count = #schema.demand(schema.table, robots, "population:diversity")
  local list = ffi.new("int32_t[?]", math.max(count, 1))
  for k = 1, count do
    list[k - 1] =
      schema.index("population:diversity: robot %d of the list", robots[k], self.count, k) - 1
  end
  return list, count
end

-- The engine's diversity for scripts.
local function shown(self, out)
  local shares = {}
  for m = 1, self.materials_count do shares[m] = out.material_shares[m - 1] end
  return {
    hamming = out.hamming, distinct = out.distinct, robots = out.robots, material_shares = shares,
    genotype = out.genotype == out.genotype and out.genotype or nil,
    control = out.control == out.control and out.control or nil,
  }
end

--- The diversity of the bodies and genomes of some robots, in time linear in their number.
---@param robots integer[]
---@return limax.diversity
function methods:diversity(robots)
  local handle = object.handle("population:diversity", self, class)
  local list, count = set_of(self, robots)
  if count == 0 then
    fault.raise "population:diversity: expected a list of robots, got an empty one"
  end
  local out = ffi.new "limax_diversity"
  abi.check(C.limax_population_diversity(handle, list, count, out), "population:diversity")
  return shown(self, out)
end

--- The largest absolute gene of some robots of this population, of which others have more.
function class.largest_gene(self, robots)
  local list, count = set_of(self, robots)
  local out = ffi.new "float[1]"
  abi.check(C.limax_population_largest_gene(self.handle, list, count, out), "largest_gene")
  return out[0]
end

--- Sums of these robots, int64_t[size], and the size. `largest` is the gene of all populations.
function class.sums(self, robots, largest)
  local list, count = set_of(self, robots)
  local size = tonumber(C.limax_population_sums_size(self.handle))
  local sums = ffi.new("int64_t[?]", size)
  abi.check(C.limax_population_sums(self.handle, list, count, largest, sums), "sums")
  return sums, size
end

--- How many of these hashes of bodies differ, uint64_t[count].
---@return integer
function class.distinct(hashes, count)
  local out = ffi.new "int32_t[1]"
  abi.check(C.limax_distinct(hashes, count, out), "distinct")
  return out[0]
end

--- The diversity of `count` robots of several populations of this kind.
---@param sums ffi.cdata* int64_t[size], added up
---@param distinct integer different bodies
---@return limax.diversity
function class.diversity_of(self, sums, largest, distinct, count)
  local out = ffi.new "limax_diversity"
  abi.check(C.limax_population_diversity_of(self.handle, sums, largest, distinct, count, out),
    "diversity_of")
  return shown(self, out)
end

return class
