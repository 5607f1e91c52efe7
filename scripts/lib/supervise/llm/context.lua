--- context.lua: the values of a prompt's holes: a summary of the evolution so far and the form of
--- the answer. Numbers have four digits, so that equal histories give equal bytes on every machine.
--- A prompt that is too long loses detail in a fixed order.

local host = require "limax.host"
local proposals = require "limax.supervise.proposals"
local terminal = require "limax.base.terminal"

local context = {}

--- Tokens of a prompt by default. They leave room for an answer within Ollama's default of 4096.
context.TOKENS = 3000

-- Longest name or reason of the run that enters a prompt, bytes.
local LONGEST = 120

-- The parts of a history in a prompt: numbers of the best robots of the last generation, of former
-- proposals and of generations; quantiles and the diversity of genotypes; and for "paper", only the
-- better half of each population?
local function detail_of(bodies, outcomes, spread, generations, half)
  return { bodies = bodies, outcomes = outcomes, spread = spread, generations = generations,
    half = half }
end

--- Levels of detail, from most to least; the first that fits is taken.
context.levels = {
  summary = { detail_of(5, 3, true, 3), detail_of(3, 3, true, 3), detail_of(1, 3, true, 3),
    detail_of(0, 3, true, 3), detail_of(0, 1, true, 3), detail_of(0, 1, false, 3),
    detail_of(0, 1, false, 1), detail_of(0, 0, false, 1) },
  paper = { detail_of(0, 0, true, 3), detail_of(0, 0, true, 2), detail_of(0, 0, true, 1),
    detail_of(0, 0, true, 1, true) },
}

