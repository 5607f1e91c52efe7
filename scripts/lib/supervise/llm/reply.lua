--- reply.lua: reads an answer or a refusal of the chat completions protocol. Every field may be
--- missing or of another type.

local host = require "limax.host"
local usage = require "limax.supervise.llm.usage"

local reply = {}

local function text(value) return type(value) == "string" and value ~= "" and value or nil end

local function object(value)
  return type(value) == "table" and not host.json.is_array(value) and value or {}
end

local function list(value)
  return type(value) == "table" and host.json.is_array(value) and value or {}
end

--- The JSON object of a body.
function reply.decode(body, content_type)
  if body == "" then return nil, "the answer is empty" end
  local value, message = host.json.decode((body:gsub("^\239\187\191", "")), "the answer")
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

--- The error in a body: the object or text `error` of most servers, or a body with `detail` or
--- object = "error"; nil if there is none.
---@return { message: string, code?: string, type?: string, status?: integer }|nil
function reply.refusal(value)
  local inner = value.error
  -- some servers always send the field
  if inner == nil or inner == host.json.null or inner == "" or inner == false then
    if value.choices ~= nil or value.detail == nil and value.object ~= "error" then return nil end
    inner = value.detail or value
  end
  local fields = object(inner)
  local status = tonumber(fields.code)
  return {
    message = text(inner) or text(fields.message) or host.json.encode { inner },
    code = text(fields.code), type = text(fields.type),
    status = status and status >= 400 and status < 600 and math.floor(status) or nil,
  }
end

-- Classes of statuses, of codes and of types; others are "http". The account's quota is recognised
-- by code or type only: messages about limits per minute have the word "quota" as well.
local CLASSES = { [401] = "auth", [402] = "quota", [403] = "auth", insufficient_quota = "quota",
  content_filter = "filter", context_length_exceeded = "context",
  exceed_context_size_error = "context" }

--- The class of a refusal; an error under a good status is "envelope".
function reply.class_of(status, refusal)
  if status < 300 then return "envelope" end
  local message = (refusal.message or ""):lower()
  local too_long = message:find "context length" or message:find "context size"
    or message:find "context window"
  return CLASSES[refusal.code] or CLASSES[refusal.type] or CLASSES[status]
    or too_long and "context" or "http"
end

---@class limax.llm.reply
---@field content string
---@field reasoning string|nil
---@field refusal string|nil the model's own
---@field finish_reason string|nil
---@field model string|nil as the endpoint names it
---@field id string|nil
---@field usage { input_tokens: integer, output_tokens: integer }|nil both counts or none

--- The first choice of an answer, with whatever fields it has; nil if there is none.
function reply.read(value)
  local choice = list(value.choices)[1]
  if choice == nil then return nil end
  local message, used = object(object(choice).message), object(value.usage)
  local input, output = usage.count(used.prompt_tokens), usage.count(used.completion_tokens)
  return {
    content = text(message.content) or "",
    reasoning = text(message.reasoning_content) or text(message.reasoning),
    refusal = text(message.refusal), finish_reason = text(object(choice).finish_reason),
    model = text(value.model), id = text(value.id),
    usage = input and output and { input_tokens = input, output_tokens = output } or nil,
  }
end

local NO_TEXT = { length = ": all tokens were used before it began (finish_reason length)",
  tool_calls = ": the model calls a tool that it was not offered" }

--- The class and message of an answer that cannot be used; nil for one with a text.
function reply.fault(read)
  if not read then return "envelope", "the answer has no choices" end
  if read.refusal then return "refusal", "the model refuses: " .. read.refusal end
  if read.finish_reason == "content_filter" then
    return "filter", "the provider's content filter ended the answer"
  end
  if read.content ~= "" or read.reasoning then return nil end
  return "envelope", "the answer has no text" .. (NO_TEXT[read.finish_reason] or "")
end

return reply
