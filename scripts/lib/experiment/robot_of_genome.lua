--- robot_of_genome.lua: the body that a genome describes: `limax.robot { genome = "random", seed =
--- 3 }`, or one of certain genes under the encoding that they were evolved with.

local defaults = require "limax.settings.defaults"
local encodings = require "limax.encoding"
local engine = require "limax.engine"
local ffi = require "ffi"
local genes = require "limax.experiment.genes"
local genome_rules = require("limax.engine.encoding").genome_rules
local robot_file = require "limax.robot.robot_file"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"

local robot_of_genome = {}

local defined = defaults.fields
local individual = { value = 1, unit = "of the initial population", minimum = 1, maximum = 1e6,
  integer = true }

local rules = schema.fields {
  genome = schema.any,
  lattice = settings.lattice { 5, 5, 5 },
  materials = schema.any,
  edge = schema.number(defined.simulation.edge),
  encoding = schema.any,
  features = genome_rules.features, sigma = genome_rules.sigma, hidden = genome_rules.hidden,
  initial_scale = genome_rules.initial_scale,
  seed = schema.any,
  repetition = schema.number(defined.experiment.repetitions, 1),
  individual = schema.number(individual),
  control = robot_file.control_rule,
}

-- Genes of a script (a view or a list of numbers) in the form of the engine.
local function bytes_of(genome, count)
  local list = engine.is_view(genome) and genome:table() or genome
  if type(list) ~= "table" or #list ~= count then
    engine.fail(('limax.robot: genome: expected "random" or %d numbers, got %s'):format(count,
      type(list) == "table" and ("%d"):format(#list) or schema.show(list)))
  end
  local numbers = ffi.new("float[?]", count)
  for i = 1, count do
    if type(list[i]) ~= "number" or list[i] ~= list[i] then
      engine.fail(("limax.robot: genome[%d]: expected a number, got %s"):format(i,
        schema.show(list[i])))
    end
    numbers[i - 1] = list[i]
  end
  return ffi.string(numbers, ffi.sizeof(numbers))
end

--- The description of the robot that a genome describes.
---@return limax.robot.description
---@return limax.materials
function robot_of_genome.describe(fields)
  local checked, message = rules(fields, "limax.robot")
  if not checked then engine.fail(message) end
  local materials = robot_file.materials(checked.materials)
  local definition = encodings.get(checked.encoding or defaults.encoding,
    { lattice = checked.lattice, materials = materials.count })
  local encoding = encodings.of_engine(definition, checked, { lattice = checked.lattice,
    materials = materials.count, seed = checked.seed or 1, repetition = checked.repetition })
  local random = checked.genome == "random"
  local which = random and checked.individual or 1
  local population = engine.population { lattice = checked.lattice, count = which,
    encoding = encoding }
  local how = { encoding = definition, lattice = checked.lattice, materials = materials,
    parameters = {}, seed = checked.seed or 1, repetition = checked.repetition,
    require_muscle = false }
  if random then
    genes.initialize(how, population, { which }, 0)
  else
    population:set_genomes(bytes_of(checked.genome, population.genes))
  end
  genes.express(how, population, which, 1)
  local description = robot_file.describe(population, which, materials, checked.edge)
  description.control = checked.control
  population:free()
  return description, materials
end

return robot_of_genome
