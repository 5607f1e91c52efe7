--- batch.lua: robots of one population as the functions of an encoding, a mutation or a crossover
--- see them: a list of the indices to work on, checked views of their genes and bodies, random
--- numbers that depend on nothing else, and the engine's own operators on any of them.

local engine = require "limax.engine"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local batch = {}

---@class limax.batch a list of indices of robots: `for _, i in ipairs(robots) do`
---@field generation integer that they belong to; an express has neither this nor the last three
---@field lattice integer[] voxels along x, y, z
---@field materials limax.materials the empty one first
---@field parameters table<string, number> mutation_rate, mutation_scale, crossover_rate, and with
--- genes of control control_mutation_rate, control_mutation_scale
---@field state table|nil of the experiment's functions
---@field rows limax.row[] of all robots, in a mutation or crossover; on several ranks of mpirun
--- only own ones have a body, parents and an origin
local methods = strict.methods "robots"

batch.GENES_ONLY = "a body depends on its genes only, because elites are expressed again"

local FIELDS = { generation = true, lattice = true, materials = true,
  parameters = true, state = true, rows = true, parent_rows = true, parts = true }

local class = {}

-- Fields that have other values when elites are expressed again in later generations.
local NOT_OF_GENES = { generation = true, parameters = true, state = true, rows = true }

function class.__index(self, key)
  if type(key) == "number" then return nil end -- the end of the list
  if NOT_OF_GENES[key] and self.parts.express then
    engine.fail(("robots.%s: express has none: %s"):format(key, batch.GENES_ONLY))
  end
  if key == "state" then return self.parts.state end
  return methods[key] or not FIELDS[key] and strict.unknown("robots", key, FIELDS, methods) or nil
end

class.__newindex = strict.read_only("a list of robots", "write to their genes, or to a field of"
  .. " robots.state")

--- Makes a batch. `parts` holds what its methods use: `population` of the engine; `pairs` and
--- `parents`, another population, in a mutation or crossover; `seed`, `repetition`, `device`; and
--- `number`, where places in the population are not the numbers in the generation, by which scripts
--- count.
---@param rows integer[] places of the robots to work on
---@param fields table of limax.batch, and `parts`
---@return limax.batch
function batch.new(rows, fields)
  local number = fields.parts.number
  fields.parts.at, fields.parts.streams = {}, {}
  for k, place in ipairs(rows) do
    local i = number and number(place) or place
    fields[k], fields.parts.at[i] = i, place
  end
  return setmetatable(fields, class)
end

-- Raises unless robot i is one of these: others are elites, whose genes must not change.
local function require_row(self, i, what)
  if self.parts.at[i] then return end
  engine.fail(("%s %s is none of these: visit them with for _, i in ipairs(robots) do"):format(what,
    schema.show(i)))
end

-- Calls work(first, count), places, for every run of successive rows; all robots if left out.
local function each_run(self, name, rows, work)
  if rows ~= nil and type(rows) ~= "table" then
    engine.fail(("robots:%s: expected a list of robots such as { %s }, got %s"):format(name,
      type(rows) == "number" and rows or "i", schema.show(rows)))
  end
  rows = rows or self
  for k, row in ipairs(rows) do
    require_row(self, row, ("robots:%s: rows[%d] ="):format(name, k))
  end
  local at, first = self.parts.at, nil
  for k, row in ipairs(rows) do
    local place = at[row]
    first = first or place
    if not rows[k + 1] or at[rows[k + 1]] ~= place + 1 then
      work(first, place - first + 1)
      first = nil
    end
  end
end

-- Robot i of a view of all robots, which is made once and ends when the engine writes.
local function part_of(self, name, i, argument)
  local parts = self.parts
  if not parts.at[i] then require_row(self, i, "robot") end
  if not parts[name] then
    parts[name] = parts.population[name](parts.population, nil, argument)
  end
  return parts[name][parts.at[i]]
end

-- The message of a write to genes where only bodies are written; nil elsewhere.
local function refusal_of(self)
  return self.parts.express and "express may not write genes: " .. batch.GENES_ONLY or nil
end

local function end_views(self)
  for _, name in ipairs { "genome_view", "control_view", "voxels_view", "weights_view" } do
    self.parts[name] = nil
  end
end

--- The genes of robot i, to read and write; the genes of control come last.
---@param i integer
---@return limax.view [gene]
function methods:genes(i) return part_of(self, "genome_view", i, refusal_of(self)) end

--- The genes of control of robot i, to read and write: the end of robots:genes(i); of length 0
--- where no scene needs any.
---@param i integer
---@return limax.view [gene]
function methods:control(i) return part_of(self, "control_view", i, refusal_of(self)) end

