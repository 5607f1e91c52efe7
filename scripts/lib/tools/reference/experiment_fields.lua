--- experiment_fields.lua: the fields of an experiment's table, for completion and the reference
--- page: from the defaults, the effects, and the descriptions here of those that are not numbers.

local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local ledger = require "limax.supervise.ledger"
local schema = require "limax.engine.schema"

local experiment_fields = {}

---@class limax.api.option
---@field name string
---@field what string
---@field units string
---@field type string|nil
---@field fields limax.api.option[]|nil of its table

-- Names as LuaLS writes a choice of them: "a"|"b".
local function one_of(list)
  local words = {}
  for i, name in ipairs(list) do words[i] = ("%q"):format(name) end
  return table.concat(words, "|")
end

local function names_of(module) return one_of(choice.sorted_keys(require(module).entries)) end

-- name -> what, type, units
local function described()
  return {
    name = { "what the run is called" },
    lattice = { "voxels along x, y, z", units = "voxels" },
    materials = { 'a name ("paper"), a file or a table of materials', '"paper"' },
    evaluations = { "largest number of robots that a repetition may simulate for a score",
      units = "robots" },
    scene = { "the effects, each with true or its fields" },
    record = { "traces, samples per second" },
    genome = { "the network that describes bodies" },
    simulation = { "times, accuracy, step" },
    breeding = { "how offspring are made of parents" },
    fitness = { "a name, a table or a function (robot) -> number; the one field without a default",
      names_of "limax.fitness" },
    selection = { "a name, a table or a function (population, random) -> i, j",
      names_of "limax.selection" },
    supervisor = { "a name, a table or a function (history, random) -> proposal",
      names_of "limax.supervise" },
    supervision = { "what a supervisor may set" },
    not_in_paper = { "texts for the report: which choices are ours and not the paper's" },
  }
end

local simulation_words = {
  accuracy = { "a tier: preview, evolve, publish or reference",
    one_of { "preview", "evolve", "publish", "reference" } },
  integrator = { table.concat(defaults.integrators, ", "), one_of(defaults.integrators) },
  precision = { table.concat(defaults.precisions, ", "), one_of(defaults.precisions) },
  sharing = { "springs between voxels: mean or sum of their stiffness", one_of(defaults.sharings) },
}

-- A field of defaults.lua or an effect: "note; 1 to 10; default 5".
local function of_field(name, field)
  local parts, value = { field.note }, field.value
  if field.minimum and field.maximum then
    parts[2] = ("%g to %g"):format(field.minimum, field.maximum)
  elseif type(value) == "number" then
    parts[2] = schema.expected { minimum = field.minimum, above = field.above, below = field.below }
  end
  if type(value) == "table" then value = table.concat(value, ", ") end
  parts[#parts + 1] = value ~= "" and "default " .. tostring(value) or nil
  return { name = name, units = field.unit ~= "" and field.unit or "-",
    what = table.concat(parts, "; ") }
end

-- The fields of a group, sorted: numbers, words and further options.
local function list_of(numbers, words, ...)
  local list = { ... }
  for name, field in pairs(numbers) do list[#list + 1] = of_field(name, field) end
  for name, entry in pairs(words or {}) do
    list[#list + 1] = { name = name, units = entry.units or "-", what = entry[1], type = entry[2],
      fields = entry.fields }
  end
  table.sort(list, function(a, b) return a.name < b.name end)
  return list
end

local function effects()
  local list = {}
  for i, effect in ipairs(engine.effects()) do
    local fields = {}
    for k, field in ipairs(effect.fields) do fields[k] = of_field(field.name, field) end
    list[i] = { name = effect.name, units = "-", what = effect.summary, fields = fields }
  end
  return list
end

local function traces()
  local list = {}
  for i, name in ipairs(defaults.traces) do
    list[i] = { name = name, units = "Hz", what = ("samples per second of this trace, in %s")
      :format(engine.names.trace_unit[name]) }
  end
  return list
end

local function ranges()
  local words = {}
  for _, limit in ipairs(ledger.limits(defaults.fields.experiment.population.value)) do
    words[limit.field] = { ("{ least, most } within %.4g to %.4g"):format(limit.minimum,
      limit.maximum) }
  end
  return { name = "ranges", units = "-", what = "narrower ranges for proposals",
    fields = list_of({}, words) }
end

local all

--- The fields of an experiment, sorted.
---@return limax.api.option[]
function experiment_fields.list()
  if all then return all end
  local words, numbers = described(), {}
  words.scene.fields, words.record.fields = effects(), traces()
  words.genome.fields = list_of(defaults.fields.genome)
  words.simulation.fields = list_of(defaults.fields.simulation, simulation_words)
  words.breeding.fields = list_of(defaults.fields.breeding)
  words.supervision.fields = list_of(defaults.fields.supervision, {}, ranges())
  for name, field in pairs(defaults.fields.experiment) do
    if not words[name] then numbers[name] = field end
  end
  all = list_of(numbers, words)
  return all
end

return experiment_fields
