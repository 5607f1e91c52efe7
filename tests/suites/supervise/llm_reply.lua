--- llm_reply.lua: the client reads HTTP answers: bodies that are not answers, refusals, missing
--- and wrong fields, one case each.

local host = require "limax.host"
local model_stage = require "support.model_stage"

local suite = require("limax.test").suite "llm reply"

local completion, GOOD = model_stage.completion, '{"mutation_rate": 0.2}'

-- Asks once; returns answer, failure and the notes.
local function ask(status, body)
  local made, notes = model_stage.new({ format = "plain" }, { { status = status, body = body } })
  local answer, failure = made:ask(model_stage.MESSAGES)
  return answer, failure, notes
end

local function choice(message, finish)
  return completion("", { choices = { { message = message, finish_reason = finish } } }).body
end

local function error_of(message, fields)
  local body = { message = message }
  for name, value in pairs(fields or {}) do body[name] = value end
  return { error = body }
end

-- class, status, body, text of the message, number of requests (1)
local REFUSALS = {
  { "quota", 429, error_of("over", { code = "insufficient_quota" }), "HTTP 429: over" },
  { "quota", 402, error_of "Insufficient Balance", "the account has to be paid" },
  { "http", 429, error_of "INSUFFICIENT QUOTA: tokens per minute", "3 attempts failed", 3 },
  { "context", 400, error_of("the request exceeds the available context size",
    { code = 400, type = "exceed_context_size_error" }), "exceeds the available context size" },
  { "auth", 401, error_of "Incorrect API key", "is the key right?" },
  { "http", 400, { error_of("API key not valid", { code = 400 }) }, "HTTP 400: API key not valid" },
  { "http", 404, error_of "no such model", "no such model; are the URL and the model right?" },
  { "http", 422, { detail = { { loc = { "body", "messages" }, msg = "field required" } } },
    "field required" },
  { "filter", 400, error_of("content policy", { code = "content_filter" }), "content policy" },
  { "envelope", 200, { error = "model 'm' not found" }, "model 'm' not found" },
  { "http", 200, error_of("busy", { code = 503 }), "busy; 3 attempts failed", 3 },
  { "envelope", 200, "<!DOCTYPE html>\n<html></html>", "a web page, not JSON" },
  { "envelope", 204, "", "the answer is empty" },
  { "envelope", 200, '{"choices": [{"mess', "not JSON" },
  { "envelope", 200, 'data: {"choices": []}\n\n', "streams its answer" },
  { "envelope", 200, { id = "x" }, "no choices" },
  { "envelope", 200, choice { content = host.json.null }, "has no text" },
  { "envelope", 200, choice({ content = "" }, "length"), "all tokens were used" },
  { "envelope", 200, choice({}, "tool_calls"), "a tool that it was not offered" },
  { "refusal", 200, choice { refusal = "I cannot\nhelp \27[31mwith that" },
    "the model refuses: I cannot help \\u001b[31mwith that" },
  { "filter", 200, choice({ content = "" }, "content_filter"), "content filter" },
}

suite:test("a refusal or a body without an answer is a failure with a class", function(t)
  for _, case in ipairs(REFUSALS) do
    local class, status, body, text, count = unpack(case, 1, 5)
    local answer, failure, notes = ask(status, body)
    t:equal({ answer, failure.message, failure.class, #notes.requests },
      { nil, failure.message, class, count or 1 })
    t:ok(not text or failure.message:find(text, 1, true), failure.message)
  end
  local _, failure = ask(418, { error = ("é"):rep(1000) })
  t:ok(#failure.message <= 300 and failure.message:find "é$", failure.message)
end)

suite:test("an answer is found in all forms that servers give it", function(t)
  for _, case in ipairs {
    { completion(GOOD, { error = host.json.null }).body, { content = GOOD } },
    { "\239\187\191" .. host.json.encode(completion(GOOD).body), { content = GOOD } },
    { choice({ content = GOOD }, "because"), { finish_reason = "because" } },
    { choice { content = "", reasoning_content = GOOD }, { content = "", reasoning = GOOD } },
    { choice { content = host.json.null, reasoning = GOOD }, { content = "", reasoning = GOOD } },
  } do
    local answer, failure = ask(200, case[1])
    t:ok(answer, failure and failure.message)
    for name, value in pairs(case[2]) do t:equal({ name, answer[name] }, { name, value }) end
  end
end)
