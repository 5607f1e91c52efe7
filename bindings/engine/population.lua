--- population.lua: many robots of one lattice: their genomes, and (in bodies.lua) their bodies.
--- Robots count from 1.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local device = require "limax.engine.device"
local encoding = require "limax.engine.encoding"
local fault = require "limax.engine.fault"
local fields = require "limax.engine.fields"
local host = require "limax.host"
local materials = require "limax.engine.materials"
local object = require "limax.engine.object"
local schema = require "limax.engine.schema"
local view = require "limax.engine.view"

local C = abi.C
local class = require "limax.engine.bodies"
local methods = class.methods

-- counts of the interface are 32-bit
local MOST = 2147483647

-- range of a gene: that of a float
local FINITE = { minimum = -3.4028234663852886e38, maximum = 3.4028234663852886e38 }

local lattice_rule = schema.numbers(3, { integer = true })
local options_rule = schema.fields {
  lattice = lattice_rule, count = schema.whole(-MOST, MOST),
  encoding = schema.any, before = schema.whole(0, MOST, 0),
}
local breeding_rules = { seed = schema.required(schema.seed),
  repetition = schema.required(schema.whole(1, MOST)),
  generation = schema.required(schema.whole(0, MOST)), elites = schema.whole(0, MOST, 0) }
for name, field in pairs(fields.of "breeding") do
  if name:match "^control_" then
    breeding_rules[name] = schema.field(field)
  else
    field.value = nil -- no default
    breeding_rules[name] = schema.required(schema.field(field))
  end
end
local breeding_rule = schema.fields(breeding_rules)
local check_rule = schema.fields { require_muscle = schema.boolean(false),
  largest_part = schema.boolean(false) }
local express_rule = schema.fields { require_muscle = schema.boolean(false),
  largest_part = schema.boolean(true), device = schema.any }
local generation_rule = schema.whole(0, MOST, 0)

---@class limax.population : limax.object
---@field count integer robots
---@field genes integer numbers in a genome, 0 without an encoding
---@field control_genes integer the last of these, which give no body
---@field lattice integer[] voxels along x, y, z

---@class limax.breeding
---@field mutation_rate number per gene, 0 to 1
---@field mutation_scale number standard deviation of a mutation
---@field crossover_rate number chance of a gene to come from the second parent, 0 to 1
---@field control_mutation_rate number|nil of the genes of control; 0.1, as the next
---@field control_mutation_scale number|nil
---@field seed number|string
---@field repetition integer
---@field generation integer of the children
---@field elites integer|nil children 1 to this are copies of their first parent; 0

--- Makes a population whose genomes are 0 and whose bodies are empty. `before` robots of the
--- generation come before its first: random numbers depend on a robot's number in the generation.
---@param options { lattice: integer[]|nil, count: integer, encoding: limax.encoding|nil,
--- before: integer|nil }
---@return limax.population
local function population(options)
  options = schema.demand(options_rule, options, "population")
  local coder = options.encoding
  local coder_handle = coder ~= nil
    and object.handle("population: encoding", coder, encoding.class) or nil
  local lattice = options.lattice
  if lattice == nil and coder then lattice = coder.lattice end
  lattice = schema.demand(lattice_rule, lattice, "population.lattice")
  local count = schema.demand(schema.number {}, options.count, "population.count")
  local made = object.make(class, "population", function(out)
    return C.limax_population_create(ffi.new("int32_t[3]", lattice), count, coder_handle, out)
  end, {
    count = count, genes = coder and coder.genes or 0,
    control_genes = coder and coder.control_genes or 0, lattice = lattice,
    voxels_each = lattice[1] * lattice[2] * lattice[3], bodies_life = object.life(),
    -- of views through which a script writes bodies
    writing_life = object.life(),
    -- sizes by which memory is read: a script may change the list `lattice`
    extent = { lattice[1], lattice[2], lattice[3] },
    -- of the material table with which bodies were last expressed or checked
    materials_count = tonumber(C.LIMAX_MAX_MATERIALS), lent = false,
  })
  abi.check(C.limax_population_number(made.handle, options.before), "population.before")
  return made
