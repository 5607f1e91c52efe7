--- run_files.lua: reads the files of a run folder. Every document and every line is checked against
--- the fields that limax reads: a damaged or foreign file ends the command with one message that
--- names file, line, field and what was expected. RUN_FOLDER.md explains the fields.

local defaults = require "limax.settings.defaults"
local failure = require "limax.base.failure"
local host = require "limax.host"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"

local run_files = {}

-- ---- rules --------------------------------------------------------------------------------------

local record, map, required, text = schema.record, schema.map, schema.required, schema.string
local finite = schema.number {}
--- Sums and squares of larger scores may not be finite.
run_files.LARGEST_SCORE = 1e150
local number = schema.number { minimum = -run_files.LARGEST_SCORE,
  maximum = run_files.LARGEST_SCORE }
local count = schema.whole(0, 2 ^ 53)
local vector = schema.numbers(3)

local function list(rule, expected) return schema.list(rule, { expected = expected }) end

-- The rule of a group of fields of an experiment that were completed: its defaults are there.
local function complete(rule)
  return function(value, path)
    local result, message = rule(value, path)
    if message then return nil, message end
    for _, name in ipairs(schema.names(result, path)) do
      if value[name] == nil then return nil, ("%s.%s: is missing"):format(path, name) end
    end
    return value
  end
end

-- The tier has set integrator, precision and step.
local function simulation(value, path)
  local result, message = complete(settings.simulation)(value, path)
  for _, name in ipairs(result and settings.of_tier or {}) do
    -- without `bound` a step is bounded by springs
    local needless = name == "bound" or type(value.time_step) == "number"
      and (name == "bound_fraction" or name == "time_step_most")
    if value[name] == nil and not needless then
      return nil, ("%s.%s: is missing"):format(path, name)
    end
  end
  return result, message
end

local options = record { name = text, ["function"] = record { file = required(text),
  first_line = required(count), last_line = required(count), sha256 = required(text) } }

-- A fitness, selection or supervisor: a name, also as a list, or options with a name or a function.
local function choice(value, path)
  if type(value) == "string" then return value end
  local _, message = options(value, path)
  if not message and type(value) == "table" and type(value[1] or value.name) ~= "string"
    and not value["function"] then
    message = path .. ": expected a name, or a table with a name or a function"
  end
  return not message and value or nil, message
end

local function schema_of(name)
  local expected = "limax." .. name .. "/1"
  return schema.text(expected:gsub("%p", "%%%0"), '"' .. expected .. '"')
end

local place = { repetition = required(schema.whole(1, 1e6)),
  generation = required(schema.whole(0, 1e9)) }

-- The rule of an object of a file with its schema, and where it belongs.
local function line(name, fields)
  fields.schema, fields.repetition, fields.generation =
    schema_of(name), place.repetition, place.generation
  return record(fields)
end

local diversity = record { hamming = number, genotype = number, distinct = number }

local spread = record { champion = number, mean = number, least = number, most = number }

local experiment = defaults.fields.experiment

local measured = record {
  status = required(schema.choice { "done", "invalid", "diverged" }), reason = text,
  coarse = schema.boolean(), step = finite, steps = finite, time = finite, time_step = finite,
  time_step_bound = finite, mass = finite, center_start = vector, center_middle = vector,
  center_end = vector, path_length = finite, height = finite, contact = finite, kinetic = finite,
  elastic = finite, muscle_work = finite, strain = finite, strain_most = finite,
  block_start = vector, block_middle = vector, block_end = vector, block_velocity = vector,
  block_upright = finite,
}

--- The rule of a robot's outcome: what its simulation measured.
function run_files.outcome(value, path)
  local result, message = measured(value, path)
  for _, name in ipairs(result and result.status == "done" and { "center_start", "center_middle",
    "center_end", "time", "step", "steps", "mass" } or {}) do
    if result[name] == nil then return nil, ("%s.%s: is missing"):format(path, name) end
  end
  return result, message
end

local body = record {
  letters = required(text), hash = required(text), voxels = required(count),
  masses = required(count), springs = required(count), size = required(vector),
  counts = required(map(count)), mass = required(finite),
}

