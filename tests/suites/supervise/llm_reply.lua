--- llm_reply.lua: what the client makes of an HTTP answer: bodies that are none, refusals, missing
--- and wrong fields, one case each.

local base64 = require "limax.base.base64"
local host = require "limax.host"
local model_stage = require "support.model_stage"

local suite = require("limax.test").suite "llm reply"

local MESSAGES, completion = model_stage.MESSAGES, model_stage.completion
local GOOD = '{"mutation_rate": 0.2}'

-- Asks once; returns answer, failure and the notes.
local function ask(case)
  local made, notes = model_stage.new(case.options or {}, { { status = case.status or 200,
    headers = case.headers, body = case.body } })
  local answer, failure = made:ask(case.messages or MESSAGES)
  return answer, failure, notes, made
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
  { "context", 400, error_of "maximum context length is 4096 tokens, max_tokens is too large" },
  { "auth", 401, error_of "Incorrect API key", "is the key right?" },
  { "http", 400, { error_of("API key not valid", { code = 400 }) }, "HTTP 400: API key not valid" },
  { "http", 404, error_of "no such model", "no such model; are the URL and the model right?" },
  { "http", 422, { detail = { { loc = { "body", "messages" }, msg = "field required" } } },
    "HTTP 422: field required" },
  { "filter", 400, error_of("content policy", { code = "content_filter" }), "content policy" },
  { "envelope", 200, { error = "model 'm' not found" }, "model 'm' not found" },
  { "envelope", 200, "<!DOCTYPE html>\n<html></html>", "a web page, not JSON" },
  { "envelope", 204, "", "the answer is empty" }, { "envelope", 200, "", "the answer is empty" },
  { "envelope", 200, '{"choices": "\255\254"}', "not UTF-8" },
  { "envelope", 200, '{"choices": [{"mess', "not JSON" },
  { "envelope", 200, 'data: {"choices": []}\n\n', "streams its answer" },
  { "envelope", 200, { id = "x" }, "no list of choices" },
  { "envelope", 200, choice { content = host.json.null }, "has no text" },
  { "envelope", 200, choice({ content = "" }, "length"), "all tokens were used" },
  { "envelope", 200, choice({}, "tool_calls"), "a tool that it was not offered" },
  { "envelope", 200, { choices = { { message = { content = "" },
    error = { message = "provider lost" } } } }, "has no text: provider lost" },
  { "refusal", 200, choice { refusal = "I cannot\nhelp \27[31mwith that" },
    "the model refuses: I cannot help [31mwith that" },
  { "filter", 200, choice({ content = "" }, "content_filter"), "content filter" },
}

suite:test("a refusal or a body without an answer is a failure with a class", function(t)
  for _, case in ipairs(REFUSALS) do
    local class, status, body, text, count = unpack(case, 1, 5)
    local answer, failure, notes = ask { status = status, body = body }
    t:equal(answer, nil)
    t:equal({ failure.class, #notes.requests, failure.message }, { class, count or 1,
      failure.message })
    t:ok(not text or failure.message:find(text, 1, true), failure.message)
  end
  local _, _, notes = ask { body = "\255" }
  t:equal(notes.records[1].raw_body_base64, base64.encode "\255")
end)

-- body -> fields of the answer
local parts = { { type = "text", text = '{"mutation_' }, { type = "image_url", image_url = "x" },
  { type = "text", text = 'rate": 0.2}' }, 5 }

suite:test("an answer is found in all forms that servers give it", function(t)
  for _, case in ipairs {
    { completion(GOOD, { error = host.json.null }).body, { content = GOOD } },
    { completion(GOOD, { error = "" }).body, { content = GOOD } },
    { "\239\187\191" .. host.json.encode(completion(GOOD).body), { content = GOOD } },
    { choice { content = parts }, { content = GOOD } },
    { choice({ content = "{" }, "length"), { truncated = true, truncation = "answer" } },
    { choice({ content = GOOD }, "because"), { finish_reason = "because", truncated = false } },
    { choice { content = "", reasoning_content = GOOD }, { content = "", reasoning = GOOD } },
    { choice { content = host.json.null, reasoning = GOOD }, { content = "", reasoning = GOOD } },
    { completion(GOOD, { model = "another" }).body, { content = GOOD, model = "another" } },
  } do
    local answer, failure = ask { body = case[1] }
    t:ok(answer, failure and failure.message)
    for name, value in pairs(case[2]) do t:equal({ name, answer[name] }, { name, value }) end
  end
end)

suite:test("a prompt that the server cut is marked", function(t)
  local messages = { { role = "user", content = ("0.125 "):rep(2000) } } -- about 3400 tokens
  for counted, truncation in pairs { [3600] = false, [2048] = false, [1024] = "prompt" } do
    local answer = ask { messages = messages, body = completion(GOOD, {
      usage = { prompt_tokens = counted, completion_tokens = 1 } }).body }
    t:equal({ answer.truncated, answer.truncation or false }, { truncation ~= false, truncation })
  end
end)

suite:test("a message is one short line of printable text", function(t)
  for message, expected in pairs {
    ["a\nb\r\n\tc"] = "a b c", ["\27[2Jx"] = " [2Jx", ["x\194\1552Jy\226\128\174z"] = "x 2Jy z",
    ["\127"] = " ",
  } do
    local _, failure = ask { status = 404, body = error_of(message) }
    t:equal(failure.message, "HTTP 404: " .. expected:gsub("^ ", "")
      .. "; are the URL and the model right?")
  end
  local _, failure = ask { status = 418, body = { error = ("é"):rep(1000) } }
  t:ok(#failure.message <= 300 and failure.message:find "é%.%.%.$", failure.message)
end)

suite:test("any body gives an answer or a failure with a class", function(t)
  local random, classes = model_stage.picks(7), {}
  local seeds = {}
  for k, body in ipairs { completion(GOOD).body, error_of("m", { code = "c", param = "seed" }),
    { detail = { { loc = { "body", "seed" }, msg = "x" } } },
    choice({ content = parts, reasoning = "b", refusal = "c" }, "length") } do
    seeds[k] = host.json.encode(body)
  end
  local pieces = { "null", "[]", "{}", "1e999", "-1", '"x"', "\255", "\0", "[[", "]", "}", ",", ":",
    '"choices":', '"error":', '"message":', "true", "\\ud800", "" }
  local statuses = { 200, 200, 200, 400, 401, 422, 429, 500, 204, 302 }
  for _ = 1, 2000 do
    local body = seeds[random(#seeds)]
    for _ = 1, random(4) do
      local from = random(#body + 1)
      body = body:sub(1, from - 1) .. pieces[random(#pieces)] .. body:sub(from + random(12) - 1)
    end
    local answer, failure = ask { status = statuses[random(#statuses)], body = body,
      options = { temperature = 1 } }
    t:ok(answer and type(answer.content) == "string" or type(failure.class) == "string"
      and type(failure.message) == "string")
    local class = answer and "answer" or failure.class
    classes[class] = (classes[class] or 0) + 1
  end
  for _, class in ipairs { "answer", "envelope", "http", "auth" } do
    t:ok((classes[class] or 0) > 10, class .. ": " .. host.json.encode(classes))
  end
end)