end

-- seconds that one call should take, well below 50 ms
local AIM = 0.015

-- The range of robots that a call names: the first, from 1, and their number, all the rest without
-- a count.
local function range_of(what, total, first, count)
  first = schema.demand(schema.whole(1, math.max(total, 1), 1), first, what .. ": first")
  local rest = total - first + 1
  return first, schema.demand(schema.whole(0, rest, rest), count, what .. ": count")
end

-- Calls `work(first, count)` (first from 0), which returns a status of the engine, over a range of
-- robots (as range_of), in calls short enough for Ctrl-C. The split does not affect results. A GPU
-- receives all genomes before each call where a script can write to them: then there is one call.
---@param at_once? boolean
local function in_ranges(what, total, first, count, work, at_once)
  first, count = range_of(what, total, first, count)
  local at, stop, size = first - 1, first - 1 + count, at_once and count or 8
  while at < stop do
    host.raise_if_interrupted()
    local now = math.min(size, stop - at)
    local started = host.clock()
    abi.check(work(at, now), what)
    at = at + now
    size = math.max(1, math.floor(size * math.min(2, AIM / (host.clock() - started))))
  end
end

local function coded(self, what)
  local handle = object.handle(what, self, class)
  if self.genes == 0 then
    fault.raise(what .. ": this population has no genomes: it was made without an encoding")
  end
  return handle
end

-- The engine's genomes for writing, copied from the GPU if they are there. `lent` until they are
-- made anew: a script may keep the view.
local function genomes_of(self, what)
  object.set(self, "lent", true)
  return abi.pointer(C.limax_population_genomes(coded(self, what)), what)
end

--- Draws random genomes: weights N(0, 1 / fan_in) times the encoding's initial_scale, biases 0; of
--- "direct" and "none" N(0, initial_scale^2); genes of control N(0, control_spread^2). Each
--- generation gives new ones.
---@param first integer|nil
---@param count integer|nil
---@param generation integer|nil of the robots; 0, the first, if left out
---@param on? limax.device the CPU if left out
function methods:initialize(first, count, generation, on)
  local what = "population:initialize"
  local handle = coded(self, what)
  generation = schema.demand(generation_rule, generation, what .. ": generation")
  local target = device.handle(what, on)
  object.end_views(self.life, "its population was initialized")
  object.set(self, "lent", false)
  in_ranges(what, self.count, first, count, function(at, robots)
    return C.limax_population_initialize(handle, generation, target, at, robots)
  end)
end

-- Checks the arguments of `express` and `check`.
local function reading(self, what, table_of_materials, options, rule)
  object.handle(what, self, class)
  object.handle(what .. ": materials", table_of_materials, materials.class)
  options = schema.demand(rule, options, what)
  object.set(self, "materials_count", table_of_materials.count)
  return options.require_muscle and 1 or 0, options.largest_part and 1 or 0, options.device
end

--- Makes bodies of genomes. Only the largest connected part of a body is kept, unless
--- `largest_part` is false.
---@param table_of_materials limax.materials
---@param options? { require_muscle?: boolean, device?: limax.device, largest_part?: boolean }
---@param first integer|nil
---@param count integer|nil
function methods:express(table_of_materials, options, first, count)
  local what = "population:express"
  coded(self, what)
  local muscle, part, on = reading(self, what, table_of_materials, options, express_rule)
  local target, kind = device.handle(what, on)
  class.end_bodies(self, "its population was expressed")
  in_ranges(what, self.count, first, count, function(at, robots)
    return C.limax_population_express(self.handle, table_of_materials.handle, muscle, part, target,
      at, robots)
  end, self.lent and kind == "cuda")
end

