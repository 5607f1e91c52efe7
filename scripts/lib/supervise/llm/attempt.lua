--- attempt.lua: one HTTP request to a language model, its answer, the record of both, and the class
--- of a failure. The key is taken out of everything before it is read.

local base64 = require "limax.base.base64"
local failure = require "limax.base.failure"
local host = require "limax.host"
local reply = require "limax.supervise.llm.reply"
local terminal = require "limax.base.terminal"
local text = require "limax.supervise.llm.text"

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

-- The record of a request and its response: an answer of host.http, or its problem.
local function record_of(endpoint, request, response, outcome)
  local redact, fields = endpoint.redact, request.fields
  local function cleaned(value) return value and short(redact(value)) or nil end
  local headers, readable = response.headers, terminal.utf8(outcome.body) == outcome.body
  local record = {
    attempt = request.number, probe = request.probe, endpoint = redact(endpoint.shown),
    request = redact(request.body), request_sha256 = host.sha256(request.body),
    http_status = response.status > 0 and response.status or nil,
    retry_after = cleaned(headers["retry-after"]),
    retry_after_ms = cleaned(headers["retry-after-ms"]),
    x_request_id = cleaned(headers["x-request-id"]),
    curl = cleaned(response.curl), curl_kind = response.kind, failure = outcome.class,
    raw_body = readable and outcome.body or nil,
    raw_body_base64 = not readable and base64.encode(outcome.body) or nil,
    raw_body_truncated = response.kind == "size",
    ["gen_ai.operation.name"] = "chat", ["gen_ai.provider.name"] = endpoint.provider,
    ["gen_ai.request.model"] = redact(endpoint.model),
    ["gen_ai.request.temperature"] = fields.temperature, ["gen_ai.request.seed"] = fields.seed,
    ["gen_ai.request.max_tokens"] = fields.max_tokens or fields.max_completion_tokens,
  }
  for name, value in pairs(outcome.decoded and reply.telemetry(outcome.decoded) or {}) do
    record[name] = value
  end
  return record
end

--- The body of a request; nil and a message where JSON cannot hold it.
function attempt.encode(fields, redact)
  local ok, body = failure.attempt(host.json.encode, fields)
  if ok then return body end
  return nil, short(redact(failure.bare(body)))
end

--- Sends one request of a client and records it. Raises only what Ctrl-C and `record` raise.
---@param client limax.llm.client
---@param request { fields: table, body: string, timeout: number, number: integer, probe: boolean }
--- `body` is `fields` as JSON, `timeout` in seconds, `number` within the question
function attempt.send(client, request)
  local endpoint, machine = client.endpoint, client.machine
  local time, started = host.time(), machine.clock()
  local answer, message, problem = machine.http {
    url = endpoint.url, method = "POST", headers = endpoint.headers(), body = request.body,
    timeout = request.timeout, connect_timeout = CONNECT, largest = LARGEST,
    allow_insecure = client.options.allow_insecure or false, ca_file = client.options.ca_file,
  }
  local took = machine.clock() - started
  local response = answer or problem
  local outcome = { headers = response.headers, body = endpoint.redact(response.body) }
  if answer then
    outcome.status = answer.status
    read(outcome, answer)
  else
    outcome.kind, outcome.class = problem.kind, CLASSES[problem.kind] or "transport"
    outcome.message = message
  end
  outcome.message = outcome.message and short(endpoint.redact(outcome.message))
  local record = record_of(endpoint, request, response, outcome)
  record.time, record.ms = time, math.floor(took * 1000 + 0.5)
  machine.record(record)
  return outcome
end

return attempt
