--- attempt.lua: one HTTP request to a language model, its answer, the record of both, and the class
--- of a failure. The key is taken out of everything before it is read.

local base64 = require "limax.base.base64"
local failure = require "limax.base.failure"
local host = require "limax.host"
local reply = require "limax.supervise.llm.reply"
local terminal = require "limax.base.terminal"
local text = require "limax.supervise.llm.text"
local usage = require "limax.supervise.llm.usage"

local attempt = {}

-- A longer answer is cut; the transcript has every byte of a shorter one.
local LARGEST = 1048576 -- bytes
local CONNECT = 5 -- s, as in openai-python
local LONGEST_MESSAGE = 300 -- bytes

-- Classes of failures below HTTP, by their kind; others are "transport".
local CLASSES = { timeout = "timeout", connect_timeout = "timeout", size = "envelope",
  encoding = "envelope" }

local HINTS = {
  [401] = "is the key right?", [403] = "may this key use this model?",
  [404] = "are the URL and the model right?", [402] = "the account has to be paid",
}

-- A message as one short line.
local function short(message)
  message = text.line(message, #message):gsub("%s+", " ")
  if #message <= LONGEST_MESSAGE then return message end
  return text.beginning(message, LONGEST_MESSAGE - 3) .. "..."
end

---@class limax.llm.outcome
---@field class string|nil nil for a good answer
---@field message string|nil
---@field kind string|nil of a failure below HTTP, as host.http names it
---@field status integer|nil
---@field headers table<string, string>
---@field refusal limax.llm.refusal|nil
---@field reply limax.llm.reply|nil
---@field decoded table|nil the answer
---@field usage { input_tokens: integer, output_tokens: integer }|nil
---@field prompt_tokens integer estimated
---@field body string

-- Sets class, message and what else follows from a whole HTTP answer.
local function read(outcome, answer)
  local value, unreadable = reply.decode(outcome.body, answer.headers["content-type"])
  local refusal, status = value and reply.refusal(value), answer.status
  outcome.decoded = value
  local good = status >= 200 and status < 300
  if good and not value then
    outcome.class, outcome.message = "envelope", unreadable
    return
  elseif good and not refusal then
    outcome.usage = reply.usage(value)
    outcome.reply, outcome.class, outcome.message = reply.read(value)
    return
  end
  refusal = refusal or {}
  -- an error under a good status: routers put their provider's status into it
  if good then status = refusal.status or status end
  outcome.class = good and not refusal.status and "envelope" or reply.class_of(status, refusal)
  outcome.status, outcome.refusal = status, refusal
  local reason = refusal.message or refusal.code or refusal.type
  if status >= 300 and status < 400 then reason = "a redirect, which is not followed" end
  outcome.message = ("HTTP %d%s%s"):format(answer.status, reason and ": " .. reason or "",
    HINTS[status] and "; " .. HINTS[status] or "")
end

---@class limax.llm.attempt_options
---@field endpoint limax.llm.endpoint
---@field fields table of the request
---@field body string the same as JSON
---@field timeout number s
---@field number integer of this attempt within its question
---@field probe boolean is it the breaker's?
---@field options table of the client
---@field machine limax.llm.machine

-- The record before the request is sent.
local function begin_record(request)
  local fields, endpoint = request.fields, request.endpoint
  return {
    time = host.time(), attempt = request.number, probe = request.probe,
    endpoint = endpoint.redact(endpoint.shown),
    request = endpoint.redact(request.body), request_sha256 = host.sha256(request.body),
    ["gen_ai.operation.name"] = "chat", ["gen_ai.provider.name"] = endpoint.provider,
    ["gen_ai.request.model"] = endpoint.redact(endpoint.model),
    ["gen_ai.request.temperature"] = fields.temperature, ["gen_ai.request.seed"] = fields.seed,
    ["gen_ai.request.max_tokens"] = fields.max_tokens or fields.max_completion_tokens,
  }
end

-- Adds the response to the record; `response` is an answer of host.http or its problem.
local function finish_record(record, outcome, response, redact)
  local function header(name)
    local value = response.headers[name]
    return value and short(redact(value)) or nil
  end
  record.http_status = response.status > 0 and response.status or nil
  record.retry_after, record.retry_after_ms = header "retry-after", header "retry-after-ms"
  record.x_request_id = header "x-request-id"
  record.curl, record.curl_kind = response.curl and short(redact(response.curl)), response.kind
  record.raw_body_truncated = response.kind == "size"
  if terminal.utf8(outcome.body) == outcome.body then
    record.raw_body = outcome.body
  else
    record.raw_body_base64 = base64.encode(outcome.body)
  end
  record.failure = outcome.class
  for name, value in pairs(outcome.decoded and reply.telemetry(outcome.decoded) or {}) do
    record[name] = value
  end
end

--- The body of a request; nil and a message where JSON cannot hold it.
---@param redact fun(text: string): string
---@return string|nil
---@return string|nil message
function attempt.encode(fields, redact)
  local ok, body = failure.attempt(host.json.encode, fields)
  if ok then return body end
  return nil, short(redact(failure.bare(body)))
end

--- Sends one request and records it. Raises only what Ctrl-C and `record` raise.
---@param request limax.llm.attempt_options
---@return limax.llm.outcome
function attempt.send(request)
  local endpoint, machine = request.endpoint, request.machine
  local redact, record = endpoint.redact, begin_record(request)
  local started = machine.clock()
  local answer, message, problem = machine.http {
    url = endpoint.url, method = "POST", headers = endpoint.headers(), body = request.body,
    timeout = request.timeout, connect_timeout = CONNECT, largest = LARGEST,
    allow_insecure = request.options.allow_insecure or false, ca_file = request.options.ca_file,
  }
  record.ms = math.floor((machine.clock() - started) * 1000 + 0.5)
  local response = answer or problem
  local outcome = { headers = response.headers, body = redact(response.body),
    prompt_tokens = usage.prompt_tokens(request.fields.messages) }
  if answer then
    outcome.status = answer.status
    read(outcome, answer)
  else
    outcome.kind, outcome.class = problem.kind, CLASSES[problem.kind] or "transport"
    outcome.message = message
  end
  outcome.message = outcome.message and short(redact(outcome.message))
  finish_record(record, outcome, response, redact)
  machine.record(record)
  return outcome
end

return attempt
