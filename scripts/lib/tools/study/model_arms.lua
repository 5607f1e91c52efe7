--- model_arms.lua: the arms of a study that ask a language model: as shipped, with the whole
--- populations as in the paper, with letters in place of the parameters' names, and with another
--- repetition's history. In a study the fallback is `keep`, so that no other supervisor's work is
--- counted as the model's.

local source = require "limax.base.source"

local model_arms = {}

--- Estimated tokens of one question and answer, with the default prompt.
model_arms.TOKENS = 3300

local function llm(options)
  local spec = source.copy(options or {})
  spec[1], spec.fallback = "llm", "keep"
  return spec
end

--- Is an endpoint configured?
function model_arms.available()
  local url = os.getenv "LIMAX_LLM_URL"
  return url ~= nil and url ~= ""
end

---@param both table supervision of hyperparameters and materials
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

-- ---- letters in place of names ------------------------------------------------------------------

local LETTERS = { { "mutation_rate", "A" }, { "mutation_scale", "B" }, { "crossover_rate", "C" },
  { "elite_fraction", "D" }, { "stiffness", "E" }, { "amplitude", "F" }, { "phase", "G" } }

--- A text with every parameter's name replaced by its letter.
function model_arms.without_names(text)
  for _, pair in ipairs(LETTERS) do
    text = text:gsub("%f[%w_]" .. pair[1] .. "%f[^%w_]", pair[2])
  end
  return text
end

--- A JSON text with letters that are keys replaced by the parameters' names.
function model_arms.with_names(text)
  for _, pair in ipairs(LETTERS) do
    text = text:gsub('"' .. pair[2] .. '"(%s*:)', '"' .. pair[1] .. '"%1')
  end
  return text
end

-- A JSON value with names replaced in keys and strings. JSON's null and empty lists are kept.
local function renamed(value)
  if type(value) == "string" then return model_arms.without_names(value) end
  if type(value) ~= "table" or getmetatable(value) ~= nil and #value == 0 then return value end
  local copy = setmetatable({}, getmetatable(value))
  for key, entry in pairs(value) do
    copy[type(key) == "string" and model_arms.without_names(key) or key] = renamed(entry)
  end
  return copy
end

--- A client whose model never reads a parameter's name: messages and schema are sent with letters,
--- answers are translated back.
function model_arms.unnamed(options, context)
  local plain = source.copy(options)
  plain.client = nil
  local inner, message = require("limax.supervise.llm.client").new(plain, context)
  if not inner then return nil, message end
  local client = setmetatable({}, { __index = function(_, name)
    local value = inner[name]
    if type(value) ~= "function" then return value end
    return function(_, ...) return value(inner, ...) end
  end })
  function client:ask(messages, request)
    local changed, asked = source.copy(request), {}
    changed.schema = renamed(request.schema)
    for k, each in ipairs(messages) do
      asked[k] = { role = each.role, content = model_arms.without_names(each.content) }
    end
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

--- A context with the generations of another run instead of its own. The allowed changes and the
--- current values remain its own.
---@param other limax.run with its whole history
---@return fun(history: table[], limits: limax.limit[]): table
function model_arms.history_of(other)
  local context = require "limax.supervise.llm.context"
  return function(history, limits)
    local shown = {}
    for k = 1, math.min(#history, #other.history) do shown[k] = other.history[k] end
    local holes = context.holes({ name = "summary", history = shown, limits = limits,
      allowed = other.config.supervision, first = other.first_fields, config = other.config },
      context.levels.summary[1])
    return { generations = holes.generations, outcomes = holes.outcomes, bodies = holes.bodies }
  end
end

return model_arms