--- The material of each voxel of robot i, to read and write: 0 is the empty one. Voxel (x, y, z),
--- counted from 0, is number 1 + x + nx (y + ny z).
---@param i integer
---@return limax.view [voxel]
function methods:voxels(i)
  return part_of(self, "voxels_view", i, self.materials.count)
end

--- Stiffness, amplitude and phase of each voxel of robot i, 0 to 1, to read and write.
---@param i integer
---@return limax.view [3][voxel]
function methods:weights(i) return part_of(self, "weights_view", i) end

-- The pair of parents of robot i.
local function pair_of(self, i)
  local pairs_of_parents = self.parts.pairs
  if not pairs_of_parents then
    engine.fail "robots:parents: only a mutation and a crossover have parents"
  end
  require_row(self, i, "robot")
  return pairs_of_parents[self.parts.at[i]]
end

--- The genes of both parents of robot i, in a mutation or crossover.
---@param i integer
---@return limax.view first [gene]
---@return limax.view second [gene]
function methods:parents(i)
  local pair, parents = pair_of(self, i), self.parts.parents
  return parents:genome(pair[1]), parents:genome(pair[2])
end

--- Random numbers for robot i, the same in every run with the same seed. Each call of one function
--- continues them.
---@param i integer
---@return limax.random
function methods:random(i)
  local parts = self.parts
  if not parts.counter then
    engine.fail("robots:random: " .. batch.GENES_ONLY)
  end
  require_row(self, i, "robot")
  local streams = parts.streams
  streams[i] = streams[i] or engine.random(parts.seed, parts.repetition, "variation",
    self.generation, parts.counter + i)
  return streams[i]
end

--- Initial genes by the engine's rule.
---@param rows? integer[] all of these robots if left out
function methods:initialize(rows)
  if self.parts.express then engine.fail("robots:initialize: " .. batch.GENES_ONLY) end
  end_views(self)
  each_run(self, "initialize", rows, function(first, count)
    self.parts.population:initialize(first, count, self.generation, self.parts.device)
  end)
end

-- Breeds rows with these rates.
local function breed(self, name, rows, parents, pairs_of_parents, rates)
  local parts = self.parts
  end_views(self)
  each_run(self, name, rows, function(first, count)
    local of_rows = {}
    for k = 1, count do of_rows[k] = pairs_of_parents[first + k - 1] end
    parts.population:breed(parents, of_rows, { seed = parts.seed,
      repetition = parts.repetition, generation = self.generation,
      mutation_rate = rates.mutation_rate or 0, mutation_scale = rates.mutation_scale or 0,
      control_mutation_rate = rates.control_mutation_rate or 0,
      control_mutation_scale = rates.control_mutation_scale or 0,
      crossover_rate = rates.crossover_rate or 0 }, parts.device, first, count)
  end)
end

--- Uniform crossover by the engine: each gene comes from the second parent with this chance.
---@param rows? integer[] all of these robots if left out
---@param rate? number crossover_rate of the parameters if left out
function methods:cross(rows, rate)
  pair_of(self, self[1] or 1)
  breed(self, "cross", rows, self.parts.parents, self.parts.pairs,
    { crossover_rate = rate or self.parameters.crossover_rate })
end

local RATES = { mutation_rate = true, mutation_scale = true, control_mutation_rate = true,
  control_mutation_scale = true }

--- Gaussian mutation by the engine: each gene changes with this chance by N(0, scale^2); genes of
--- control have a rate and a scale of their own.
---@param rows? integer[] all of these robots if left out
---@param rates? { mutation_rate?: number, mutation_scale?: number, control_mutation_rate?: number,
--- control_mutation_scale?: number } those of the parameters if left out
function methods:mutate(rows, rates)
  rates = rates or {}
  if type(rates) ~= "table" then
    schema.refuse("robots:mutate", "rates such as { mutation_scale = 0.3 }", rates)
  end
  schema.known(rates, RATES, "robots:mutate")
  local population, same = self.parts.population, {}
  local before = self.parts.empty()
  before:set_genomes(population:genomes_array())
  for i = 1, population.count do same[i] = { i, i } end
  local used = {}
  for name in pairs(RATES) do used[name] = rates[name] or self.parameters[name] end
  breed(self, "mutate", rows, before, same, used)
  before:free()
end

--- Genes to voxels and weights by the network of the encoding; keeps separate parts.
---@param rows? integer[] all of these robots if left out
function methods:express(rows)
  end_views(self)
  each_run(self, "express", rows, function(first, count)
    self.parts.population:express(self.materials, { device = self.parts.device,
      largest_part = false }, first, count)
  end)
end

return batch
