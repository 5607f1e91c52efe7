--- llm.lua: a language model proposes. What it is asked, how its answers are read and who takes its
--- place are options; README.md has a section on them. The first such loop over an evolution
--- strategy's step size is Custode et al., arXiv 2408.02451; the paper's is arXiv 2405.00698.

local client_options = require "limax.supervise.llm.options"
local schema = require "limax.base.schema"

local function text_or_function(expected)
  return function(given, path)
    if given == nil or type(given) == "function" then return given end
    if type(given) == "string" and given ~= "" then return given end
    return nil, ("%s: expected %s, got %s"):format(path, expected, schema.show(given))
  end
end

local function context(given, path)
  if given == nil or type(given) == "function" then return given end
  if given == "summary" or given == "paper" then return given end
  return nil, ('%s: expected "summary", "paper" or a function, got %s'):format(path,
    schema.show(given))
end

local function fallback(given, path)
  if given == nil or given == "keep" or type(given) == "function" then return given end
  local name = type(given) == "table" and given[1] or given
  if name == "llm" or name == "replay" then
    return nil, ("%s: %s cannot stand in for a model"):format(path, schema.show(name))
  end
  -- an unknown name or option raises with its own words
  require("limax.supervise").get(given)
  return given
end

local function own_client(given, path)
  if given == nil or type(given) == "function" then return given end
  return nil, ("%s: expected a function that makes a client, got %s"):format(path,
    schema.show(given))
end

local options = {
  prompt = schema.text("[^%c]+", "the path of a prompt"),
  again = schema.text("[^%c]+", "the path of a prompt"),
  context = context,
  context_tokens = function(given, path)
    if given == nil then return nil end
    return schema.number({ unit = "tokens", minimum = 200, maximum = 1e6, integer = true })(given,
      path)
  end,
  parse = text_or_function "a file that returns a parser, or a function",
  fallback = fallback,
  ask_every = schema.number { value = 1, unit = "generations", minimum = 1, maximum = 1e6,
    integer = true, reason = "as in the paper" },
  client = own_client,
}

-- Those of the endpoint: url, model, budget, ...; a key is refused.
for name, rule in pairs(client_options.rules) do options[name] = rule end

return {
  options = options,
  start = function(given, run) return require("limax.supervise.llm.supervisor").start(run, given) end,
}
