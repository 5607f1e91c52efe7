--- llm_client.lua: the client of a language model with an injected HTTP function, clock and waits:
--- what is sent, what is read, what is tried again and when, what it costs.

local host = require "limax.host"
local model_stage = require "support.model_stage"

local suite = require("limax.test").suite "llm client"

local MESSAGES = model_stage.MESSAGES
local stage, completion = model_stage.new, model_stage.completion

local SCHEMA = { schema = { type = "object" }, name = "proposal" }

suite:test("a good answer comes back with what it cost, and is recorded", function(t)
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

suite:test("the table of retries: which status, how often, how long", function(t)
  -- status, headers, body -> waits; nil: none
  local usual = { 0.5, 1 }
  for _, case in ipairs {
    { 408, usual }, { 409, usual }, { 429, usual }, { 500, usual }, { 502, usual }, { 503, usual },
    { 529, usual }, { 400, {} }, { 401, {} }, { 403, {} }, { 404, {} }, { 422, {} }, { 302, {} },
    { 501, usual }, { 204, {} }, { 418, {} },
    { 429, { 3, 3 }, { ["retry-after"] = "3" } },
    { 503, { 0.25, 0.25 }, { ["retry-after"] = "0.25" } },
    { 429, { 10, 10 }, { ["retry-after"] = "Wed, 21 Oct 2015 07:28:10 GMT" } },
    { 429, { 10, 10 }, { ["retry-after"] = "Wednesday, 21-Oct-15 07:28:10 GMT" } },
    { 429, { 10, 10 }, { ["retry-after"] = "Wed Oct 21 07:28:10 2015" } },
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

suite:test("one read timeout is tried again, two are not; a connection that fails is tried thrice",
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

suite:test("no wait and no attempt passes the budget", function(t)
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
  -- what a generation has left is the caller's to say
  ask, notes = stage({}, { completion "x" })
  _, failure = ask:ask(MESSAGES, { budget = 0 })
  t:equal({ failure.class, failure.attempts, #notes.requests }, { "budget", 0, 0 })
  _, failure = ask:ask(MESSAGES, { budget = 7 })
  t:equal(failure, nil)
  t:equal(notes.requests[1].timeout, 7)
end)

suite:test("a quota that is used up is told from a rate limit by its code, not by its words",
  function(t)
    local function refused(fields)
      local ask, notes = stage({}, { { status = 429, body = { error = fields } } })
      local _, failure = ask:ask(MESSAGES)
      return failure.class, #notes.requests
    end
    t:equal({ refused { message = "You exceeded your quota", code = "insufficient_quota" } },
      { "quota", 1 })
    t:equal({ refused { message = "x", type = "insufficient_quota" } }, { "quota", 1 })
    t:equal({ refused { message = "INSUFFICIENT QUOTA: tokens per minute" } }, { "http", 3 })
  end)

suite:test("a prompt or an answer that was cut is marked", function(t)
  local long = { { role = "user", content = ("0.125 "):rep(2000) } } -- about 3400 tokens
  local function asked(used, finish)
    local ask = stage({}, { completion("{}", {
      usage = { prompt_tokens = used, completion_tokens = 1 },
      choices = { { message = { content = "{}" }, finish_reason = finish } },
    }) })
    local answer = ask:ask(long)
    return answer.truncated, answer.truncation
  end
  t:equal({ asked(3600, "stop") }, { false })
  t:equal({ asked(2048, "stop") }, { false })
  t:equal({ asked(1024, "stop") }, { true, "prompt" })
  t:equal({ asked(3600, "length") }, { true, "answer" })
end)

suite:test("tokens and cost add up, unknown is not zero, and caps end it", function(t)
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

suite:test("misuse raises at the caller's line, and data that JSON cannot hold is a failure",
  function(t)
    local ask, notes = stage({}, { completion "{}" })
    local message = t:raises("expected a list of messages", function() ask:ask {} end)
    t:ok(message:find("llm_client.lua", 1, true), message)
    local _, failure = ask:ask { { role = "user", content = "\255" } }
    t:equal({ failure.class, failure.attempts, #notes.requests }, { "request", 0, 0 })
  end)

suite:test("a message is one short line of printable text", function(t)
  for said, expected in pairs {
    ["a\nb\r\n\tc"] = "a b c", ["\27[2Jx"] = " [2Jx", ["x\194\1552Jy\226\128\174z"] = "x 2Jy z",
    ["\127"] = " ",
  } do
    local ask = stage({}, { { status = 404, body = { error = { message = said } } } })
    local _, failure = ask:ask(MESSAGES)
    t:equal(failure.message, "HTTP 404: " .. expected:gsub("^ ", "")
      .. "; are the URL and the model right?")
  end
  local ask = stage({}, { { status = 418, body = { error = ("é"):rep(1000) } } })
  local _, failure = ask:ask(MESSAGES)
  t:ok(#failure.message <= 300 and failure.message:find "é%.%.%.$", failure.message)
end)

-- Numbers that look random and are the same every time.
local function generator(seed)
  return function(n)
    seed = (seed * 1103515245 + 12345) % 2 ^ 31
    return math.floor(seed / 65536) % n + 1
  end
end

suite:test("whatever a body holds, an answer or a failure with a class comes out", function(t)
  local random = generator(7)
  local seeds = {
    host.json.encode(completion('{"mutation_rate":0.2}').body),
    host.json.encode { error = { message = "m", code = "c", type = "t", param = "max_tokens" } },
    host.json.encode { detail = { { loc = { "body", "seed" }, msg = "x" } } },
    host.json.encode { choices = { { message = { content = { { type = "text", text = "a" } },
      reasoning = "b", refusal = "c" }, finish_reason = "length" } }, usage = {} },
  }
  local pieces = { "null", "[]", "{}", "1e999", "-1", '"x"', "\255", "\0", "[[", "]", "}", ",", ":",
    '"choices":', '"error":', '"message":', "true", "\\ud800", "" }
  local statuses, classes = { 200, 200, 200, 400, 401, 422, 429, 500, 204, 302 }, {}
  for _ = 1, 5000 do
    local body = seeds[random(#seeds)]
    for _ = 1, random(4) do
      local from = random(#body + 1)
      body = body:sub(1, from - 1) .. pieces[random(#pieces)] .. body:sub(from + random(12) - 1)
    end
    local status = statuses[random(#statuses)]
    local ask = stage({ temperature = 1 }, { { status = status, body = body } })
    local answer, failure = ask:ask(MESSAGES, SCHEMA)
    t:ok(answer and type(answer.content) == "string" or type(failure.class) == "string"
      and type(failure.message) == "string")
    local class = answer and "answer" or failure.class
    classes[class] = (classes[class] or 0) + 1
  end
  for _, class in ipairs { "answer", "envelope", "http", "auth" } do
    t:ok((classes[class] or 0) > 20, class .. ": " .. host.json.encode(classes))
  end
end)