-- `facts` are the values for holes: the context's name, history, limits, what may be changed
-- (`allowed`), the materials' first values, and the configuration.
local function materials_now(facts) return facts.history[#facts.history].materials.materials end

local function short(value) return terminal.beginning(value, LONGEST) end

-- A value for each field of each material that may be set.
local function by_material(list, value_of)
  local all = {}
  for _, material in ipairs(list) do
    for _, field in ipairs(proposals.material_fields(material)) do
      local name = short(material.name)
      all[name] = all[name] or {}
      all[name][field] = value_of(material, field)
    end
  end
  return all
end

-- An object of JSON schema in the subset that all endpoints share: every field is required and
-- nullable, without ranges, which proposals.lua checks.
local function object(properties)
  local required = {}
  for name in pairs(properties) do required[#required + 1] = name end
  table.sort(required)
  return { type = "object", properties = properties, required = required,
    additionalProperties = false }
end

--- The object that a model is asked to fill in, with null where nothing changes, and its JSON
--- schema.
function context.answer(facts)
  local number = { type = { "number", "null" } }
  local form, properties = { reason = "" }, { reason = { type = "string" } }
  for _, limit in ipairs(facts.allowed.hyperparameters and facts.limits or {}) do
    if not limit.material then
      form[limit.field], properties[limit.field] = host.json.null, number
    end
  end
  if facts.allowed.materials then
    form.materials = by_material(materials_now(facts), function() return host.json.null end)
    local each = by_material(materials_now(facts), function() return number end)
    for name, fields in pairs(each) do each[name] = object(fields) end
    properties.materials = object(each)
  end
  return form, object(properties)
end

local function rounded(value) return value and tonumber(("%.4g"):format(value)) or nil end

local function rounded_all(values)
  local copy = {}
  for name, value in pairs(values) do copy[name] = rounded(value) end
  return copy
end

-- A value, its range and what one generation can reach.
local function choices(limit, now, unit)
  local low, high = limit.minimum * unit, limit.maximum * unit
  local least, most = proposals.reach(limit, now, unit)
  local function inside(value) return rounded(math.min(math.max(value, low), high)) end
  return { now = rounded(now), range = { rounded(low), rounded(high) },
    next = { inside(least), inside(most) } }
end

local function parameters(facts)
  if not facts.allowed.hyperparameters then return "none: they are fixed in this experiment" end
  local list, now = {}, facts.history[#facts.history].parameters
  for _, limit in ipairs(facts.limits) do
    if not limit.material then list[limit.field] = choices(limit, now[limit.field], 1) end
  end
  return list
end

local function materials(facts)
  if not facts.allowed.materials then return "none: they are fixed in this experiment" end
  local limit_of = {}
  for _, limit in ipairs(facts.limits) do limit_of[limit.field] = limit end
  return by_material(materials_now(facts), function(material, field)
    local unit = field == "stiffness" and facts.first[material.name].stiffness or 1
    return choices(limit_of[field], material[field], unit)
  end)
end

local function generation(entry, facts, detail)
  local all = entry.diversity and entry.diversity.all or {}
  local summary = { generation = entry.generation, parameters = rounded_all(entry.parameters),
    best = rounded(entry.best), best_standard = rounded(entry.best_standard),
    mean = rounded(entry.mean), scored = entry.scored, failed = entry.failed,
    diversity = { hamming = rounded(all.hamming), distinct = all.distinct } }
  if facts.allowed.materials then
    summary.materials = by_material(entry.materials.materials, function(material, field)
      return rounded(material[field])
    end)
  end
  if detail.spread then
    summary.quantiles = rounded_all(entry.quantiles or {})
    summary.diversity.genotype = rounded(all.genotype)
  end
  return summary
end

-- One summary for each of the newest generations, oldest first.
local function generations(facts, detail)
  local list, history = {}, facts.history
  for k = math.max(1, #history - detail.generations + 1), #history do
    list[#list + 1] = generation(history[k], facts, detail)
  end
  return list
end

-- The outcomes of former proposals: their fields, and the best before and after.
local function outcomes(facts, detail)
  local list, history = host.json.array {}, facts.history
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

local function letters_of(entry)
  local list = {}
  for _, material in ipairs(entry.materials.materials) do
    list[short(material.letter)] = short(material.name)
  end
  return list
end

-- The best robots. Layers of a body from the lowest, separated by blanks, rows by slashes.
local function robots(population, count)
  local list = {}
  for k = 1, math.min(count, #population.ranked) do
    local record = population.rows[population.ranked[k]]
    list[k] = { fitness = rounded(record.fitness),
      body = record.body.letters:gsub("\n\n", " "):gsub("\n", "/") .. "" }
  end
  return list
end

local function bodies(facts, detail)
  if detail.bodies == 0 then return "left out" end
  local entry = facts.history[#facts.history]
  return { letters = letters_of(entry), robots = robots(entry.population, detail.bodies) }
end

local function populations(facts, detail)
  local list, history = generations(facts, detail), facts.history
  for k, summary in ipairs(list) do
    local population = history[#history - #list + k].population
    summary.population = robots(population,
      detail.half and math.ceil(#population / 2) or #population)
  end
  return { letters = letters_of(history[#history]), generations = list }
end

-- A budget that may end the run before its last generation.
local function evaluations(facts)
  local spent = 0
  for _, entry in ipairs(facts.history) do spent = spent + entry.evaluations end
  return { budget = facts.config.evaluations, spent = spent }
end

--- The values of all holes but `answer`, at one level of detail.
function context.holes(facts, detail)
  local config = facts.config
  local fitness = config.fitness
  if type(fitness) == "table" then fitness = fitness.name or "a function; larger is better" end
  return {
    run = { next_generation = facts.history[#facts.history].generation + 1,
      generations = config.generations, population = config.population,
      lattice = config.lattice, fitness = short(fitness),
      evaluations = config.evaluations and evaluations(facts) },
    parameters = parameters(facts), materials = materials(facts),
    generations = generations(facts, detail), outcomes = outcomes(facts, detail),
    bodies = bodies(facts, detail),
    populations = facts.name == "paper" and populations(facts, detail) or nil,
  }
end

return context
