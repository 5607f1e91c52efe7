--- reply.lua: reads an answer or a refusal of the chat completions protocol. Every field may be
--- missing or of another type.

local host = require "limax.host"
local usage = require "limax.supervise.llm.usage"

local reply = {}

local BOM = "\239\187\191"

local function text(value) return type(value) == "string" and value ~= "" and value or nil end

local function object(value)
  return type(value) == "table" and not host.json.is_array(value) and value or {}
end

local function list(value)
  return type(value) == "table" and host.json.is_array(value) and value or {}
end

--- The JSON object of a body.
---@param content_type string|nil
function reply.decode(body, content_type)
  if body == "" then return nil, "the answer is empty" end
  if body:sub(1, #BOM) == BOM then body = body:sub(#BOM + 1) end
  local value, message = host.json.decode(body, "the answer")
  -- Google wraps an error in a list
  local first = list(value)[1]
  if object(first).error ~= nil then value = first end
  if type(value) == "table" and not host.json.is_array(value) then return value end
  if body:find "^%s*data:" or (content_type or ""):find("text/event-stream", 1, true) then
    return nil, "the endpoint streams its answer, although stream = false was sent"
  end
  if body:find "^%s*<" then
    return nil, "the answer is a web page, not JSON: is the URL that of the API?"
  end
  if value ~= nil then return nil, "the answer is JSON, but not an object" end
  return nil, "the answer is not JSON: " .. message
end

-- ---- refusals -----------------------------------------------------------------------------------

---@class limax.llm.refusal
---@field message string|nil
---@field code string|nil
---@field type string|nil
---@field param string|nil
---@field status integer|nil an HTTP status in the body

-- pydantic's form: { detail = { { loc = , msg = } } }
local function of_detail(detail)
  if text(detail) then return { message = detail } end
  local first = object(list(detail)[1])
  local place = list(first.loc)
  return { message = text(first.msg), param = text(place[#place]) }
end

--- The error in a body: OpenAI's object, a plain text, or the forms of vLLM, FastAPI and Mistral;
--- nil where there is none.
function reply.refusal(value)
  local inner = value.error
  -- some servers always send the field
  if inner == nil or inner == host.json.null or inner == "" or inner == false then
    if value.choices ~= nil then return nil end
    if value.detail ~= nil then return of_detail(value.detail) end
    if value.object ~= "error" then return nil end
    inner = value
  end
  if type(inner) ~= "table" then return { message = text(inner) or tostring(inner) } end
  inner = object(inner)
  -- Mistral
  local detail = object(inner.message).detail
  if detail ~= nil then return of_detail(detail) end
  local status = tonumber(inner.code)
  return { message = text(inner.message), code = text(inner.code), type = text(inner.type),
    param = text(inner.param),
    status = status and status >= 400 and status < 600 and math.floor(status) or nil }
end

local CONTEXT_WORDS = { "maximum context length", "context size", "context window",
  "context length" }

local function is_context(refusal)
  if refusal.type == "exceed_context_size_error" or refusal.code == "context_length_exceeded" then
    return true
  end
  local message = (refusal.message or ""):lower()
  for _, words in ipairs(CONTEXT_WORDS) do
    if message:find(words, 1, true) then return true end
  end
  return false
end

--- The class of a refusal. The account's quota is recognised by code or type only: messages about
--- limits per minute have the word "quota" as well.
---@return "quota"|"auth"|"filter"|"context"|"http"
function reply.class_of(status, refusal)
  if status == 402 or refusal.code == "insufficient_quota"
    or refusal.type == "insufficient_quota" then return "quota" end
  if status == 401 or status == 403 then return "auth" end
  if status == 400 and refusal.code == "content_filter" then return "filter" end
  if (status == 400 or status == 413 or status == 422) and is_context(refusal) then
    return "context"
  end
  return "http"
end

-- ---- answers ------------------------------------------------------------------------------------

-- A text, or the texts of a list of parts one after the other.
local function content_of(value)
  if type(value) == "string" then return value end
  local parts = {}
  for _, part in ipairs(list(value)) do
    local kind = object(part).type
    if kind == "text" or kind == "output_text" then parts[#parts + 1] = text(part.text) end
  end
  return table.concat(parts)
end

--- What an answer used: both counts or none, since half a usage gives no cost.
---@return { input_tokens: integer, output_tokens: integer }|nil
function reply.usage(value)
  value = object(value.usage)
  local input, output = usage.count(value.prompt_tokens), usage.count(value.completion_tokens)
  if not input or not output then return nil end
  return { input_tokens = input, output_tokens = output }
end

--- Whether an answer holds a choice at all: then the model has run.
function reply.has_choice(value) return list(value.choices)[1] ~= nil end

---@class limax.llm.reply
---@field content string
---@field reasoning string|nil
---@field finish_reason string|nil
---@field model string|nil
---@field id string|nil

local NO_TEXT = { length = "all tokens were used before it began (finish_reason length)",
  tool_calls = "the model calls a tool that it was not offered" }

--- The first choice of an answer; nil, the class of the failure and a message where there is none.
---@return "envelope"|"refusal"|"filter"|nil class
function reply.read(value)
  if not host.json.is_array(value.choices) then
    return nil, "envelope", "the answer has no list of choices"
  end
  if value.choices[1] == nil then
    return nil, "envelope", "the answer's list of choices is empty"
  end
  local choice = object(value.choices[1])
  local message = object(choice.message)
  local read = {
    content = content_of(message.content),
    reasoning = text(message.reasoning_content) or text(message.reasoning),
    finish_reason = text(choice.finish_reason), model = text(value.model), id = text(value.id),
  }
  local refusal = text(message.refusal)
  if refusal then return nil, "refusal", "the model refuses: " .. refusal end
  if read.finish_reason == "content_filter" then
    return nil, "filter", "the provider's content filter ended the answer"
  end
  if read.content == "" and not read.reasoning then
    local why = NO_TEXT[read.finish_reason] or text(object(choice.error).message)
    return nil, "envelope", "the answer has no text" .. (why and ": " .. why or "")
  end
  return read
end

--- The fields of an answer under OpenTelemetry's names.
---@return table<string, any>
function reply.telemetry(value)
  local used, reasons = reply.usage(value) or {}, host.json.array {}
  for _, choice in ipairs(list(value.choices)) do
    reasons[#reasons + 1] = text(object(choice).finish_reason)
  end
  return {
    ["gen_ai.response.id"] = text(value.id), ["gen_ai.response.model"] = text(value.model),
    ["gen_ai.openai.response.system_fingerprint"] = text(value.system_fingerprint),
    ["gen_ai.response.finish_reasons"] = #reasons > 0 and reasons or nil,
    ["gen_ai.usage.input_tokens"] = used.input_tokens,
    ["gen_ai.usage.output_tokens"] = used.output_tokens,
  }
end

return reply