-- A line of each file, or the whole document.
local rules = {
  config = record {
    schema = required(schema_of "config"),
    name = required(text),
    seed = required(schema.seed), lattice = required(settings.lattice()),
    population = required(schema.number(experiment.population)),
    generations = required(schema.number(experiment.generations)),
    repetitions = required(schema.number(experiment.repetitions)), evaluations = count,
    genome = required(schema.table), breeding = required(schema.table),
    materials = required(schema.table), scene = required(schema.table),
    supervision = required(schema.table), simulation = required(simulation),
    record = required(complete(settings.record)), fitness = required(choice),
    selection = required(choice), survival = choice, state = choice, islands = schema.table,
    trials = schema.table, archive = choice,
    record_population = schema.choice { "columns", "best" },
    supervisor = required(choice),
    not_in_paper = list(text, "a list of texts"),
    run = required(record {
      repetition = schema.whole(1, 1e6), path = text, script = text,
      scripts = required(list(record { file = required(text), sha256 = required(text) },
        "a list of scripts")),
      overrides = required(list(text, "a list of texts")), own_loop = schema.boolean(),
    }),
  },
  status = record {
    schema = schema_of "status",
    state = required(schema.choice { "running", "done", "interrupted", "failed" }),
  },
  environment = record {
    schema = schema_of "environment",
    sessions = required(list(record {
      started = required(text), version = required(text), ranks = count,
      machine = required(record { compiler = text, system = text, cpu = text }),
      device = required(record { kind = required(text), cpu = text,
        gpus = list(record { name = required(text) }, "a list of GPUs") }),
    }, "a list of processes")),
  },
  metrics = line("metrics", {
    best = required(number), best_standard = number, mean = required(number),
    median = required(number), worst = required(number), scored = required(count),
    evaluations = required(count), coarse = required(count),
    quantiles = required(record { q10 = required(number), q25 = required(number),
      q50 = required(number), q75 = required(number), q90 = required(number) }),
    failed = required(record { invalid = required(count), diverged = required(count),
      fitness = required(count) }),
    champion = required(record { id = required(count), index = required(schema.whole(1, 2 ^ 53)),
      hash = required(text) }),
    diversity = required(record { all = required(diversity), top = required(diversity) }),
    measures = map(spread),
    islands = list(record { best = number, mean = number, scored = required(count) },
      "a list of islands"),
    parameters = required(map(number)), materials = required(map(map(number))),
    supervisor_failed = schema.boolean(),
    archive = record { cells = count, filled = count, coverage = number, qd_score = finite,
      best = number },
    front = record { size = required(count), hypervolume = finite },
    novelty = spread, age = spread, step_size = spread,
  }),
  ledger = line("ledger", {
    supervisor = required(text), source = text, reason = text,
    entries = required(list(record {
      field = required(text), outcome = required(text), before = number, applied = number,
      proposed = schema.any, reason = text,
    }, "a list of fields")),
  }),
  timing = line("timing", {
    ended = required(text), seconds = required(map(number)),
    supervision = record { asks = number, model_seconds = number, input_tokens = number,
      output_tokens = number, cost = number, fallen_back = schema.boolean() },
  }),
  hashes = line("hashes", { scored_by = text, metrics = required(text), ledger = required(text),
    timing = required(text), population = text, genomes = text, columns = text, champion = text,
    state = text, archive = text, recent_columns = text, recent_genomes = text }),
  checkpoint = line("checkpoint", { bytes = required(record { metrics = required(count),
    ledger = required(count), timing = required(count), hashes = required(count) }) }),
  archive = record {
    schema = required(schema_of "archive"), id = required(count),
    index = required(schema.whole(1, 2 ^ 53)), fitness = required(number), cell = count,
    island = count, descriptors = list(number, "a list of numbers"),
    objectives = list(number, "a list of numbers"), novelty = number,
  },
  population = record {
    schema = schema_of "population", id = required(count), generation = required(count),
    parents = required(list(count, "a list of ids")),
    origin = required(schema.choice { "initial", "bred", "elite" }), island = count,
    status = required(schema.choice { "done", "invalid", "diverged", "failed" }), reason = text,
    step_size = finite,
    fitness = finite, cases = list(finite, "a list of numbers"),
    measures = map(finite),
    descriptors = list(finite, "a list of numbers"), objectives = list(finite, "a list of numbers"),
    novelty = finite, age = count,
    body = required(body), outcome = required(run_files.outcome),
    trials = list(run_files.outcome, "a list of outcomes"),
  },
  study = record {
    runs = required(list(record { path = required(text), arm = text, donor = text,
      tuning_evaluations = count, repetition = count, changes = list(text, "a list of texts") },
      "a list of runs")),
    script = record { path = required(text), sha256 = required(text) },
  },
}

---@alias limax.run_files.kind "config"|"status"|"environment"|"metrics"|"ledger"|"timing"|"hashes"|
---"checkpoint"|"archive"|"population"|"study"

-- ---- reading ------------------------------------------------------------------------------------

-- Ends the command; a damaged file may contain anything, but no control character is shown.
local function damaged(where, message)
  failure.raise_damaged(("%s: %s"):format(where, (tostring(message):gsub("%c", "?"))))
