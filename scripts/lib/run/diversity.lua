--- diversity.lua: how different the robots of a population are. The engine measures it in linear
--- time. Empty voxels count as a material of their own, and bodies are compared voxel by voxel of
--- the lattice, without alignment.

local new_table = require "table.new"

local engine = require "limax.engine"
local strict = require "limax.engine.strict"

local diversity = strict.module "limax.diversity"

--- `hamming` is the mean share of voxels in which two distinct robots differ, N / (N - 1) times the
--- mean over voxels of 1 - sum_m p_m^2; `genotype` the root mean square over genes of the standard
--- deviation over the robots; `control` the same of the genes of control, which `genotype` leaves
--- out; `material_shares` include the empty one.
---@class limax.diversity.values
---@field hamming number 0 to 1
---@field genotype number|nil nil without genomes
---@field control number|nil nil without genes of control
---@field distinct integer number of different bodies
---@field robots integer size of the set
---@field material_shares table<string, number> mean share of all voxels, by name

-- The engine's answer, if this rank has one, with materials by name and no NaN.
local function named(values, materials)
  if not values then return nil end
  local shares = {}
  for m = 1, materials.count do shares[materials:get(m).name] = values.material_shares[m] end
  local genotype = values.genotype
  if genotype ~= genotype then genotype = nil end
  return { hamming = values.hamming, genotype = genotype, control = values.control,
    distinct = values.distinct, robots = values.robots, material_shares = shares }
end

--- The better half of a ranking, rounded up.
---@param ranked integer[] indices, best first
---@return integer[]
function diversity.top_half(ranked)
  local count = math.ceil(#ranked / 2)
  local top = new_table(count, 0)
  for k = 1, count do top[k] = ranked[k] end
  return top
end

--- The diversity of all scored robots and of their better half; empty without a scored robot.
---@param population limax.population|fun(count: integer): limax.diversity of the engine, or what
--- measures so many of the best
---@param ranked integer[] indices of the scored robots, best first
---@param materials limax.materials
---@return { all: limax.diversity.values|nil, top: limax.diversity.values|nil }
function diversity.measure(population, ranked, materials)
  if #ranked == 0 then return {} end
  local of_ranks = type(population) == "function" and population
  return {
    all = named(of_ranks and of_ranks(#ranked) or population:diversity(ranked), materials),
    top = named(of_ranks and of_ranks(math.ceil(#ranked / 2))
      or population:diversity(diversity.top_half(ranked)), materials),
  }
end

-- One measure of a script's scored population.
local function of(population, part, field)
  local ranked, values = {}, nil
  if type(population) == "table" and rawget(population, "world") then
    -- an island has a part of the robots of the engine's population
    local places = rawget(population, "places")
    for k, index in ipairs(population.ranked or {}) do
      ranked[k] = places and places[index] or index
    end
    if part == "top" then ranked = diversity.top_half(ranked) end
    values = ranked[1] and population.world.diversity(population, ranked)
  end
  if not values then
    engine.fail(("diversity.%s: expected a scored population of the last three generations, "
      .. "such as history[#history].population"):format(field))
  end
  if part ~= nil and part ~= "all" and part ~= "top" then
    engine.fail(('diversity.%s: expected "all" or "top", got %s'):format(field, tostring(part)))
  end
  return named(values, population.materials)[field]
end

--- Mean share of voxels in which two distinct robots differ, 0 to 1; 0 for one robot.
---@param population table a scored population
---@param part? "all"|"top" all scored robots (the default), or their better half
---@return number|nil
function diversity.hamming(population, part) return of(population, part, "hamming") end

--- Root mean square over genes of the standard deviation over the robots.
---@param population table
---@param part? "all"|"top"
---@return number|nil
function diversity.genotype(population, part) return of(population, part, "genotype") end

--- The same of the genes of control, which `genotype` leaves out; nil without any.
---@param population table
---@param part? "all"|"top"
---@return number|nil
function diversity.control(population, part) return of(population, part, "control") end

--- Number of different bodies.
---@param population table
---@param part? "all"|"top"
---@return integer|nil
function diversity.distinct(population, part) return of(population, part, "distinct") end

--- Mean share of each material over all voxels, by name, empty included.
---@param population table
---@param part? "all"|"top"
---@return table<string, number>|nil
function diversity.material_shares(population, part)
  return of(population, part, "material_shares")
end

return strict.close("limax.diversity", diversity)
