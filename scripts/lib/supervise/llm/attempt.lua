--- attempt.lua: one HTTP request to a language model, its answer, the record of both, and the class
--- of a failure. The key is replaced in all texts that leave this file.

local defaults = require "limax.settings.defaults"
local host = require "limax.host"
local reply = require "limax.supervise.llm.reply"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"

local attempt = {}

local LARGEST = 1048576 -- bytes; a longer answer is cut
local CONNECT = 5 -- s, as in openai-python
local LONGEST_MESSAGE = 300 -- bytes

-- Classes of failures below HTTP, by their kind; others are "transport".
local CLASSES = { timeout = "timeout", connect_timeout = "timeout", size = "envelope",
  encoding = "envelope" }

local HINTS = { [401] = "is the key right?", [402] = "the account has to be paid",
  [403] = "may this key use this model?", [404] = "are the URL and the model right?" }

-- The body of a request. `format` is the form of the answer.
local function fields_of(client, messages, format, question)
  local options, endpoint = client.options, client.endpoint
  local fields = { model = endpoint.model, messages = messages, stream = false,
    temperature = options.temperature, seed = options.seed }
  -- OpenAI's own models refuse max_tokens; other servers do not know max_completion_tokens and
  -- would write without end
  local limit = endpoint.provider == "other" and "max_tokens" or "max_completion_tokens"
  fields[limit] = options.max_tokens or defaults.fields.llm.max_tokens.value
  if format == "json_schema" and question.schema then
    fields.response_format = { type = format, json_schema = { name = question.name or "answer",
      strict = true, schema = question.schema } }
  elseif format ~= "plain" then
    fields.response_format = { type = "json_object" }
  end
  return fields
end

-- Adds what a whole HTTP answer contains: reply, class, message.
local function read(outcome, answer, redact)
  local value, unreadable = reply.decode(answer.body, answer.headers["content-type"])
  -- a key with escaped letters shows only in decoded text, which then replaces the body
  local plain = value and host.json.encode(value) or ""
  if redact(plain) ~= plain then
    answer.body = redact(plain)
    value, unreadable = host.json.decode(answer.body, "the answer")
  end
  local refusal, status = value and reply.refusal(value), answer.status
  outcome.reply = value and reply.read(value)
  local good = status >= 200 and status < 300
  if good and not value then
    outcome.class, outcome.message = "envelope", unreadable
  elseif good and not refusal then
    outcome.class, outcome.message = reply.fault(outcome.reply)
  else
    refusal = refusal or {}
    -- an error under a good status: routers put their provider's status into it
    status = good and refusal.status or status
    outcome.status, outcome.class = status, reply.class_of(status, refusal)
    local reason = refusal.message
    if status >= 300 and status < 400 then reason = "a redirect, which is not followed" end
    outcome.message = ("HTTP %d%s%s"):format(answer.status, reason and ": " .. reason or "",
      HINTS[status] and "; " .. HINTS[status] or "")
  end
end

-- A message as one short line.
local function short(message)
  return message and terminal.line(message:gsub("%s+", " "), LONGEST_MESSAGE)
end

-- The record of a request and its response: an answer of host.http, or its problem.
local function record_of(endpoint, body, response, outcome)
  local redact, headers = endpoint.redact, response.headers
  local function cleaned(value) return value and short(redact(value)) end
  return {
    endpoint = endpoint.shown, request = redact(body), request_sha256 = host.sha256(body),
    http_status = response.status > 0 and response.status or nil,
    retry_after = cleaned(headers["retry-after"]), x_request_id = cleaned(headers["x-request-id"]),
    curl = cleaned(response.curl), curl_kind = response.kind, failure = outcome.class,
    raw_body = terminal.utf8(redact(response.body)), raw_body_truncated = response.kind == "size",
    answer = source.copy(outcome.reply),
  }
end

--- Sends one request of a client and records it. The outcome has `class` and `message` of a
--- failure, `kind` if it was below HTTP, `reply` if the model ran, and `form_refused` if the
--- request may be accepted without response_format. Raises what Ctrl-C and `record` raise, and an
--- error where JSON cannot hold the request.
---@param format "json_schema"|"json_object"|"plain" of the answer
---@return { class?: string, message?: string, kind?: string, status?: integer, headers: table,
--- reply?: limax.llm.reply, form_refused?: boolean }
function attempt.send(client, messages, format, question, timeout)
  local endpoint, machine = client.endpoint, client.machine
  local redact, fields = endpoint.redact, fields_of(client, messages, format, question)
  local body = host.json.encode(fields)
  local time, started = host.time(), machine.clock()
  local answer, message, problem = machine.http {
    url = endpoint.url, headers = endpoint.headers(), body = body,
    timeout = timeout, connect_timeout = CONNECT, largest = LARGEST,
    allow_insecure = client.options.allow_insecure or false, ca_file = client.options.ca_file,
  }
  local took, response = machine.clock() - started, answer or problem
  local outcome = { headers = response.headers, status = answer and answer.status }
  if answer then
    read(outcome, answer, redact)
    outcome.form_refused = fields.response_format and outcome.class == "http"
      and (outcome.status == 400 or outcome.status == 422)
  else
    outcome.kind, outcome.class = problem.kind, CLASSES[problem.kind] or "transport"
    outcome.message = message
  end
  outcome.message = outcome.message and short(redact(outcome.message))
  local record = record_of(endpoint, body, response, outcome)
  record.time, record.ms = time, math.floor(took * 1000 + 0.5)
  machine.record(record)
  return outcome
end

return attempt
