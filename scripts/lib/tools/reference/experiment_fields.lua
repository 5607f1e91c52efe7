--- experiment_fields.lua: the fields of an experiment's table, for help and the reference page:
--- from the defaults, the effects, and the descriptions here of those that are not numbers.

local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local proposals = require "limax.supervise.proposals"
local schema = require "limax.engine.schema"

local experiment_fields = {}

-- A field of an experiment or of one of its tables.
local function row(name, text, fields, unit)
  return { name = name, text = text, fields = fields, unit = unit }
end

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
    if effect.name == "control" then
      table.insert(fields, 1, row("signal", "the text of the controller, in the language of"
        .. " CONTROL.md; fields besides these are its parameters"))
    end
    list[i] = { name = effect.name, text = effect.summary, fields = fields,
      list = effect.instances > 1 }
  end
  return list
end

-- What has a sample of its own in a trace.
local EACH = { position = " of each mass", velocity = " of each mass",
  activation = "one of each voxel", sensor = "what the controller reads, of each voxel" }

local function traces()
  local list = {}
  for i, name in ipairs(defaults.traces) do
    list[i] = { name = name, unit = "Hz", text = ("samples per second of this trace: %s%s; in %s")
      :format(table.concat(engine.names.trace_columns[name], ", "), EACH[name] or "",
        engine.names.trace_unit[name]) }
  end
  return list
end

local function recorded()
  local list = traces()
  table.insert(list, 1, row("population", "of each generation: all, lines of all robots; columns,"
    .. " the same as one NumPy array; best, only the champion, and all robots of the newest three"
    .. " generations, for resume"))
  return list
end

local function ranges()
  local list = {}
  for i, limit in ipairs(proposals.limits(defaults.fields.experiment.population.value)) do
    list[i] = { name = limit.field, text = ("{ least, most } within %.4g to %.4g"):format(
      limit.minimum, limit.maximum) }
  end
  table.sort(list, function(a, b) return a.name < b.name end)
  return list
end

-- Type of a field that takes a piece of the library or a function.
local PIECE = "a name, a table or a function "

local function described()
  local genome = list_of("genome",
    row("encoding", "a name, a table with options, or a table of functions; each uses some fields"),
    row("body", "a robot file whose body all robots have: only their genes of control vary"),
    row("mutation", PIECE .. "(robots)"), row("crossover", PIECE .. "(robots)"))
  local simulation = list_of("simulation",
    row("accuracy", "a tier: preview, evolve, publish or reference"),
    row("integrator", table.concat(defaults.integrators, ", ") .. "; rk4 on the CPU, without"
      .. " contact, friction, self-collision, drag and block"),
    row("precision", table.concat(defaults.precisions, ", ")
      .. "; of the state and forces: masses and springs are rounded to fp32 in each"),
    row("bound", "how an automatic step is bounded: springs one by one, or voxels, whose springs"
      .. " cannot all stretch at once: steps are 1.2 times longer"),
    row("sharing", "springs between voxels: mean or sum of their stiffness"))
  local islands = list_of("islands", row("topology", "who sends robots to an island: the one before"
    .. " it (the default), all others, or one that is drawn each time"))
  return list_of("experiment",
    row("name", "what the run is called"),
    row("lattice", "voxels along x, y, z", nil, "voxels"),
    row("materials", 'a name ("paper"), a file or a table of materials'),
    row("evaluations", "largest number of robots that a repetition may simulate for a score", nil,
      "robots"),
    row("scene", "the effects, each with true or its fields", effects()),
    row("record", "traces, samples per second; and which robots the folder keeps", recorded()),
    row("genome", "the network that describes bodies", genome),
    row("simulation", "times, accuracy, step", simulation),
    row("islands", "populations that evolve side by side, each with an equal part of the robots,"
      .. " and exchange their best; none if left out", islands),
    row("breeding", "how offspring are made of parents", list_of "breeding"),
    row("fitness", PIECE .. "(robot) -> number; the one field without a default"),
    row("selection", PIECE .. "(population, random) -> i, j"),
    row("survival", PIECE .. "(robots, random, state) -> survivors, parents"),
    row("archive", "a name or a table: which robots the run remembers beyond their generation"),
    row("state", "a function that returns a table, which every function of the experiment receives"
      .. " as its last argument and resume restores"),
    row("trials", "a list of worlds in which each robot is simulated, or a function (generation,"
      .. " random) that returns one; each with a scene, materials or fields of simulation that"
      .. " replace the experiment's"),
    row("supervisor", PIECE .. "(history, random) -> proposal"),
    row("supervision", "what a supervisor may set", list_of("supervision",
      row("ranges", "narrower ranges for proposals", ranges()))),
    row("not_in_paper", "texts for the report: which choices are ours and not the paper's"))
end

local all

--- The fields of an experiment, sorted.
function experiment_fields.list()
  all = all or described()
  return all
end

return experiment_fields