--- Determines the status of bodies written by hand. With `largest_part` only the largest connected
--- part of each is kept. Ends the views through which they were written.
---@param table_of_materials limax.materials
---@param options { require_muscle: boolean|nil, largest_part: boolean|nil }|nil
---@param first integer|nil
---@param count integer|nil
function methods:check(table_of_materials, options, first, count)
  local what = "population:check"
  local muscle, part = reading(self, what, table_of_materials, options, check_rule)
  object.end_views(self.writing_life, "its population was checked")
  in_ranges(what, self.count, first, count, function(at, robots)
    return C.limax_population_check(self.handle, table_of_materials.handle, muscle, part, at,
      robots)
  end)
end

-- The parents of children first .. first + children - 1, [child][2] from 0 and from child 1.
local function pairs_of_indices(what, list_of_pairs, first, children, parents)
  local count = #schema.demand(schema.table, list_of_pairs, what .. ": pairs")
  if count ~= children then
    schema.refuse(what .. ": pairs", ("a pair for each of %d children"):format(children),
      list_of_pairs, count)
  end
  local list = ffi.new("int32_t[?]", 2 * (first - 1 + children))
  for child = 1, children do
    local pair = list_of_pairs[child]
    if type(pair) ~= "table" or #pair ~= 2 then
      schema.refuse(("%s: pairs[%d]"):format(what, child), "a list of 2 indices", pair,
        type(pair) == "table" and #pair)
    end
    for k = 1, 2 do
      list[2 * (first + child) - 5 + k] =
        schema.index("%s: pairs[%d][%d]", pair[k], parents, what, child, k) - 1
    end
  end
  return list
end

--- Writes this population's genomes, or those of a range of robots: elites are copies of their
--- first parent, the others cross and mutate. The random numbers of a child depend on its index,
--- not on the range.
---@param parents limax.population
---@param pairs_of_parents integer[][] { i, j } for each child of the range
---@param options limax.breeding
---@param on limax.device|nil
---@param first integer|nil
---@param count integer|nil
function methods:breed(parents, pairs_of_parents, options, on, first, count)
  local what = "population:breed"
  coded(self, what)
  coded(parents, what .. ": parents")
  first, count = range_of(what, self.count, first, count)
  local list = pairs_of_indices(what, pairs_of_parents, first, count, parents.count)
  local breeding = ffi.new "limax_breeding"
  for name, value in pairs(schema.demand(breeding_rule, options, what)) do
    breeding[name] = name == "seed" and schema.uint64(value, what .. ".seed") or value
  end
  local target, kind = device.handle(what, on)
  object.end_views(self.life, "its population was bred")
  object.set(self, "lent", false)
  in_ranges(what, self.count, first, count, function(at, robots)
    return C.limax_population_breed(self.handle, parents.handle, list, breeding, target, at, robots)
  end, parents.lent and kind == "cuda")
end

--- Genome of robot i.
---@param i integer
---@return limax.view [gene]
function methods:genome(i)
  local genomes = genomes_of(self, "population:genome")
  schema.index("population:genome", i, self.count)
  return view.new(self, "a genome", "float", genomes + (i - 1) * self.genes, { self.genes })
end

-- What a view of genes accepts.
local function writing_range(refusal)
  return refusal and { minimum = math.huge, maximum = -math.huge, refusal = refusal } or FINITE
end

--- Genomes for a script to write: `view[gene] = x` takes finite numbers. Express the robots after
--- writing. Ends when the population is initialized, bred or freed, or its genomes are set.
---@param i integer|nil the robot; all if left out
---@param refusal? string the message of any write, for a view that may only be read
---@return limax.view [gene], or [robot][gene] of all
function methods:genome_view(i, refusal)
  local what = "population:genome_view"
  local genomes = genomes_of(self, what)
  if i ~= nil then genomes = genomes + (schema.index(what, i, self.count) - 1) * self.genes end
  return view.new(self, i and ("genome %d"):format(i) or "genomes", "float", genomes,
    i and { self.genes } or { self.count, self.genes }, { range = writing_range(refusal) })
end

--- The genes of control, the end of each genome, to be written as by genome_view.
---@param i integer|nil the robot; all if left out
---@param refusal? string the message of any write, for a view that may only be read
---@return limax.view [gene], or [robot][gene] of all
function methods:control_view(i, refusal)
  local genomes = genomes_of(self, "population:control_view")
  local all = view.new(self, "genes of control", "float", genomes + self.genes - self.control_genes,
    { self.count, self.control_genes },
    { strides = { self.genes, 1 }, range = writing_range(refusal) })
  return i and all[schema.index("population:control_view", i, self.count)] or all
end

--- A copy of the genes of control of robot i; nil without any.
---@param i integer
---@return number[]|nil
function methods:control(i)
  if self.control_genes == 0 then return nil end
  local genome, list = self:genome_copy(i), {}
  for k = 1, self.control_genes do list[k] = genome[self.genes - self.control_genes + k] end
  return list
end

-- Copies genomes into memory, its own if left out.
local function read_genomes(self, what, first, count, memory)
  local handle = coded(self, what)
  memory = memory or ffi.new("float[?]", count * self.genes)
  abi.check(C.limax_population_read_genomes(handle, first, count, memory), what)
  return memory
end

--- A copy of the genome of robot i, which stays valid. The population stays on its GPU.
---@param i integer
---@return limax.view [gene]
function methods:genome_copy(i)
  local what = "population:genome_copy"
  object.handle(what, self, class)
  local memory = read_genomes(self, what, schema.index(what, i, self.count) - 1, 1)
  return view.new(memory, "a genome", "float", memory, { self.genes })
end

--- A copy of all genomes, which stays valid.
---@return limax.view [robot][gene]
function methods:genomes_array()
  local memory = read_genomes(self, "population:genomes_array", 0, self.count)
  return view.new(memory, "genomes", "float", memory, { self.count, self.genes })
end

--- All genomes as little-endian 32-bit floats, [robot][gene].
---@return string
function methods:genomes_bytes()
  local memory = read_genomes(self, "population:genomes_bytes", 0, self.count)
  return ffi.string(memory, ffi.sizeof(memory))
end

-- Sets genomes from memory. A GPU that stores them receives these alone.
local function write_genomes(self, what, first, count, memory)
  local handle = coded(self, what)
  object.end_views(self.life, "its genomes were set")
  object.set(self, "lent", false)
  abi.check(C.limax_population_write_genomes(handle, first, count,
    ffi.cast("const float *", memory)), what)
end

--- Writes all genomes. Their bodies are unknown until the robots are expressed.
---@param all string|limax.view|ffi.cdata* as from genomes_bytes or genomes_array, or a float[?]
function methods:set_genomes(all)
  local what = "population:set_genomes"
  coded(self, what)
  local expected = self.count * self.genes * ffi.sizeof "float"
  local memory = view.memory(all) or all
  local size = type(memory) == "string" and #memory
    or ffi.istype("float[?]", memory) and ffi.sizeof(memory)
  if size ~= expected then
    schema.refuse(what, ("%d bytes (%d robots of %d genes), or as many floats as from "
      .. "genomes_array"):format(expected, self.count, self.genes), size or all)
  end
  write_genomes(self, what, 0, self.count, memory)
end

function class:__tostring()
  if not self.handle then return "freed population" end
  return ("population of %d robots, %dx%dx%d voxels"):format(self.count, unpack(self.lattice))
end

--- Copies genomes into memory of the caller, count * genes floats: of all robots, or of `count`
--- after the first `first` ones.
local function copy_genomes(self, memory, first, count)
  read_genomes(self, "copy_genomes", first or 0, count or self.count, memory)
end

--- Sets the genomes of `count` robots after the first `first` ones from memory of the caller.
local function put_genomes(self, memory, first, count)
  write_genomes(self, "put_genomes", first, count, memory)
end

return { class = class, population = population, copy_genomes = copy_genomes,
  put_genomes = put_genomes }
