--- options.lua: the options of the `llm` supervisor that its client reads, with their rules. A key
--- is none of them: it comes from the environment, so that no file that is shared or recorded
--- contains one.

local defaults = require "limax.settings.defaults"
local schema = require "limax.engine.schema"

local fields = defaults.fields.llm

local function no_key(value, path)
  if value == nil then return nil end
  return nil, ("%s: an experiment cannot name a key, because it is recorded with the run; set"
    .. " LIMAX_LLM_KEY, or LIMAX_LLM_KEY_FILE to a file that only you can read"):format(path)
end

-- A number without a default, or with one that depends on the endpoint.
local function optional(field)
  local rule = schema.number(field)
  return function(value, path)
    if value == nil then return nil end
    return rule(value, path)
  end
end

-- { input = , output = }
local function price(value, path)
  if value == nil then return nil end
  local number = schema.number { unit = "per 1e6 tokens", minimum = 0, maximum = 1e6 }
  local checked, message = schema.fields { input = number, output = number }(value, path)
  if not checked then return nil, message end
  if not checked.input or not checked.output then
    return nil, path .. ": expected { input = , output = }, both per 1e6 tokens"
  end
  return checked
end

local options = {}

--- Rules by name, for `choice.read`.
---@type table<string, schema.rule>
options.rules = {
  url = schema.text("%S+", "the URL of an endpoint, without spaces"),
  model = schema.text("%S[^%c]*", "the name of a model"),
  budget = optional(fields.budget),
  timeout = optional(fields.timeout),
  max_tokens = schema.number(fields.max_tokens),
  max_calls = optional { unit = "requests", minimum = 1, maximum = 1e9, integer = true },
  max_tokens_total = optional { unit = "tokens", minimum = 1, maximum = 1e12 },
  max_cost = optional { unit = "the currency of the price", above = 0, maximum = 1e9 },
  price = price,
  -- some models refuse these, so they are sent only if named
  temperature = optional { unit = "1", minimum = 0, maximum = 2 },
  seed = optional { unit = "1", minimum = 0, maximum = 2 ^ 31 - 1, integer = true },
  format = schema.choice { "json_schema", "json_object", "plain" },
  key_header = schema.choice { "authorization", "api-key" },
  ca_file = schema.text("[^%c]+", "the path of a file with certificates"),
  allow_insecure = schema.boolean(false),
}
for _, name in ipairs { "key", "api_key", "apikey", "api-key", "authorization", "token",
  "headers" } do
  options.rules[name] = no_key
end

--- What is wrong with the options together; nil where nothing is.
---@return string|nil message
function options.conflict(checked)
  if checked.max_cost and not checked.price then
    return "max_cost needs price = { input = , output = }, per 1e6 tokens: without it no cost is"
      .. " known"
  end
end

return options
