--- context.lua: what a prompt tells a model of the evolution so far, as values for its holes. All
--- numbers are rounded to four digits, so that equal histories give equal bytes on every machine.
--- Where a prompt is too long for its budget of tokens, detail goes in a stated order.

local host = require "limax.host"
local ledger = require "limax.supervise.ledger"

local context = {}

--- Bytes of a prompt per token, on the low side for text that is mostly numbers: an estimate that
--- is too small would let a server cut the prompt silently.
context.BYTES_PER_TOKEN = 3

--- Tokens of a prompt if nothing else is said: what leaves room for an answer in the 4096 of
--- Ollama's default.
context.TOKENS = 3000

-- Longest text of the run's own (names, reasons) that enters a prompt, bytes.
local LONGEST = 120

---@class limax.llm.detail how much of a history is told
---@field bodies integer best robots of the last generation
---@field outcomes integer former proposals
---@field spread boolean quantiles and the diversity of genotypes
---@field generations integer
---@field half boolean|nil of "paper": the better half of each population

-- What is told, from most to least: the first that fits is taken. Bodies go first, then all but
-- the last proposal, the spread, the older generations, the last proposal.
local SUMMARY = {
  { bodies = 5, outcomes = 3, spread = true, generations = 3 },
  { bodies = 3, outcomes = 3, spread = true, generations = 3 },
  { bodies = 1, outcomes = 3, spread = true, generations = 3 },
  { bodies = 0, outcomes = 3, spread = true, generations = 3 },
  { bodies = 0, outcomes = 1, spread = true, generations = 3 },
  { bodies = 0, outcomes = 1, spread = false, generations = 3 },
  { bodies = 0, outcomes = 1, spread = false, generations = 1 },
  { bodies = 0, outcomes = 0, spread = false, generations = 1 },
}

-- The paper's populations: fewer generations, then the better half of one.
local PAPER = {
  { bodies = 0, outcomes = 0, spread = true, generations = 3 },
  { bodies = 0, outcomes = 0, spread = true, generations = 2 },
  { bodies = 0, outcomes = 0, spread = true, generations = 1 },
  { bodies = 0, outcomes = 0, spread = true, generations = 1, half = true },
}

--- The levels of detail of a context, from most to least.
---@param name "summary"|"paper"
---@return limax.llm.detail[]
function context.levels(name) return name == "paper" and PAPER or SUMMARY end

--- Estimated tokens of a list of messages.
---@param messages limax.llm.message[]
---@return integer
function context.tokens(messages)
  local bytes = 0
  for _, message in ipairs(messages) do bytes = bytes + #message.content end
  return math.ceil(bytes / context.BYTES_PER_TOKEN)
end

-- ---- pieces -------------------------------------------------------------------------------------

local function rounded(value) return value and tonumber(("%.4g"):format(value)) or nil end

local function rounded_all(values)
  local copy = {}
  for name, value in pairs(values) do copy[name] = rounded(value) end
  return copy
end

-- A text of the run's own, of bounded length, cut between letters of UTF-8.
local function short(text)
  if #text <= LONGEST then return text end
  local last = LONGEST
  while last > 1 and text:byte(last + 1) >= 0x80 and text:byte(last + 1) < 0xc0 do
    last = last - 1
  end
  return text:sub(1, last)
end

-- A value, its range and what one generation can reach.
local function choices(limit, now, unit)
  local low, high = limit.minimum * unit, limit.maximum * unit
  local least, most = ledger.reach(limit, now, unit)
  local function inside(value) return rounded(math.min(math.max(value, low), high)) end
  return { now = rounded(now), range = { rounded(low), rounded(high) },
    next = { inside(least), inside(most) } }
end