end

--- What is wrong with an object of a file: its field, and what was expected. nil if nothing is.
---@param value table
---@param kind limax.run_files.kind
---@return string|nil
function run_files.problem(value, kind) return (select(2, rules[kind](value, ""))) end

-- An object of JSON, checked.
local function checked(json, kind, where)
  local value, message = host.json.decode(json, "")
  -- of a line only the column is wanted
  if value == nil then damaged(where, (message:gsub("^: ", ""):gsub("^line 1, ", ""))) end
  if type(value) ~= "table" then damaged(where, "expected a JSON object") end
  message = run_files.problem(value, kind)
  if message then damaged(where, message) end
  return value
end

local function text_of(path)
  local whole, message = source.read(path)
  if not whole then failure.raise_damaged(message) end
  return whole
end

--- The object of a file that holds one.
---@param kind limax.run_files.kind
---@return table
function run_files.document(path, kind) return checked(text_of(path), kind, path) end

-- What to add to a message about a folder that is none of a run, and holds some.
local function runs_in(folder)
  for _, name in ipairs(host.file.list(folder) or {}) do
    local path = folder .. "/" .. name
    if host.file.exists(path .. "/config.json") == "file" then
      return ("; it holds runs, such as %s: limax list %s"):format(path, folder)
    end
  end
  return ""
end

--- The configuration of a run folder.
---@param folder string
---@return table
function run_files.config(folder)
  local path = folder .. "/config.json"
  if host.file.exists(path) ~= "file" then
    failure.raise(2, ("%s is not a run folder: it has no config.json%s"):format(folder,
      runs_in(folder)))
  end
  -- reading or replacing a pipe would wait forever
  for _, name in ipairs(host.file.list(folder) or {}) do
    local file = folder .. "/" .. name
    if host.file.exists(file) == "other" then damaged(file, "is not a regular file") end
  end
  local config = run_files.document(path, "config")
  -- of the file, for `sealed`
  config.hash = nil
  return config
end

--- The object of a line.
---@param kind limax.run_files.kind
---@param where string file and line, for a message
---@return table
function run_files.line(json, kind, where) return checked(json, kind, where) end

-- The objects of a text with one on each line.
local function objects(content, kind, path, check)
  local lines = {}
  for json in content:gmatch "([^\n]*)\n" do
    local where = ("%s, line %d"):format(path, #lines + 1)
    local value = checked(json, kind, where)
    if check then check(value, where) end
    lines[#lines + 1] = value
  end
  return lines
end

-- The first field of a table that another one lacks, also in its tables.
local function lacking(first, value, path)
  for _, name in ipairs(schema.names(first, path)) do
    local here = path .. "." .. name
    if value[name] == nil then return here end
    local inner = type(first[name]) == "table" and lacking(first[name], value[name], here)
    if inner then return inner end
  end
end

--- The lines of a file with one for each generation. A last line without its end is being written,
--- and ignored. The generations of each repetition follow one another from 0.
---@param kind limax.run_files.kind
---@return table[] lines
function run_files.lines(path, kind)
  local following, first = {}, nil
  return objects(text_of(path), kind, path, function(value, where)
    first = first or value
    -- all generations have the same parameters and materials
    for _, name in ipairs(kind == "metrics" and { "parameters", "materials" } or {}) do
      local missing = lacking(first[name], value[name], name)
      local extra = lacking(value[name], first[name], name)
      if missing then damaged(where, missing .. ": is missing; line 1 has it") end
      if extra then damaged(path .. ", line 1", extra .. ": is missing; a later line has it") end
    end
    local expected = following[value.repetition] or 0
    if value.generation ~= expected then
      damaged(where, ("generation: expected %d, the next one of repetition %d, got %d"):format(
        expected, value.repetition, value.generation))
    end
    following[value.repetition] = expected + 1
  end)
end

--- The robots of a population file.
---@param content string of the file
---@param path string its name
---@return table[]
function run_files.robots(content, path) return objects(content, "population", path) end

--- The rows of an archive's file.
---@param content string of the file
---@param path string its name
---@return table[]
function run_files.archive(content, path) return (objects(content, "archive", path)) end

--- Calls a function with a value of a file; an error of it is one of the file.
---@param where string file and line
---@param ... any arguments
---@return any ... results
function run_files.about(where, call, ...)
  local ok, value = failure.attempt(call, ...)
  if ok then return value end
  if failure.of_machine(value) then error(value, 0) end
  local message = failure.bare(value)
  if message:sub(1, #where) == where then message = message:sub(#where + 3) end
  damaged(where, message)
end

return run_files
