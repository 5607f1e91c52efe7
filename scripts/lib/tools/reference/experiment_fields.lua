--- experiment_fields.lua: what an experiment's table may hold, field by field, for completion and
--- the reference page: from the defaults, the effects and the few lines here.

local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local ledger = require "limax.supervise.ledger"
local schema = require "limax.base.schema"

local experiment_fields = {}

---@class limax.api.option
---@field name string
---@field what string
---@field units string
---@field type string|nil
---@field fields limax.api.option[]|nil what its table may hold

-- Fields that no table of numbers describes.
local said = {
  name = "what the run is called",
  lattice = "voxels along x, y, z",
  materials = 'a name ("paper"), a file or a table of materials',
  evaluations = "most robots that a repetition may simulate for a score",
  scene = "the effects that act, each with true or its fields",
  record = "traces, samples per second",
  genome = "the network that describes bodies",
  simulation = "times, accuracy, step",
  breeding = "how offspring are made of parents",
  fitness = "a name, a table or a function (robot) -> number; the one field without a default",
  selection = "a name, a table or a function (population, random) -> i, j",
  supervisor = "a name, a table or a function (history, random) -> proposal",
  supervision = "what a supervisor may set",
  not_in_paper = "texts for the report: what is our choice and not the paper's",
}

local simulation_words = {
  accuracy = "a tier: preview, evolve, publish or reference",
  integrator = table.concat(defaults.integrators, ", "),
  precision = table.concat(defaults.precisions, ", "),
  sharing = "springs between voxels: mean or sum of their stiffness",
}

-- Names as LuaLS writes a choice of them: "a"|"b".
local function one_of(list)
  local words = {}
  for i, name in ipairs(list) do words[i] = ("%q"):format(name) end
  return table.concat(words, "|")
end

-- What a name may be; read when first asked for.
local function types()
  local function names_of(module) return choice.sorted_keys(require(module).entries) end
  return { materials = '"paper"', fitness = one_of(names_of "limax.fitness"),
    selection = one_of(names_of "limax.selection"),
    supervisor = one_of(names_of "limax.supervise"),
    accuracy = one_of { "preview", "evolve", "publish", "reference" },
    integrator = one_of(defaults.integrators), precision = one_of(defaults.precisions),
    sharing = '"mean"|"sum"' }
end

-- "from 1 to 10; default 5: reason" of a field of defaults.lua.
local function of_default(name, field)
  local value = field.value
  local range = (field.minimum or field.above or field.maximum or field.below)
    and schema.expected(field) or ""
  return { name = name, units = field.unit ~= "" and field.unit or "-",
    what = ("%s%sdefault %s: %s"):format(range, range ~= "" and "; " or "", tostring(value),
      field.reason) }
end

local function sorted(list)
  table.sort(list, function(a, b) return a.name < b.name end)
  return list
end

local function of_group(name, words)
  local list = {}
  for field, rule in pairs(defaults.fields[name]) do list[#list + 1] = of_default(field, rule) end
  for field, what in pairs(words or {}) do
    list[#list + 1] = { name = field, units = "-", what = what, type = types()[field] }
  end
  return sorted(list)
end

-- A scene's effects with their fields.
local function effects()
  local list = {}
  for _, effect in ipairs(engine.effects()) do
    local fields = {}
    for i, field in ipairs(effect.fields) do
      fields[i] = { name = field.name, units = field.unit ~= "" and field.unit or "1",
        what = ("%s; %g to %g%s"):format(field.note, field.minimum, field.maximum,
          #field.value > 0 and "; default " .. table.concat(field.value, ", ") or "") }
    end
    list[#list + 1] = { name = effect.name, units = "-", what = effect.summary, fields = fields }
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
  local list = {}
  for i, limit in ipairs(ledger.limits(defaults.fields.experiment.population.value)) do
    list[i] = { name = limit.field, units = "-", what = ("{ least, most } within %.4g to %.4g")
      :format(limit.minimum, limit.maximum) }
  end
  return sorted(list)
end

-- Units of those.
local units = { lattice = "voxels", evaluations = "robots" }

local known

--- The fields of an experiment, sorted.
---@return limax.api.option[]
function experiment_fields.list()
  if known then return known end
  known = {}
  local nested = { scene = effects, record = traces,
    genome = function() return of_group "genome" end,
    simulation = function() return of_group("simulation", simulation_words) end,
    breeding = function() return of_group "breeding" end,
    supervision = function()
      local list = of_group "supervision"
      list[#list + 1] = { name = "ranges", units = "-", fields = ranges(),
        what = "narrower ranges for proposals" }
      return sorted(list)
    end }
  for name, what in pairs(said) do
    known[#known + 1] = { name = name, units = units[name] or "-", what = what,
      type = types()[name],
      fields = nested[name] and nested[name]() }
  end
  for name, field in pairs(defaults.fields.experiment) do
    if not said[name] then known[#known + 1] = of_default(name, field) end
  end
  return sorted(known)
end

return experiment_fields
