--- llm.lua: a language model proposes. Its prompts, the parser of its answers and the supervisor
--- that replaces it on failure are options; README.md has a section on them. The first such loop
--- over an evolution strategy's step size is Custode et al., arXiv 2408.02451; the paper's is arXiv
--- 2405.00698.

local defaults = require "limax.settings.defaults"
local schema = require "limax.engine.schema"
local settings = require "limax.settings.settings"

local fields = defaults.fields.llm

-- A key comes from the environment, so that no file that is shared or recorded contains one.
local function no_key(value, path)
  if value == nil then return nil end
  return nil, ("%s: an experiment cannot name a key, because it is recorded with the run; set"
    .. " LIMAX_LLM_KEY, or LIMAX_LLM_KEY_FILE to a file that only you can read"):format(path)
end

-- A rule for a function, or a value that `accepts`.
local function function_or(accepts, expected)
  return function(value, path)
    if value == nil or type(value) == "function" or accepts(value) then return value end
    return nil, ("%s: expected %s, got %s"):format(path, expected, schema.show(value))
  end
end

-- A parser is a file or a text, not a function: the process in which it runs needs its source.
local function parser(value, path)
  if value == nil or type(value) == "string" and value ~= "" then return value end
  return nil, ("%s: expected the path of a file that returns a parser, or Lua text of several lines"
    .. " that does, got %s"):format(path, schema.show(value))
end

-- `supervise.get` checks the fallback itself.
local function fallback(value, path)
  local name = type(value) == "table" and value[1] or value
  if name ~= "llm" and name ~= "replay" then return value end
  return nil, ("%s: %s cannot be the fallback of a model"):format(path, schema.show(name))
end

local options = {
  prompt = schema.text("[^%c]+", "the path of a prompt"),
  again = schema.text("[^%c]+", "the path of a prompt"),
  context = function_or(function(value) return value == "summary" or value == "paper" end,
    '"summary", "paper" or a function'),
  context_tokens = schema.number { unit = "tokens", minimum = 200, maximum = 1e6, integer = true },
  parse = parser,
  fallback = fallback,
  ask_every = schema.number { value = 1, unit = "generations", minimum = 1, maximum = 1e6,
    integer = true, reason = "as in the paper" },
  client = function_or(function() return false end, "a function that makes a client"),
  -- of the client
  url = schema.text("%S+", "the URL of an endpoint, without spaces"),
  model = schema.text("%S[^%c]*", "the name of a model"),
  -- their defaults depend on the endpoint
  budget = settings.optional(schema.number(fields.budget)),
  timeout = settings.optional(schema.number(fields.timeout)),
  max_tokens = schema.number(fields.max_tokens),
  max_calls = schema.number { unit = "requests", minimum = 1, maximum = 1e9, integer = true },
  max_tokens_total = schema.number { unit = "tokens", minimum = 1, maximum = 1e12 },
  -- some models refuse these, so they are sent only if named
  temperature = schema.number { unit = "1", minimum = 0, maximum = 2 },
  seed = schema.number { unit = "1", minimum = 0, maximum = 2 ^ 31 - 1, integer = true },
  format = schema.choice { "json_schema", "json_object", "plain" },
  key_header = schema.choice { "authorization", "api-key" },
  ca_file = schema.text("[^%c]+", "the path of a file with certificates"),
  allow_insecure = schema.boolean(false),
}
for _, name in ipairs { "key", "api_key", "apikey", "api-key", "authorization", "token",
  "headers" } do
  options[name] = no_key
end

return {
  options = options,
  start = function(chosen, run, replacement)
    return require("limax.supervise.llm.supervisor").start(run, chosen, replacement)
  end,
}
