--- llm_client.lua: the client of a language model with an injected HTTP function, clock and waits:
--- what is sent and recorded, retries and budgets, caps, the breaker.

local host = require "limax.host"
local model_stage = require "support.model_stage"

local suite = require("limax.test").suite "llm client"

local KEY, MESSAGES = model_stage.KEY, model_stage.MESSAGES
local stage, completion = model_stage.new, model_stage.completion
local SCHEMA = { schema = { type = "object" }, name = "proposal" }

suite:test("an answer comes with its usage, and is recorded", function(t)
  local ask, notes = stage({ temperature = 0.5, seed = 7 },
    { completion '{"mutation_rate":0.2}' })
  local answer = ask:ask(MESSAGES, SCHEMA)
  local parsed = { content = '{"mutation_rate":0.2}', finish_reason = "stop", model = "m-1",
    id = "c1", usage = { input_tokens = 100, output_tokens = 20 } }
  local record = notes.records[1]
  t:equal({ #notes.records, record.answer }, { 1, parsed })
  parsed.attempts, parsed.seconds, parsed.format = 1, 0, "json_schema"
  t:equal(answer, parsed)
  t:equal(notes.bodies[1], { model = "m", messages = MESSAGES, stream = false, max_tokens = 4096,
    temperature = 0.5, seed = 7, response_format = { type = "json_schema",
      json_schema = { name = "proposal", strict = true, schema = { type = "object" } } } })
  t:equal(record.request, notes.requests[1].body)
  t:equal(record.request_sha256, host.sha256(record.request))
  t:equal(host.json.decode(record.raw_body), completion('{"mutation_rate":0.2}').body)
  t:equal(ask:describe(), { endpoint = "http://127.0.0.1:1/v1/chat/completions", model = "m",
    provider = "other", key = "LIMAX_LLM_KEY" })
  -- OpenAI's models refuse max_tokens
  ask, notes = stage({ format = "json_object" }, { completion "{}" }, { LIMAX_LLM_MODEL = "m",
    LIMAX_LLM_URL = "https://api.openai.com", OPENAI_API_KEY = KEY })
  ask:ask(MESSAGES, SCHEMA)
  t:equal(notes.bodies[1], { model = "m", messages = MESSAGES, stream = false,
    max_completion_tokens = 4096, response_format = { type = "json_object" } })
end)

suite:test("which failure is retried, how often and after how long", function(t)
  local usual = { 0.5, 1 }
  -- status or kind, waits, Retry-After
  for _, case in ipairs {
    { 408, usual }, { 409, usual }, { 429, usual }, { 500, usual }, { 400, {} }, { 302, {} },
    { 503, { 0.25, 0.25 }, "0.25" }, { 429, {}, "399.5" }, { 429, usual, "nan" },
    { 429, usual, "Fri, 31 Dec 2027 23:59:59 GMT" },
    { "timeout", usual }, { "connect", usual }, { "resolve", usual }, { "partial", usual },
    { "tls", usual }, { "certificate", {} }, { "encoding", {} }, { "size", {} }, { "headers", {} },
  } do
    local what, waits, after = unpack(case, 1, 3)
    local status = type(what) == "number" and what or nil
    local kind = not status and what or nil
    local ask, notes = stage({ budget = 400, timeout = 10, format = "plain" },
      { { status = status, kind = kind, body = "", headers = { ["retry-after"] = after } } })
    local answer, failure = ask:ask(MESSAGES)
    t:equal({ what, answer, after, notes.waits }, { what, nil, after, waits })
    local count = #waits + 1
    t:equal({ #notes.requests, failure.attempts, #notes.records }, { count, count, count })
    t:equal({ notes.records[1].curl_kind, failure.http_status }, { kind, status })
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
  t:ok(ask:ask(MESSAGES, { budget = 7 }))
  t:equal(notes.requests[1].timeout, 7)
end)

suite:test("calls and tokens add up, and caps end it", function(t)
  local no_usage = { usage = { prompt_tokens = -3, completion_tokens = "7" } }
  local ask, notes = stage({}, { completion "{}", completion("{}", no_usage) })
  ask:ask(MESSAGES)
  t:equal(ask:ask(MESSAGES).usage, nil)
  -- an estimate of 9 tokens of prompt and 1 of answer
  t:equal(ask:state().totals, { calls = 2, input_tokens = 109, output_tokens = 21 })
  local other = stage({}, {})
  other:restore(host.json.decode(host.json.encode(ask:state())))
  t:equal(other:state(), ask:state())

  local function refused(options, answers, number)
    ask, notes = stage(options, answers)
    for _ = 1, number do t:equal(select(2, ask:ask(MESSAGES)), nil) end
    local _, failure = ask:ask(MESSAGES)
    t:equal({ failure.class, failure.attempts, #notes.requests }, { "caps", 0, number })
    return failure.message
  end
  t:ok(refused({ max_calls = 3 }, { completion "{}" }, 3):find "^max_calls: 3 requests")
  t:ok(refused({ max_tokens_total = 248 }, { completion "{}" }, 2):find "^max_tokens_total: 240 ")
  -- retries count as calls
  ask, notes = stage({ max_calls = 2 }, { { status = 500, body = "" } })
  local _, failure = ask:ask(MESSAGES)
  t:equal({ failure.class, failure.attempts, #notes.requests }, { "caps", 2, 2 })
end)

suite:test("a refused request is repeated once without response_format", function(t)
  local ask, notes = stage({ temperature = 0.2 }, { function(request)
    return request.body:find("response_format", 1, true)
      and { status = 422, body = { error = "Failed to parse grammar" } } or completion "{}"
  end })
  for _ = 1, 2 do
    local answer = ask:ask(MESSAGES, SCHEMA)
    t:equal({ answer.attempts, answer.format, #notes.waits }, { 2, "plain", 0 })
  end
  t:equal(notes.bodies[2], { model = "m", messages = MESSAGES, stream = false, max_tokens = 4096,
    temperature = 0.2 })
  -- and not again; each takes 10 s of the budget
  for requests, budget in pairs { [2] = 60, [1] = 10 } do
    ask, notes = stage({ budget = budget }, { { status = 400, takes = 10, body = "no" } })
    local _, failure = ask:ask(MESSAGES, SCHEMA)
    t:equal({ #notes.requests, failure.class }, { requests, requests == 1 and "budget" or "http" })
  end
end)

suite:test("after three failed generations in a row the endpoint is not asked again", function(t)
  local alive = false
  local ask, notes = stage({ budget = 2 }, { function()
    return alive and completion "{}" or { status = 500, body = "" }
  end })
  local function fails(generation)
    return select(2, ask:ask(MESSAGES, { generation = generation }))
  end
  -- failures of one generation count once, an answer begins anew
  for _, generation in ipairs { 1, 1, 1, 2 } do t:equal(fails(generation).class, "http") end
  alive = true
  t:equal(fails(3), nil)
  alive = false
  for generation = 4, 5 do t:equal(fails(generation).message:find "not asked again", nil) end
  t:ok(fails(6).message:find "^the endpoint failed in 3 generations in a row and is not asked")
  local sent = #notes.requests
  alive = true
  t:equal({ fails(7).class, #notes.requests }, { "breaker", sent })
  -- failures of a working endpoint do not count
  for _, answer in ipairs {
    { status = 400, body = { error = { code = "context_length_exceeded" } } },
    completion("", { choices = { { message = { refusal = "I would rather not" } } } }),
    completion("", { choices = { { message = {}, finish_reason = "content_filter" } } }),
  } do
    ask, notes = stage({}, { answer })
    for generation = 1, 5 do fails(generation) end
    t:equal(#notes.requests, 5)
  end
end)
