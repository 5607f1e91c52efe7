--- experiment_fields.lua: the fields of an experiment's table, for help, completion and the
--- reference page: from the defaults, the effects, and the descriptions here of those that are not
--- numbers.

local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local ledger = require "limax.supervise.ledger"
local schema = require "limax.engine.schema"

local experiment_fields = {}

-- Names as LuaLS writes a choice of them: "a"|"b".
local function one_of(list)
  local words = {}
  for i, name in ipairs(list) do words[i] = ("%q"):format(name) end
  return table.concat(words, "|")
end

local function names_of(module) return one_of(choice.sorted_keys(require(module).entries)) end

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
  return { name = name, unit = field.unit, text = table.concat(parts, "; ") }
end

-- The fields of a group, sorted: those of `defaults.fields`, and further ones.
local function list_of(group, ...)
  local list, has = { ... }, {}
  for _, value in ipairs(list) do has[value.name] = true end
  for name, field in pairs(defaults.fields[group]) do
    if not has[name] then list[#list + 1] = of_field(name, field) end
  end
  table.sort(list, function(a, b) return a.name < b.name end)
  return list
end

local function effects()
  local list = {}
  for i, effect in ipairs(engine.effects()) do
    local fields = {}
    for k, field in ipairs(effect.fields) do fields[k] = of_field(field.name, field) end
    list[i] = { name = effect.name, text = effect.summary, fields = fields,
      list = effect.instances > 1 }
  end
  return list
end

local function traces()
  local list = {}
  for i, name in ipairs(defaults.traces) do
    local of_mass = (name == "position" or name == "velocity") and " of each mass" or ""
    list[i] = { name = name, unit = "Hz", text = ("samples per second of this trace: %s%s; in %s")
      :format(table.concat(engine.names.trace_columns[name], ", "), of_mass,
        engine.names.trace_unit[name]) }
  end
  return list
end

local function recorded()
  local list = traces()
  table.insert(list, 1, { name = "population", type = one_of(defaults.kept_robots),
    text = "of each generation: all, lines of all robots; columns, the same as one NumPy array;"
      .. " best, only the champion, and all robots of the newest three generations, for resume" })
  return list
end

local function ranges()
  local list = {}
  for i, limit in ipairs(ledger.limits(defaults.fields.experiment.population.value)) do
    list[i] = { name = limit.field, text = ("{ least, most } within %.4g to %.4g"):format(
      limit.minimum, limit.maximum) }
  end
  table.sort(list, function(a, b) return a.name < b.name end)
  return list
end

local function words(name, list, text)
  return { name = name, text = text or table.concat(list, ", "), type = one_of(list) }
end

local function described()
  return list_of("experiment",
    { name = "name", text = "what the run is called" },
    { name = "lattice", text = "voxels along x, y, z", unit = "voxels" },
    { name = "materials", text = 'a name ("paper"), a file or a table of materials',
      type = '"paper"' },
    { name = "evaluations", unit = "robots",
      text = "largest number of robots that a repetition may simulate for a score" },
    { name = "scene", text = "the effects, each with true or its fields", fields = effects() },
    { name = "record", text = "traces, samples per second; and which robots the folder keeps",
      fields = recorded() },
    { name = "genome", text = "the network that describes bodies", fields = list_of("genome",
      { name = "encoding", type = names_of "limax.encoding",
        text = "a name, a table with options, or a table of functions; each uses some fields" },
      { name = "mutation", type = one_of(choice.sorted_keys(require("limax.variation").mutations)),
        text = "a name, a table or a function (robots)" },
      { name = "crossover",
        type = one_of(choice.sorted_keys(require("limax.variation").crossovers)),
        text = "a name, a table or a function (robots)" }) },
    { name = "simulation", text = "times, accuracy, step", fields = list_of("simulation",
      words("accuracy", { "preview", "evolve", "publish", "reference" },
        "a tier: preview, evolve, publish or reference"),
      words("integrator", defaults.integrators, table.concat(defaults.integrators, ", ")
        .. "; rk4 and xpbd on the CPU, rk4 without contact, friction, self-collision, drag and"
        .. " block, xpbd without block"),
      words("precision", defaults.precisions, table.concat(defaults.precisions, ", ")
        .. "; of the state and forces: masses and springs are rounded to fp32 in each"),
      words("bound", defaults.bounds, "how an automatic step is bounded: springs one by one, or"
        .. " voxels, whose springs cannot all stretch at once: steps are 1.2 times longer"),
      words("sharing", defaults.sharings,
        "springs between voxels: mean or sum of their stiffness")) },
    { name = "islands", text = "populations that evolve side by side, each with an equal part of"
      .. " the robots, and exchange their best; none if left out", fields = list_of("islands",
      words("topology", defaults.topologies, "who sends robots to an island: the one before it"
        .. " (the default), all others, or one that is drawn each time")) },
    { name = "breeding", text = "how offspring are made of parents", fields = list_of "breeding" },
    { name = "fitness", type = names_of "limax.fitness",
      text = "a name, a table or a function (robot) -> number; the one field without a default" },
    { name = "selection", type = names_of "limax.selection",
      text = "a name, a table or a function (population, random) -> i, j" },
    { name = "survival", type = names_of "limax.survival",
      text = "a name, a table or a function (robots, random, state) -> survivors, parents" },
    { name = "archive", type = names_of "limax.archive",
      text = "a name or a table: which robots the run remembers beyond their generation" },
    { name = "state", text = "a function that returns a table, which every function of the"
      .. " experiment receives as its last argument and resume restores" },
    { name = "trials", text = "a list of worlds in which each robot is simulated, or a function"
      .. " (generation, random) that returns one; each with a scene, materials or fields of"
      .. " simulation that replace the experiment's" },
    { name = "supervisor", type = names_of "limax.supervise",
      text = "a name, a table or a function (history, random) -> proposal" },
    { name = "supervision", text = "what a supervisor may set", fields = list_of("supervision",
      { name = "ranges", text = "narrower ranges for proposals", fields = ranges() }) },
    { name = "not_in_paper",
      text = "texts for the report: which choices are ours and not the paper's" })
end

local all

--- The fields of an experiment, sorted.
---@return limax.api.value[]
function experiment_fields.list()
  all = all or described()
  return all
end

return experiment_fields
