--- form.lua: the fields of a request, and which of them an endpoint and its model were found to
--- accept. Requests begin with the most exact form; a field that a refusal (400 or 422) names is
--- left out from then on.

local form = {}

local OTHER = { max_tokens = "max_completion_tokens", max_completion_tokens = "max_tokens" }
local JSON_PLEASE = "\n\nAnswer with one JSON object."

-- Words that mean response_format.
local FORMAT_WORDS = { "json_schema", "json_object", "structured output", "grammar",
  "response format", "word 'json'", "contain json" }
-- Complaints about a value, not about a field.
local VALUE_WORDS = { "too large", "too high", "too small", "less than", "greater than", "at most",
  "at least", "exceed" }

---@class limax.llm.form plain values
---@field format "json_schema"|"json_object"|"plain"
---@field token_field "max_tokens"|"max_completion_tokens"
---@field switched boolean was the token field changed?
---@field dropped table<string, boolean> fields that are not sent

--- OpenAI's own models refuse max_tokens; other servers do not know max_completion_tokens and would
--- write without end.
---@param provider string as an endpoint has it
---@param format string|nil the first to try
function form.new(provider, format)
  return { format = format or "json_schema", switched = false, dropped = {},
    token_field = provider == "openai_compatible" and "max_tokens" or "max_completion_tokens" }
end

-- json_object is refused where no message has the word.
local function with_json(messages)
  for _, message in ipairs(messages) do
    if message.content:lower():find("json", 1, true) then return messages end
  end
  local copy = { unpack(messages) }
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

--- The fields of a request except its model.
function form.fields(accepted, wish)
  local fields = { messages = wish.messages, stream = false }
  fields[accepted.token_field] = wish.max_tokens
  for _, name in ipairs { "temperature", "seed" } do
    if not accepted.dropped[name] then fields[name] = wish[name] end
  end
  local format = wish.plain and "plain" or accepted.format
  if format == "json_schema" and wish.schema then
    fields.response_format = { type = format,
      json_schema = { name = wish.name or "answer", strict = true, schema = wish.schema } }
  elseif format ~= "plain" then
    fields.response_format = { type = "json_object" }
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

-- The field that a refusal means: its parameter, else the field that its message names first.
local function refused_field(message, param, fields, token_field)
  local found, first
  for _, name in ipairs { "response_format", token_field, "temperature", "seed" } do
    if fields[name] ~= nil then
      if param == name or param:sub(1, #name + 1) == name .. "." then return name end
      local at = message:find("%f[%w_]" .. name .. "%f[^%w_]")
        or name == "response_format" and first_of(message, FORMAT_WORDS)
      if at and (not first or at < first) then found, first = name, at end
    end
  end
  return found
end

--- Learns from a refusal of a request with these fields. False where nothing can be changed.
---@param refusal { message: string|nil, param: string|nil }
---@param fields table as sent
function form.learn(accepted, refusal, fields)
  local message, token_field = (refusal.message or ""):lower(), accepted.token_field
  local name = refused_field(message, refusal.param or "", fields, token_field)
  if not name then return false end
  if name == "response_format" then
    accepted.format = fields.response_format.type == "json_schema" and "json_object" or "plain"
  elseif name ~= token_field then
    accepted.dropped[name] = true
  elseif accepted.switched or first_of(message, VALUE_WORDS) then
    return false
  else
    accepted.switched, accepted.token_field = true, OTHER[name]
  end
  return true
end

return form
