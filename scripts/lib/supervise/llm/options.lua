--- options.lua: the fields of an experiment's `llm` supervisor that the client reads, each with its
--- rule. A key is none of them: it comes from the environment, so that no file that is shared or
--- recorded can hold one.

local defaults = require "limax.settings.defaults"
local schema = require "limax.base.schema"

local fields = defaults.fields.llm

-- Fields that stay absent unless an experiment names them: no cap, no price (no table of prices
-- stays true), and nothing sent that some model refuses.
local absent = {
  max_calls = { unit = "requests", minimum = 1, maximum = 1e9, integer = true },
  max_tokens_total = { unit = "tokens", minimum = 1, maximum = 1e12 },
  max_cost = { unit = "the currency of the price", above = 0, maximum = 1e9 },
  price = { unit = "per 1e6 tokens", minimum = 0, maximum = 1e6 },
  temperature = { unit = "1", minimum = 0, maximum = 2 },
  seed = { unit = "1", minimum = 0, maximum = 2 ^ 31 - 1, integer = true },
}

local function no_key(given, path)
  if given == nil then return nil end
  return nil, ("%s: an experiment cannot name a key, because it is recorded with the run; set"
    .. " LIMAX_LLM_KEY, or LIMAX_LLM_KEY_FILE to a file that you alone can read"):format(path)
end

-- A number that stays absent where none is given, or whose default depends on the endpoint.
local function optional(field)
  local rule = schema.number(field)
  return function(given, path)
    if given == nil then return nil end
    return rule(given, path)
  end
end

-- { input = , output = }, both or none: half a price is no price.
local function price(given, path)
  if given == nil then return nil end
  local number = schema.number(absent.price)
  local checked, message = schema.fields { input = number, output = number }(given, path)
  if not checked then return nil, message end
  if not checked.input or not checked.output then
    return nil, path .. ": expected { input = , output = }, both per 1e6 tokens"
  end
  return checked
end

local options = {}

--- Rules by name, as `choice.read` takes them.
---@type table<string, schema.rule>
options.rules = {
  url = schema.text("%S+", "the URL of an endpoint, without spaces"),
  model = schema.text("%S[^%c]*", "the name of a model"),
  budget = optional(fields.budget),
  timeout = optional(fields.timeout),
  max_tokens = schema.number(fields.max_tokens),
  max_calls = optional(absent.max_calls),
  max_tokens_total = optional(absent.max_tokens_total),
  max_cost = optional(absent.max_cost),
  price = price,
  temperature = optional(absent.temperature),
  seed = optional(absent.seed),
  format = schema.choice { "json_schema", "json_object", "plain" },
  key_header = schema.choice { "authorization", "api-key" },
  ca_file = schema.text("[^%c]+", "the path of a file with certificates"),
  allow_insecure = schema.boolean(false),
  key = no_key, api_key = no_key, apikey = no_key, ["api-key"] = no_key, authorization = no_key,
  token = no_key, headers = no_key,
}

--- What single rules cannot see; nil where nothing is wrong.
---@param checked table
---@return string|nil message
function options.conflict(checked)
  if checked.max_cost and not checked.price then
    return "max_cost needs price = { input = , output = }, per 1e6 tokens: without it no cost is"
      .. " known"
  end
  return nil
end

return options
