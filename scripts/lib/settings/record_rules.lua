--- record_rules.lua: derives from the fields of records.lua the checks of readers, the layout of
--- robots in memory and on disk, the annotations for editors, and the tables of RUN_FOLDER.md.

local defaults = require "limax.settings.defaults"
local records = require "limax.settings.records"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"

local record_rules = {}

--- Sums and squares of larger scores may not be finite.
record_rules.LARGEST_SCORE = 1e150

local experiment = defaults.fields.experiment

-- ---- rules of types -----------------------------------------------------------------------------

local text, finite = schema.string, schema.number {}
local whole, index = schema.whole(0, 2 ^ 53), schema.whole(1, 2 ^ 53)
local hash = schema.text(("%x"):rep(16), "16 hexadecimal digits")

-- The rule of a group of fields of a completed experiment, in which no default is missing.
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

local required, record = schema.required, schema.record
local options = record { name = text, ["function"] = record { file = required(text),
  first_line = required(whole), last_line = required(whole), sha256 = required(text) } }

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

-- Size and hash of a file, or of a line; of an array also the size of a row.
local function part(value, path)
  if value == nil then return nil end
  local size = schema.list_size(value)
  if size ~= 2 and size ~= 3 then
    return nil, path .. ": expected a list of a size and a hash, and the size of a row of an array"
  end
  local _, message = whole(value[1], path .. "[1]")
  if not message then _, message = hash(value[2], path .. "[2]") end
  if not message then _, message = index(value[3], path .. "[3]") end
  return not message and value or nil, message
end

