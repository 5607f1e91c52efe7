--- shape.lua: the types of the fields in the files of a run folder. A folder may come from another
--- version, or from anyone: a field of another type counts as absent, so that the rest is still
--- reported.

local terminal = require "limax.base.terminal"

local shape = {}

-- Larger numbers are not limax's; sums and differences of smaller ones stay finite.
local MOST = 1e100
-- A larger repetition is a damaged line.
local MOST_REPETITIONS = 1e6

local function number(value)
  -- NaN is not equal to itself
  if type(value) == "number" and value == value and math.abs(value) <= MOST then return value end
end

local function whole(value)
  value = number(value)
  if value and value % 1 == 0 and value >= 0 then return value end
end

local function count(value) return whole(value) or 0 end

local function text(value)
  if type(value) == "string" then return value end
end

-- A word for terminals too: no control character may reach one.
local function word(value)
  if type(value) ~= "string" then return nil end
  -- the name of a folder may not be UTF-8, as pages and figures must be
  return (terminal.utf8(value):gsub("%c", "?"):gsub("\194[\128-\159]", "?"))
end
shape.word = word

local function flag(value)
  if type(value) == "boolean" then return value end
end

local function list_of(each)
  return function(value)
    local list = {}
    for _, entry in ipairs(type(value) == "table" and value or {}) do
      list[#list + 1] = each(entry)
    end
    return list
  end
end

local function map_of(each)
  return function(value)
    local map = {}
    for key, entry in pairs(type(value) == "table" and value or {}) do
      if type(key) == "string" then map[key] = each(entry) end
    end
    return map
  end
end

-- A table whose named fields have these types; other fields are kept. What is not a table becomes
-- an empty one, or nil if it is `optional`.
local function record(fields, optional)
  return function(value)
    if type(value) ~= "table" then
      if optional then return nil end
      value = {}
    end
    for name, rule in pairs(fields) do value[name] = rule(value[name]) end
    return value
  end
end

local function scalar(value) return number(value) or word(value) end

local function anything(value)
  -- JSON's null
  if type(value) ~= "userdata" then return value end
end

local diversity = record({ hamming = number, distinct = number, genotype = number }, true)

local quantiles = record({ q10 = number, q25 = number, q50 = number, q75 = number, q90 = number },
  true)

--- A line of metrics.jsonl.
shape.metrics = record { best = number, best_standard = number, mean = number, median = number,
  worst = number, coarse = number, evaluations = count, quantiles = quantiles,
  failed = record { invalid = count, diverged = count, fitness = count },
  champion = record({ id = number }, true), parameters = map_of(number),
  materials = map_of(map_of(number)), measures = map_of(map_of(number)),
  diversity = record { all = diversity, top = diversity } }

--- A line of ledger.jsonl.
shape.ledger = record { supervisor = text, source = text, reason = text,
  entries = list_of(record({ field = text, outcome = text, applied = number, before = number,
    proposed = scalar, reason = text }, true)) }

--- A line of timing.jsonl.
shape.timing = record { ended = text, seconds = map_of(number),
  supervision = record({ asks = number, model_seconds = number, input_tokens = number,
    output_tokens = number, cost = number, fallen_back = flag }, true) }

--- `config.json`.
shape.config = record { name = word, seed = scalar, generations = whole,
  repetitions = whole, run = record({ repetition = whole }, true), simulation = map_of(anything),
  supervisor = anything, fitness = anything,
  not_in_paper = function(value)
    if type(value) == "string" then return { value } end
    if type(value) == "table" then return list_of(text)(value) end
  end }

--- `STATUS`.
shape.status = record { state = word }

-- nil where there are none, as in a session on a CPU
local function gpus(value)
  local list = list_of(record({ name = text }, true))(value)
  return list[1] and list[1].name and list or nil
end

--- `environment.json`.
shape.environment = record { sessions = list_of(record({ started = text, version = text,
  machine = record { compiler = text, system = text },
  device = record { kind = text, cpu = text, gpus = gpus } }, true)) }

--- A line of `population/gNNNN.jsonl`; nil where it is not a robot.
---@return limax.report.ancestor|nil
function shape.robot(value)
  if type(value) ~= "table" or not whole(value.id) or not whole(value.generation) then
    return nil
  end
  local body = record { hash = text, voxels = whole }(value.body)
  return { id = value.id, generation = value.generation, fitness = number(value.fitness),
    parents = list_of(whole)(value.parents), hash = body.hash or "-", voxels = body.voxels or "-" }
end

--- The repetition and generation of a line; nil, message where they are missing.
---@return integer|nil repetition
---@return integer|string generation
function shape.place(value)
  local line = type(value) == "table" and value or {}
  local repetition, generation = whole(line.repetition), whole(line.generation)
  if not repetition or repetition < 1 or repetition > MOST_REPETITIONS then
    return nil, "repetition: expected a whole number from 1"
  end
  if not generation then return nil, "generation: expected a whole number from 0" end
  return repetition, generation
end

return shape
