--- attempt.lua: one HTTP request to a language model: what is sent, what came back, the record of
--- both, and what class a failure has. The key is taken out of everything before it is looked at.

local base64 = require "limax.supervise.llm.base64"
local envelope = require "limax.supervise.llm.envelope"
local failure = require "limax.base.failure"
local host = require "limax.host"
local tokens = require "limax.supervise.llm.tokens"

local attempt = {}

-- An answer of more than 1 MiB is no proposal; the transcript holds every byte of a shorter one.
attempt.LARGEST = 1048576
local CONNECT = 5 -- s: what openai-python takes
local LONGEST_MESSAGE = 300 -- bytes

-- Beyond ASCII: C1 controls, which some terminals obey, line separators, and marks that turn the
-- direction of a text (U+0080 to U+009F, U+2028 to U+202E, U+2066 to U+2069), in UTF-8.
local CONTROLS = { "\194[\128-\159]", "\226\128[\168-\174]", "\226\129[\166-\169]" }

--- A message as one short line of printable text.
---@param text string
---@return string
function attempt.clean(text)
  for _, control in ipairs(CONTROLS) do text = text:gsub(control, " ") end
  text = text:gsub("%c+", " "):gsub("%s+", " ")
  if #text > LONGEST_MESSAGE then
    -- not within a character
    text = text:sub(1, LONGEST_MESSAGE - 3):gsub("[\192-\255][\128-\191]*$", "") .. "..."
  end
  if not pcall(host.json.encode, text) then text = text:gsub("[\128-\255]", "?") end
  return text
end

local TIMEOUTS = { timeout = true, connect_timeout = true }

-- The class of a failure below HTTP.
local function class_of_problem(kind)
  if TIMEOUTS[kind] then return "timeout" end
  return (kind == "size" or kind == "encoding") and "envelope" or "transport"
end

local function class_of_status(status, refusal)
  if status == 402 or envelope.is_quota(refusal) then return "quota" end
  if status == 401 or status == 403 then return "auth" end
  if status == 400 and refusal.code == "content_filter" then return "filter" end
  if (status == 400 or status == 413 or status == 422) and envelope.is_context(refusal) then
    return "context"
  end
  return "http"
end

local HINTS = {
  [401] = "is the key right?", [403] = "may this key use this model?",
  [404] = "are the URL and the model right?", [402] = "the account has to be paid",
}

-- A body as JSON can hold it, and under which name.
local function put_body(record, body)
  if pcall(host.json.encode, body) then
    record.raw_body = body
  else
    record.raw_body_base64 = base64.encode(body)
  end
end

-- Sets class, message and what else follows from a whole answer of HTTP.
local function read(outcome, answer)
  local value, unreadable = envelope.decode(outcome.body, answer.headers["content-type"])
  outcome.envelope = value
  local refusal = value and envelope.refusal(value)
  local status = answer.status
  if status >= 200 and status < 300 then
    if not value then
      outcome.class, outcome.message = "envelope", unreadable
      return
    end
    if not refusal then
      outcome.usage = envelope.usage(value)
      local reply, class, message = envelope.reply(value)
      outcome.reply, outcome.class, outcome.message = reply, class, message
      return
    end
    -- an error under a good status: routers put the status of their provider into it
    status = refusal.status or status
    outcome.class = refusal.status and class_of_status(status, refusal) or "envelope"
  else
    refusal = refusal or {}
    outcome.class = class_of_status(status, refusal)
  end
  outcome.status, outcome.refusal = status, refusal
  local said = refusal.message or refusal.code or refusal.type
  if status >= 300 and status < 400 then said = "a redirect, which is not followed" end
  outcome.message = ("HTTP %d%s%s"):format(answer.status, said and ": " .. said or "",
    HINTS[status] and "; " .. HINTS[status] or "")
end

---@class limax.llm.outcome
---@field class string|nil nil for a good answer
---@field message string|nil
---@field kind string|nil of a failure below HTTP, as host.http names it
---@field status integer|nil
---@field headers table<string, string>
---@field refusal limax.llm.refusal|nil
---@field reply limax.llm.reply|nil
---@field envelope table|nil the answer, decoded
---@field usage { input_tokens: integer, output_tokens: integer }|nil
---@field prompt_tokens integer estimated
---@field body string

---@class limax.llm.attempt_options
---@field endpoint limax.llm.endpoint
---@field fields table of the request
---@field body string the same as JSON
---@field timeout number s
---@field number integer of this attempt within its question
---@field probe boolean is it the breaker's?
---@field options table of the client
---@field given limax.llm.given

-- What a record holds before anything came back.
local function begin_record(asked)
  local fields, endpoint = asked.fields, asked.endpoint
  return {
    time = host.time(), attempt = asked.number, probe = asked.probe,
    endpoint = endpoint.redact(endpoint.shown),
    request = endpoint.redact(asked.body), request_sha256 = host.sha256(asked.body),
    ["gen_ai.operation.name"] = "chat", ["gen_ai.provider.name"] = endpoint.provider,
    ["gen_ai.request.model"] = endpoint.redact(endpoint.model),
    ["gen_ai.request.temperature"] = fields.temperature, ["gen_ai.request.seed"] = fields.seed,
    ["gen_ai.request.max_tokens"] = fields.max_tokens or fields.max_completion_tokens,
  }
end

-- What came back, as far as it came.
local function finish_record(record, outcome, came, redact)
  local function header(name)
    local value = came.headers[name]
    return value and attempt.clean(redact(value)) or nil
  end
  record.http_status = came.status > 0 and came.status or nil
  record.retry_after, record.retry_after_ms = header "retry-after", header "retry-after-ms"
  record.x_request_id = header "x-request-id"
  record.curl, record.curl_kind = came.curl and attempt.clean(redact(came.curl)), came.kind
  record.raw_body_truncated = came.kind == "size"
  put_body(record, outcome.body)
  record.failure = outcome.class
  for name, value in pairs(outcome.envelope and envelope.telemetry(outcome.envelope) or {}) do
    record[name] = value
  end
end

--- The body of a request; nil and a message where JSON cannot hold it.
---@param fields table
---@param redact fun(text: string): string
---@return string|nil
---@return string|nil message
function attempt.encode(fields, redact)
  local fine, body = failure.attempt(host.json.encode, fields)
  if fine then return body end
  return nil, attempt.clean(redact(failure.bare(body)))
end

--- Sends one request and records it. Raises only what Ctrl-C and `record` raise.
---@param asked limax.llm.attempt_options
---@return limax.llm.outcome
function attempt.send(asked)
  local endpoint, given = asked.endpoint, asked.given
  local redact, record = endpoint.redact, begin_record(asked)
  local started = given.clock()
  local answer, message, problem = given.http {
    url = endpoint.url, method = "POST", headers = endpoint.headers(), body = asked.body,
    timeout = asked.timeout, connect_timeout = CONNECT, largest = attempt.LARGEST,
    allow_insecure = asked.options.allow_insecure or false, ca_file = asked.options.ca_file,
  }
  record.ms = math.floor((given.clock() - started) * 1000 + 0.5)
  local came = answer or problem
  local outcome = { headers = came.headers, body = redact(came.body),
    prompt_tokens = tokens.estimate(asked.fields.messages) }
  if answer then
    outcome.status = answer.status
    read(outcome, answer)
  else
    outcome.kind, outcome.class = problem.kind, class_of_problem(problem.kind)
    outcome.message = message
  end
  outcome.message = outcome.message and attempt.clean(redact(outcome.message))
  finish_record(record, outcome, came, redact)
  given.record(record)
  return outcome
end

return attempt