-- A text of one line, which can be shown.
local function line(value, path)
  local result, message = text(value, path)
  if result and (#result > 1000 or terminal.word(result) ~= result) then
    return nil, path .. ": expected a line of at most 1000 characters that can be shown"
  end
  return result, message
end

-- The path of a file or folder below another one.
local function below_folder(value, path)
  local result, message = line(value, path)
  if result and not source.is_below(result) then
    return nil, path .. ": expected a path below this folder"
  end
  return result, message
end

local TYPES = {
  number = schema.number { minimum = -record_rules.LARGEST_SCORE,
    maximum = record_rules.LARGEST_SCORE },
  finite = finite, whole = whole, index = index, text = text, switch = schema.boolean(),
  any = function(value) return value end, objects = schema.table, vector = schema.numbers(3),
  numbers = schema.list(finite, { expected = "a list of numbers" }),
  texts = schema.list(text, { expected = "a list of texts" }), hash = hash, part = part,
  line = line, below = below_folder,
  file = schema.text("[%w_-]+%.json", "the name of a JSON file in this folder"),
  seed = schema.seed, lattice = settings.lattice(), choice = choice,
  population = schema.number(experiment.population),
  generations = schema.number(experiment.generations),
  repetitions = schema.number(experiment.repetitions),
  simulation = simulation, traces = complete(settings.record),
  kept = schema.choice { "best" }, state = schema.choice { "done", "stopped", "failed" },
}

-- ---- the rule of a table ------------------------------------------------------------------------

-- "fitness?" in its two parts.
local function type_of(row)
  local name, optional = row[2]:match "^([^?]*)(%??)$"
  return name, optional == "?"
end

-- The rows directly below a name, each with its own name there.
local function below(rows, prefix)
  local list = {}
  for _, row in ipairs(rows) do
    local name = row[1]:sub(1, #prefix) == prefix and row[1]:sub(#prefix + 1)
    if name and name ~= "" and not name:find "%." then
      list[#list + 1] = { name = name, row = row }
    end
  end
  return list
end

local rule_below

-- The rule of a row's value, which is there.
local function rule_of(rows, row)
  local name = type_of(row)
  if name == "table" then
    return rule_below(rows, row[1] .. ".")
  elseif name == "list" then
    return schema.list(rule_below(rows, row[1] .. "[]."), { expected = "a list" })
  elseif name == "names" then
    return schema.map(rule_of(rows, below(rows, row[1] .. ".")[1].row))
  elseif records[name] then
    return rule_below(records[name], "")
  end
  return TYPES[name]
end

function rule_below(rows, prefix)
  local fields = {}
  for _, each in ipairs(below(rows, prefix)) do
    local rule, _, optional = rule_of(rows, each.row), type_of(each.row)
    assert(rule, each.row[1])
    fields[each.name] = optional and rule or required(rule)
  end
  return record(fields)
end

--- The rule of an object with these fields, for readers. Other fields are kept: a later version may
--- add some.
---@param rows table[] of records.lua
function record_rules.rule(rows) return rule_below(rows, "") end

--- The names of the fields, in order, without those within others.
function record_rules.names(rows)
  local list = {}
  for k, each in ipairs(below(rows, "")) do list[k] = each.name end
  return list
end

local statuses = schema.choice { "done", "invalid", "diverged" }
local OUTCOME = { status = required(statuses), reason = text, coarse = schema.boolean() }
for _, row in ipairs(records.outcome) do
  OUTCOME[row[1]] = OUTCOME[row[1]] or row[2]:find "%[3%]" and TYPES.vector or finite
end
local outcome_rule = record(OUTCOME)
local OF_DONE = { "center_start", "center_middle", "center_end", "time", "step", "steps", "mass" }

--- The rule of an outcome in a robot file.
function record_rules.outcome(value, path)
  local result, message = outcome_rule(value, path)
  for _, name in ipairs(result and result.status == "done" and OF_DONE or {}) do
    if result[name] == nil then return nil, ("%s.%s: is missing"):format(path, name) end
  end
  return result, message
end

-- ---- the layout of robots -----------------------------------------------------------------------

---@class limax.record_rules.facts what decides which fields a robot has, and how long its lists are
---@field letters integer characters of a body's letters
---@field trials integer|nil trials of a robot; nil: one simulation
---@field descriptors integer|nil that the archive measures
---@field objectives integer|nil that archive or survival measure
---@field islands boolean|nil
---@field ages boolean|nil
---@field self_adaptive boolean|nil
---@field archive boolean|nil
---@field novelty boolean|nil
---@field cases integer|nil that the fitness returned
---@field measures string[]|nil names that the fitness returned, sorted

-- The fields of an engine's struct.
local function struct_fields(name)
  local fields = {}
  for k, row in ipairs(records[name]) do
    local kind, count = row[2]:match "^(%w+)%[?(%d*)%]?%??$"
    fields[k] = { name = row[1], kind = kind, count = tonumber(count) }
  end
  return fields
end

local STRUCTS = { body = struct_fields "body", outcome = struct_fields "outcome" }

--- The fields of a robot in an array, for base/structured.lua.
function record_rules.robot_fields(facts)
  local fields = {}
  for _, row in ipairs(records.robot) do
    local kind, count = row[2]:match "^([%w]+)%[?(%w*)%]?%??$"
    local size = tonumber(count) or facts[count]
    local field = { name = row[1], kind = kind, count = size }
    local there = (not row.only or facts[row.only]) and (count == "" or size or count == "trials")
    if kind == "S" then
      -- a multiple of 8 bytes, as every field, so that C has no padding either
      field.kind, field.count = "S" .. math.ceil(size / 8) * 8, nil
    elseif STRUCTS[kind] then
      field.kind, field.struct = STRUCTS[kind], "limax_" .. kind
    elseif kind == "measures" then
      field.kind = {}
      for k, name in ipairs(facts.measures or {}) do
        field.kind[k] = { name = name, kind = "f8" }
      end
      there = field.kind[1] ~= nil
    end
    if there and field.count ~= 0 then fields[#fields + 1] = field end
  end
  return fields
end

-- The condition under which the fields of `only` exist, in words.
local ONLY = { islands = "islands", ages = 'the survival "age_fitness"',
  self_adaptive = 'the mutation "self_adaptive"', descriptors = "an archive's descriptors",
  objectives = "objectives", archive = "an archive", novelty = "a novelty archive" }

-- ---- annotations and pages ----------------------------------------------------------------------

local LUA_TYPES = { number = "number", finite = "number", whole = "integer", index = "integer",
  text = "string", switch = "boolean", any = "any", vector = "number[]", numbers = "number[]",
  texts = "string[]", hash = "string", part = "any[]", table = "table", list = "table[]",
  spread = "limax.spread", diversity = "table", body = "table", ["outcome[trials]"] = "table",
  measures = "table<string, number>" }

--- The fields of a class for editors and help: "---@field best number largest, fitness". Of fields
--- of one name the first counts.
---@param ... table[] rows
function record_rules.annotations(...)
  local lines, seen = {}, {}
  for _, rows in ipairs { ... } do
    for _, each in ipairs(below(rows, "")) do
      local name, optional = type_of(each.row)
      name = name:match "^S%w*%[?%w*%]?$" and "text" or name:match "^f8%[" and "numbers"
        or name == "f8" and "number" or name:match "^[iu]8%[" and "numbers"
        or name:match "^[iu]8" and "whole" or name
      local kind = name == "names" and "table<string, any>" or LUA_TYPES[name] or name
      local words = { each.row[3] ~= "" and each.row[3] or nil }
      if each.row.unit and each.row.unit ~= "1" then words[#words + 1] = each.row.unit end
      if not seen[each.name] then
        lines[#lines + 1] = ("---@field %s%s %s %s"):format(each.name, optional and "?" or "",
          kind, table.concat(words, ", ")):gsub("%s+$", "")
      end
      seen[each.name] = true
    end
  end
  return lines
end

-- Links that a type adds to a meaning.
local PARTS = { spread = "see [Spread](#spread)", diversity = "see [Diversity](#diversity)" }

--- A table of RUN_FOLDER.md: a line for each field.
---@param in_array? boolean are these fields of an array, whose types are shown?
function record_rules.page(rows, in_array)
  local lines = { in_array and "| field | unit | meaning | type |" or "| field | unit | meaning |",
    in_array and "|---|---|---|---|" or "|---|---|---|" }
  for _, row in ipairs(rows) do
    local kind, optional = type_of(row)
    local words = { row[3] ~= "" and row[3] or PARTS[kind] }
    if words[1] ~= PARTS[kind] then words[#words + 1] = PARTS[kind] end
    words[#words + 1] = row.only and "only with " .. ONLY[row.only]
    local meaning = table.concat(words, "; ")
    if optional then meaning = "*optional*" .. (meaning ~= "" and ": " .. meaning or "") end
    lines[#lines + 1] = ("| `%s%s` | %s | %s |%s"):format(row[1], kind == "objects" and "[]" or "",
      row.unit or "", meaning, in_array and (" `%s` |"):format((row[2]:gsub("%?", ""))) or "")
      :gsub("  +", " ")
    -- padding
    if row[1] == "reserved" then lines[#lines] = nil end
  end
  return table.concat(lines, "\n") .. "\n"
end

return record_rules
