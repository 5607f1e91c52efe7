--- model_arms.lua: the arms of a study that ask a language model: as shipped, with the paper's
--- literal populations, told of another repetition's history, and with the parameters' names
--- replaced by letters. In a study the fallback is `keep`, so that no other supervisor's work
--- passes for the model's.

local model_arms = {}

--- Tokens of one answer, as an estimate of what a study costs: the default prompt and a short one.
model_arms.TOKENS = 3300

local function llm(options)
  local spec = { "llm", fallback = "keep" }
  for name, value in pairs(options or {}) do spec[name] = value end
  return spec
end

--- Is there an endpoint to ask?
---@return boolean
function model_arms.available()
  local url = os.getenv "LIMAX_LLM_URL"
  return url ~= nil and url ~= "" and require("limax.supervise").entries.llm ~= nil
end

--- The arms.
---@param materials table supervision of materials alone
---@param both table of both
---@return limax.study.arm[]
function model_arms.list(materials, both)
  return {
    { name = "llm", asks = true, supervisor = llm() },
    { name = "llm_materials", asks = true, supervisor = llm(), supervision = materials },
    { name = "llm_both", asks = true, supervisor = llm(), supervision = both },
    { name = "llm_paper", asks = true,
      supervisor = llm { prompt = "paper.md", context = "paper" } },
    { name = "llm_unnamed", asks = true, supervisor = llm { client = model_arms.unnamed } },
    { name = "llm_blind", asks = true, blind = true, supervisor = llm() },
  }
end

-- ---- names replaced by letters ------------------------------------------------------------------

-- What a model might know these parameters by, and what it is told in their place.
local LETTERS = { { "mutation_rate", "A" }, { "mutation_scale", "B" }, { "crossover_rate", "C" },
  { "elite_fraction", "D" }, { "stiffness", "E" }, { "amplitude", "F" }, { "phase", "G" } }

--- A text with every parameter's name replaced by its letter.
---@param text string
---@return string
function model_arms.without_names(text)
  for _, pair in ipairs(LETTERS) do
    text = text:gsub("%f[%w_]" .. pair[1] .. "%f[^%w_]", pair[2])
  end
  return text
end

--- A JSON text with the letters that stand for fields replaced by their names.
---@param text string
---@return string
function model_arms.with_names(text)
  for _, pair in ipairs(LETTERS) do
    text = text:gsub('"' .. pair[2] .. '"(%s*:)', '"' .. pair[1] .. '"%1')
  end
  return text
end

-- A schema's tables with names replaced in keys and values.
local function renamed(value)
  if type(value) == "string" then return model_arms.without_names(value) end
  -- JSON's null and the like stay what they are
  if type(value) ~= "table" or getmetatable(value) ~= nil and #value == 0 then return value end
  local copy = setmetatable({}, getmetatable(value))
  for key, entry in pairs(value) do
    copy[type(key) == "string" and model_arms.without_names(key) or key] = renamed(entry)
  end
  return copy
end

--- A client whose model never reads a parameter's name: messages and schema go out with letters,
--- answers come back with names.
---@param options table of the supervisor
---@param given table
---@return table client
function model_arms.unnamed(options, given)
  local plain = {}
  for name, value in pairs(options) do plain[name] = value end
  plain.client = nil
  local inner, message = require("limax.supervise.llm.client").new(plain, given)
  if not inner then return nil, message end
  local client = setmetatable({}, { __index = function(_, name)
    local value = inner[name]
    if type(value) ~= "function" then return value end
    return function(_, ...) return value(inner, ...) end
  end })
  function client:ask(messages, request)
    local asked = {}
    for k, each in ipairs(messages) do
      asked[k] = { role = each.role, content = model_arms.without_names(each.content) }
    end
    local changed = {}
    for name, value in pairs(request) do changed[name] = value end
    changed.schema = renamed(request.schema)
    local answer, problem = inner:ask(asked, changed)
    if not answer then return nil, problem end
    for _, field in ipairs { "content", "reasoning" } do
      if answer[field] then answer[field] = model_arms.with_names(answer[field]) end
    end
    return answer
  end
  return client
end

-- ---- another repetition's history ---------------------------------------------------------------

--- A context that tells of another run's generations in the place of its own; what may be changed,
--- and from where, stays its own.
---@param other limax.run with its whole history
---@return fun(history: table[], limits: limax.limit[]): table
function model_arms.history_of(other)
  local context = require "limax.supervise.llm.context"
  return function(history, limits)
    local told = {}
    for k = 1, math.min(#history, #other.history) do told[k] = other.history[k] end
    local holes = context.holes({ name = "summary", history = told, limits = limits,
      allowed = other.config.supervision, first = other.first_fields, config = other.config },
      context.levels("summary")[1])
    return { generations = holes.generations, outcomes = holes.outcomes, bodies = holes.bodies }
  end
end

return model_arms