local function parameters(given)
  if not given.allowed.hyperparameters then return "none: they are fixed in this experiment" end
  local list, now = {}, given.history[#given.history].parameters
  for _, limit in ipairs(given.limits) do
    if not limit.material then list[limit.field] = choices(limit, now[limit.field], 1) end
  end
  return list
end

local function materials(given)
  if not given.allowed.materials then return "none: they are fixed in this experiment" end
  local list, limit_of = {}, {}
  for _, limit in ipairs(given.limits) do limit_of[limit.field] = limit end
  for _, material in ipairs(given.history[#given.history].materials.materials) do
    for _, field in ipairs(ledger.material_fields(material)) do
      local unit = field == "stiffness" and given.first[material.name].stiffness or 1
      local name = short(material.name)
      list[name] = list[name] or {}
      list[name][field] = choices(limit_of[field], material[field], unit)
    end
  end
  return list
end

local function material_values(entry)
  local list = {}
  for _, material in ipairs(entry.materials.materials) do
    for _, field in ipairs(ledger.material_fields(material)) do
      local name = short(material.name)
      list[name] = list[name] or {}
      list[name][field] = rounded(material[field])
    end
  end
  return list
end

local function generation(entry, given, detail)
  local all = entry.diversity and entry.diversity.all or {}
  local told = { generation = entry.generation, parameters = rounded_all(entry.parameters),
    best = rounded(entry.best), best_standard = rounded(entry.best_standard),
    mean = rounded(entry.mean), scored = entry.scored, failed = entry.failed,
    diversity = { hamming = rounded(all.hamming), distinct = all.distinct } }
  if given.allowed.materials then told.materials = material_values(entry) end
  if detail.spread then
    told.quantiles = rounded_all(entry.quantiles or {})
    told.diversity.genotype = rounded(all.genotype)
  end
  return told
end

-- The newest `count` entries of the history, oldest first.
local function newest(history, count)
  local list = {}
  for k = math.max(1, #history - count + 1), #history do list[#list + 1] = history[k] end
  return list
end

local function generations(given, detail)
  local list = {}
  for k, entry in ipairs(newest(given.history, detail.generations)) do
    list[k] = generation(entry, given, detail)
  end
  return list
end

-- What became of the former proposals: fields, and the best before and after.
local function outcomes(given, detail)
  local list, history = host.json.array {}, given.history
  for k = math.max(2, #history - detail.outcomes + 1), #history do
    local record, fields = history[k].ledger, {}
    for _, entry in ipairs(record.entries) do
      if entry.outcome ~= "kept" then
        local proposed = entry.proposed
        fields[short(entry.field)] = { outcome = entry.outcome,
          proposed = type(proposed) == "number" and rounded(proposed) or short(tostring(proposed)),
          applied = rounded(entry.applied), why = entry.reason and short(entry.reason) }
      end
    end
    list[#list + 1] = { generation = history[k].generation, fields = fields,
      source = record.source or record.supervisor, reason = record.reason and short(record.reason),
      best_before = rounded(history[k - 1].best_standard or history[k - 1].best),
      best_after = rounded(history[k].best_standard or history[k].best) }
  end
  return list
end

-- Layers from the lowest, parted by blanks, rows of a layer by strokes.
local function slices(letters) return (letters:gsub("\n\n", " "):gsub("\n", "/")) end

local function letters_of(entry)
  local list = {}
  for _, material in ipairs(entry.materials.materials) do
    list[short(material.letter)] = short(material.name)
  end
  return list
end

local function robots(population, count)
  local list = {}
  for k = 1, math.min(count, #population.ranked) do
    local record = population.records[population.ranked[k]]
    list[k] = { fitness = rounded(record.fitness), body = slices(record.body.letters) }
  end
  return list
end

local function bodies(given, detail)
  if detail.bodies == 0 then return "left out" end
  local entry = given.history[#given.history]
  return { letters = letters_of(entry), robots = robots(entry.population, detail.bodies) }
end

local function populations(given, detail)
  local list = {}
  for k, entry in ipairs(newest(given.history, detail.generations)) do
    local told = generation(entry, given, detail)
    local count = #entry.population
    if detail.half then count = math.ceil(count / 2) end
    told.population = robots(entry.population, count)
    list[k] = told
  end
  return { letters = letters_of(given.history[#given.history]), generations = list }
end

-- A budget that ends the run before its last generation may come.
local function evaluations(given)
  local spent = 0
  for _, entry in ipairs(given.history) do spent = spent + entry.evaluations end
  return { budget = given.config.evaluations, spent = spent }
end

-- ---- the whole ----------------------------------------------------------------------------------

---@class limax.llm.context.given
---@field name "summary"|"paper"
---@field history table[]
---@field limits limax.limit[]
---@field allowed limax.llm.allowed
---@field first table<string, table<string, number>> first values of the materials
---@field form table the object to be filled in (answer.lua)
---@field config table the experiment's configuration

--- The values of all holes at one level of detail.
---@param given limax.llm.context.given
---@param detail limax.llm.detail
---@return table<string, string|table>
function context.holes(given, detail)
  local config = given.config
  local fitness = config.fitness
  if type(fitness) == "table" then fitness = fitness.name or "a function; larger is better" end
  local holes = {
    run = { next_generation = given.history[#given.history].generation + 1,
      generations = config.generations, population = config.population,
      lattice = config.lattice, fitness = short(fitness),
      evaluations = config.evaluations and evaluations(given) },
    parameters = parameters(given), materials = materials(given), answer = given.form,
    generations = generations(given, detail), outcomes = outcomes(given, detail),
    bodies = bodies(given, detail),
  }
  if given.name == "paper" then holes.populations = populations(given, detail) end
  return holes
end

return context
