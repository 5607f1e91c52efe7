--- capabilities.lua: what an endpoint and its model were found to take. Requests begin with the
--- most exact form, and what a refusal (400 or 422) names is left out from then on, each once.

local capabilities = {}

-- How an answer's form is asked for, best first.
local FORMATS = { "json_schema", "json_object", "plain" }
local OTHER = { max_tokens = "max_completion_tokens", max_completion_tokens = "max_tokens" }
local JSON_PLEASE = "\n\nAnswer with one JSON object."

-- Words that name response_format without saying so.
local FORMAT_WORDS = { "json_schema", "json_object", "structured output", "grammar",
  "response format", "word 'json'", "contain json" }
-- Complaints about a value, not about a field.
local VALUE_WORDS = { "too large", "too high", "too small", "less than", "greater than", "at most",
  "at least", "exceed" }

---@class limax.llm.capabilities
---@field format "json_schema"|"json_object"|"plain"
---@field token_field "max_tokens"|"max_completion_tokens"
---@field switched boolean was the token field changed?
---@field dropped table<string, boolean> fields that are not sent
local methods = {}
local class = { __index = methods }

--- `provider` as an endpoint has it: OpenAI's own models refuse max_tokens, others know no
--- max_completion_tokens, and would write without end.
---@param provider string
---@param format string|nil where to begin
---@return limax.llm.capabilities
function capabilities.new(provider, format)
  local compatible = provider == "openai_compatible"
  return setmetatable({ format = format or FORMATS[1], switched = false, dropped = {},
    token_field = compatible and "max_tokens" or "max_completion_tokens" }, class)
end

local function has_json(messages)
  for _, message in ipairs(messages) do
    if message.content:lower():find("json", 1, true) then return true end
  end
  return false
end

-- json_object is refused where no message has the word.
local function with_json(messages)
  if has_json(messages) or #messages == 0 then return messages end
  local copy = {}
  for i, message in ipairs(messages) do copy[i] = message end
  local last = copy[#copy]
  copy[#copy] = { role = last.role, content = last.content .. JSON_PLEASE }
  return copy
end

---@class limax.llm.wish
---@field messages { role: string, content: string }[]
---@field max_tokens integer
---@field temperature number|nil
---@field seed integer|nil
---@field schema table|nil a JSON schema
---@field name string|nil of the schema
---@field plain boolean|nil any text will do
---@field probe boolean|nil is it the breaker's?

--- The fields of a request but for its model.
---@param wish limax.llm.wish
---@return table
function methods:fields(wish)
  local fields = { messages = wish.messages, stream = false }
  fields[self.token_field] = wish.max_tokens
  for _, name in ipairs { "temperature", "seed" } do
    if not self.dropped[name] then fields[name] = wish[name] end
  end
  if wish.plain then return fields end
  local format = self.format
  if format == "json_schema" and not wish.schema then format = "json_object" end
  if format == "json_schema" then
    fields.response_format = { type = format,
      json_schema = { name = wish.name or "answer", strict = true, schema = wish.schema } }
  elseif format == "json_object" then
    fields.response_format = { type = format }
    fields.messages = with_json(wish.messages)
  end
  return fields
end

local function first_of(text, words)
  local first
  for _, word in ipairs(words) do
    local at = text:find(word, 1, true)
    if at and (not first or at < first) then first = at end
  end
  return first
end

-- The field of a request that a refusal means: the one that it names as its parameter, else the
-- one that its message names first.
local function named(refusal, fields, token_field)
  local candidates = { response_format = FORMAT_WORDS }
  for _, name in ipairs { token_field, "temperature", "seed" } do candidates[name] = {} end
  local message, found, first = (refusal.message or ""):lower(), nil, nil
  for _, name in ipairs { "response_format", token_field, "temperature", "seed" } do
    if fields[name] ~= nil then
      local param = refusal.param or ""
      if param == name or param:sub(1, #name + 1) == name .. "." then return name end
      local at = message:find("%f[%w_]" .. name .. "%f[^%w_]")
        or first_of(message, candidates[name])
      if at and (not first or at < first) then found, first = name, at end
    end
  end
  return found
end

--- Learns from a refusal of a request with these fields. Returns what is done differently from now
--- on, in words; nil where nothing can be.
---@param refusal { message: string|nil, param: string|nil }
---@param fields table as sent
---@return string|nil
function methods:learn(refusal, fields)
  local name = named(refusal, fields, self.token_field)
  if not name then return nil end
  if name == "response_format" then
    local before = fields.response_format.type
    self.format = before == "json_schema" and "json_object" or "plain"
    return ("format %s instead of %s"):format(self.format, before)
  end
  if name == self.token_field then
    local value = first_of((refusal.message or ""):lower(), VALUE_WORDS)
    if self.switched or value then return nil end
    self.switched, self.token_field = true, OTHER[name]
    return ("%s instead of %s"):format(self.token_field, name)
  end
  self.dropped[name] = true
  return ("no %s"):format(name)
end

--- Plain values, for a checkpoint.
---@return table
function methods:state()
  local dropped = {}
  for name in pairs(self.dropped) do dropped[name] = true end
  return { format = self.format, token_field = self.token_field, switched = self.switched,
    dropped = dropped }
end

---@param state table
function methods:restore(state)
  self.format, self.token_field, self.switched = state.format, state.token_field, state.switched
  self.dropped = {}
  for name in pairs(state.dropped) do self.dropped[name] = true end
end

return capabilities
