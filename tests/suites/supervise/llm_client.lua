--- llm_client.lua: the client of a language model with an injected HTTP function, clock and waits:
--- what is sent and recorded, retries and budgets, cost and caps.

local host = require "limax.host"
local model_stage = require "support.model_stage"

local suite = require("limax.test").suite "llm client"

local MESSAGES = model_stage.MESSAGES
local stage, completion = model_stage.new, model_stage.completion

suite:test("an answer comes with usage and cost, and is recorded", function(t)
  local ask, notes = stage({ price = { input = 2, output = 10 }, temperature = 0.5, seed = 7 },
    { completion('{"mutation_rate":0.2}', { system_fingerprint = "fp_1" }) })
  local answer = ask:ask(MESSAGES, { schema = { type = "object" }, name = "proposal" })
  t:equal(answer, { content = '{"mutation_rate":0.2}', finish_reason = "stop", model = "m-1",
    id = "c1", usage = { input_tokens = 100, output_tokens = 20 }, cost = 4e-4, attempts = 1,
    seconds = 0, truncated = false })
  t:equal(notes.bodies[1], { model = "m", messages = MESSAGES, stream = false, max_tokens = 4096,
    temperature = 0.5, seed = 7, response_format = { type = "json_schema",
      json_schema = { name = "proposal", strict = true, schema = { type = "object" } } } })
  local record = notes.records[1]
  t:equal(#notes.records, 1)
  t:equal(record.request, notes.requests[1].body)
  t:equal(record.request_sha256, host.sha256(record.request))
  t:equal({ record.http_status, record.attempt, record["gen_ai.request.model"],
    record["gen_ai.request.seed"], record["gen_ai.response.id"],
    record["gen_ai.usage.input_tokens"], record["gen_ai.response.finish_reasons"],
    record["gen_ai.openai.response.system_fingerprint"] },
    { 200, 1, "m", 7, "c1", 100, { "stop" }, "fp_1" })
  t:equal(ask:totals(), { calls = 1, answers = 1, input_tokens = 100, output_tokens = 20,
    estimated_tokens = 0, charged = 4e-4, cost = 4e-4 })
  t:equal(ask:describe(), { endpoint = "http://127.0.0.1:1/v1/chat/completions", model = "m",
    provider = "openai_compatible", key = "LIMAX_LLM_KEY" })
end)

suite:test("which status is retried, how often and after how long", function(t)
  -- status, headers, body -> waits; nil: none
  local usual = { 0.5, 1 }
  for _, case in ipairs {
    { 408, usual }, { 409, usual }, { 429, usual }, { 500, usual }, { 502, usual }, { 503, usual },
    { 529, usual }, { 400, {} }, { 401, {} }, { 403, {} }, { 404, {} }, { 422, {} }, { 302, {} },
    { 501, usual }, { 204, {} }, { 418, {} },
    { 429, { 3, 3 }, { ["retry-after"] = "3" } },
    { 503, { 0.25, 0.25 }, { ["retry-after"] = "0.25" } },
    { 429, { 10, 10 }, { ["retry-after"] = "Wed, 21 Oct 2015 07:28:10 GMT" } },
    { 429, usual, { ["retry-after"] = "Wed, 21 Oct 2015 07:27:00 GMT" } },
    { 429, usual, { ["retry-after"] = "0" } }, { 429, usual, { ["retry-after"] = "-5" } },
    { 429, usual, { ["retry-after"] = "abc" } }, { 429, usual, { ["retry-after"] = "nan" } },
    { 429, usual, { ["retry-after"] = "0x10" } }, { 429, {}, { ["retry-after"] = "86400" } },
    { 429, {}, { ["retry-after"] = "1e999" } }, { 429, {}, { ["retry-after"] = "121" } },
    { 429, { 120, 120 }, { ["retry-after"] = "120" } },
    { 429, { 0.2, 0.2 }, { ["retry-after-ms"] = "200", ["retry-after"] = "9" } },
    { 429, { 9, 9 }, { ["retry-after-ms"] = "soon", ["retry-after"] = "9" } },
    { 400, usual, { ["x-should-retry"] = "true" } }, { 503, {}, { ["x-should-retry"] = "false" } },
  } do
    local status, waits, headers = unpack(case)
    local reply = { status = status, headers = headers, body = "" }
    local ask, notes = stage({ budget = 400 }, { reply })
    local answer, failure = ask:ask(MESSAGES)
    local what = ("%d %s"):format(status, headers and host.json.encode(headers) or "")
    t:equal(answer, nil)
    -- 1e999 is infinite: no number, so that the usual waits follow
    if headers and headers["retry-after"] == "1e999" then waits = usual end
    t:ok(host.json.encode(notes.waits) == host.json.encode(waits),
      what .. ": waits " .. host.json.encode(notes.waits))
    local count = #waits + 1
    t:equal({ #notes.requests, failure.attempts, #notes.records }, { count, count, count })
  end
end)

suite:test("jitter only shortens a wait, and the clock counts everything", function(t)
  local ask, notes = stage({}, { { status = 500, body = "", takes = 2 } })
  notes.random = 1
  local _, failure = ask:ask(MESSAGES)
  t:equal(notes.waits, { 0.375, 0.75 })
  t:near(failure.seconds, 3 * 2 + 0.375 + 0.75)
end)

suite:test("a read timeout is retried once, a connection that fails twice",
  function(t)
    local classes = { timeout = "timeout", connect_timeout = "timeout", encoding = "envelope",
      size = "envelope" }
    for kind, count in pairs { timeout = 2, connect_timeout = 3, connect = 3, resolve = 3,
      reset = 3, partial = 3, tls = 3, certificate = 1, encoding = 1, size = 1, headers = 1,
      protocol = 1 } do
      local ask, notes = stage({ timeout = 10 }, { { kind = kind } })
      local _, failure = ask:ask(MESSAGES)
      t:ok(#notes.requests == count, ("%s: %d requests"):format(kind, #notes.requests))
      t:equal(failure.class, classes[kind] or "transport")
      t:equal(notes.records[1].curl_kind, kind)
    end
  end)

suite:test("no wait and no attempt exceeds the budget", function(t)
  -- an answer that never comes: the attempt ends with the budget
  local ask, notes = stage({ budget = 30, timeout = 120 }, { { kind = "timeout" } })
  local _, failure = ask:ask(MESSAGES)
  t:equal({ failure.class, failure.seconds, notes.requests[1].timeout }, { "timeout", 30, 30 })
  t:ok(failure.message:find("no time is left", 1, true), failure.message)
  -- a wait that would end after it is not begun
  ask, notes = stage({ budget = 30 }, { { status = 429, headers = { ["retry-after"] = "29.5" },
    body = "" } })
  _, failure = ask:ask(MESSAGES)
  t:equal({ failure.class, failure.seconds, #notes.requests }, { "http", 0, 1 })
  -- the caller sets what a generation has left
  ask, notes = stage({}, { completion "x" })
  _, failure = ask:ask(MESSAGES, { budget = 0 })
  t:equal({ failure.class, failure.attempts, #notes.requests }, { "budget", 0, 0 })
  _, failure = ask:ask(MESSAGES, { budget = 7 })
  t:equal(failure, nil)
  t:equal(notes.requests[1].timeout, 7)
end)

suite:test("tokens and cost add up, unknown is not 0, and caps end it", function(t)
  local ask, notes = stage({}, { completion "{}" })
  ask:ask(MESSAGES)
  t:equal(ask:totals().cost, host.json.null)
  ask = stage({ price = { input = 1e6, output = 2e6 } }, { completion "{}",
    completion("{}", { usage = { prompt_tokens = -3, completion_tokens = "7" } }) })
  t:equal({ ask:ask(MESSAGES).cost, ask:totals().cost }, { 140, 140 })
  local answer = ask:ask(MESSAGES)
  t:equal({ answer.usage == nil, answer.cost == nil, ask:totals().cost == host.json.null },
    { true, true, true })
  t:ok(ask:totals().estimated_tokens > 0)
  -- a refusal is paid for as well
  ask = stage({ price = { input = 1e6, output = 2e6 } }, { completion("",
    { choices = { { message = { refusal = "no" } } } }) })
  local _, refusal = ask:ask(MESSAGES)
  t:equal({ refusal.class, refusal.cost, refusal.usage.output_tokens, ask:totals().cost },
    { "refusal", 140, 20, 140 })

  local function refused(options, answers, number)
    ask, notes = stage(options, answers)
    for _ = 1, number do t:equal(select(2, ask:ask(MESSAGES)), nil) end
    local _, failure = ask:ask(MESSAGES)
    t:equal({ failure.class, failure.attempts, #notes.requests }, { "caps", 0, number })
    return failure.message
  end
  t:ok(refused({ max_calls = 3 }, { completion "{}" }, 3):find "^max_calls: 3 requests")
  t:ok(refused({ max_tokens_total = 250 }, { completion "{}" }, 2):find "^max_tokens_total: 240 ")
  t:ok(refused({ max_cost = 285, price = { input = 1e6, output = 2e6 } }, { completion "{}" }, 2)
    :find "^max_cost: 280 is spent")
  -- without usage the estimates count: 12 tokens of prompt and 1 of answer
  t:ok(refused({ max_tokens_total = 24 }, { completion("{}", { usage = host.json.null }) }, 1))
  -- retries count as calls
  ask, notes = stage({ max_calls = 2 }, { { status = 500, body = "" } })
  local _, failure = ask:ask(MESSAGES)
  t:equal({ failure.class, failure.attempts, #notes.requests }, { "caps", 2, 2 })
  local _, _, message = stage { max_cost = 1 }
  t:ok(message:find("max_cost needs price", 1, true), message)
end)

suite:test("misuse raises at the caller's line, text that is not UTF-8 is a failure",
  function(t)
    local ask, notes = stage({}, { completion "{}" })
    local message = t:raises("expected a list of messages", function() ask:ask {} end)
    t:ok(message:find("llm_client.lua", 1, true), message)
    local _, failure = ask:ask { { role = "user", content = "\255" } }
    t:equal({ failure.class, failure.attempts, #notes.requests }, { "request", 0, 0 })
  end)
