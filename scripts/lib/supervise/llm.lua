--- llm.lua: a language model proposes. Its prompts, the parser of its answers and the supervisor
--- that replaces it on failure are options; README.md has a section on them. The first such loop
--- over an evolution strategy's step size is Custode et al., arXiv 2408.02451; the paper's is arXiv
--- 2405.00698.

local client_options = require "limax.supervise.llm.options"
local schema = require "limax.engine.schema"

-- A rule for a function, or a value that `accepts`.
local function function_or(accepts, expected)
  return function(value, path)
    if value == nil or type(value) == "function" or accepts(value) then return value end
    return nil, ("%s: expected %s, got %s"):format(path, expected, schema.show(value))
  end
end

-- `supervise.get` checks the fallback itself.
local function fallback(value, path)
  local name = type(value) == "table" and value[1] or value
  if name ~= "llm" and name ~= "replay" then return value end
  return nil, ("%s: %s cannot be the fallback of a model"):format(path, schema.show(name))
end

local function context_tokens(value, path)
  if value == nil then return nil end
  return schema.number({ unit = "tokens", minimum = 200, maximum = 1e6, integer = true })(value,
    path)
end

local options = {
  prompt = schema.text("[^%c]+", "the path of a prompt"),
  again = schema.text("[^%c]+", "the path of a prompt"),
  context = function_or(function(value) return value == "summary" or value == "paper" end,
    '"summary", "paper" or a function'),
  context_tokens = context_tokens,
  parse = function_or(function(value) return type(value) == "string" and value ~= "" end,
    "a file that returns a parser, or a function"),
  fallback = fallback,
  ask_every = schema.number { value = 1, unit = "generations", minimum = 1, maximum = 1e6,
    integer = true, reason = "as in the paper" },
  client = function_or(function() return false end, "a function that makes a client"),
}

-- Those of the endpoint: url, model, budget, ...
for name, rule in pairs(client_options.rules) do options[name] = rule end

return {
  options = options,
  start = function(chosen, run, replacement)
    return require("limax.supervise.llm.supervisor").start(run, chosen, replacement)
  end,
}
