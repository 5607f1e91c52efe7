--- llm_client.lua: the client of a language model with an injected HTTP function, clock and waits:
--- what is sent and recorded, retries and budgets, cost and caps, what it learns of its endpoint.

local host = require "limax.host"
local model_stage = require "support.model_stage"

local suite = require("limax.test").suite "llm client"

local KEY, MESSAGES = model_stage.KEY, model_stage.MESSAGES
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
    { 408, usual }, { 409, usual }, { 429, usual }, { 500, usual }, { 400, {} }, { 404, {} },
    { 302, {} }, { 503, { 0.25, 0.25 }, { ["retry-after"] = "0.25" } },
    { 429, usual, { ["retry-after"] = "-5" } }, { 429, usual, { ["retry-after"] = "nan" } },
    { 429, usual, { ["retry-after"] = "1e999" } }, { 429, {}, { ["retry-after"] = "121" } },
    { 429, { 120, 120 }, { ["retry-after"] = "120" } },
    { 429, { 0.2, 0.2 }, { ["retry-after-ms"] = "200", ["retry-after"] = "9" } },
    { 400, usual, { ["x-should-retry"] = "true" } }, { 503, {}, { ["x-should-retry"] = "false" } },
  } do
    local status, waits, headers = unpack(case)
    local reply = { status = status, headers = headers, body = "" }
    local ask, notes = stage({ budget = 400 }, { reply })
    local answer, failure = ask:ask(MESSAGES)
    local what = ("%d %s"):format(status, headers and host.json.encode(headers) or "")
    t:equal(answer, nil)
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

-- ---- fields and forms that an endpoint accepts --------------------------------------------------

local SCHEMA = { schema = { type = "object" }, name = "proposal" }

-- A server that refuses requests with some fields, each in its own words.
local function refusing(refusals)
  return function(request)
    local body = host.json.decode(request.body)
    local form = body.response_format and body.response_format.type
    for _, refusal in ipairs(refusals) do
      local name, error, status = unpack(refusal)
      if body[name] ~= nil or form == name then
        return { status = status or 400, body = type(error) == "string"
          and { error = { message = error } } or error }
      end
    end
    return completion "{}"
  end
end

suite:test("a field that a refusal names is left out from then on", function(t)
  local ask, notes = stage({ temperature = 0.2, seed = 1 }, { refusing {
    { "max_tokens", { error = { message = "Unsupported parameter: 'max_tokens' is not supported"
      .. " with this model. Use 'max_completion_tokens' instead.", param = "max_tokens",
      code = "unsupported_parameter" } } },
    { "temperature", "Unsupported value: 'temperature' does not support 0.2 with this model." },
    { "seed", { detail = { { loc = { "body", "seed" }, msg = "extra fields not permitted" } } },
      422 },
    { "json_schema", "Failed to parse grammar" },
    { "json_object", { object = "error", message = "'response_format.type' must be 'text'" } },
  } })
  local answer = ask:ask(MESSAGES, SCHEMA)
  t:equal({ answer.attempts, #notes.waits }, { 6, 0 })
  t:equal(notes.bodies[6], { model = "m", messages = MESSAGES, stream = false,
    max_completion_tokens = 4096 })
  t:equal(notes.records[6]["gen_ai.request.max_tokens"], 4096)
  -- it is remembered, here and after a restore
  t:equal(ask:ask(MESSAGES, SCHEMA).attempts, 1)
  local other, seen = stage({ temperature = 0.2, seed = 1 }, { completion "{}" })
  other:restore(host.json.decode(host.json.encode(ask:state())))
  other:ask(MESSAGES, SCHEMA)
  t:equal(seen.bodies[1], notes.bodies[6])
  t:equal(other:state().totals.calls, 8)
  -- but not for another model
  other, seen = stage({ model = "other" }, { completion "{}" })
  other:restore(ask:state())
  other:ask(MESSAGES, SCHEMA)
  t:equal(seen.bodies[1].response_format.type, "json_schema")
end)

suite:test("smaller requests are not retries, end, and respect the budget", function(t)
  -- a server that refuses whatever it gets
  local ask, notes = stage({ temperature = 1, seed = 1 }, { { status = 400, body = { error = {
    message = "max_tokens, max_completion_tokens, temperature, seed, response_format: no" } } } })
  local _, failure = ask:ask(MESSAGES, SCHEMA)
  t:equal(failure.class, "http")
  t:ok(#notes.requests <= 6, tostring(#notes.requests))
  -- each takes 10 s
  ask, notes = stage({ temperature = 1, seed = 1, budget = 25 }, { { status = 400, takes = 10,
    body = { error = { message = "temperature, seed, response_format: no" } } } })
  _, failure = ask:ask(MESSAGES, SCHEMA)
  t:equal({ failure.class, #notes.requests }, { "budget", 3 })
  -- a value out of range is not an unknown field
  ask, notes = stage({}, { { status = 400, body = { error = { message =
    "max_tokens is too large: 4096. This model supports at most 1024" } } } })
  _, failure = ask:ask(MESSAGES)
  t:equal({ failure.class, #notes.requests }, { "http", 1 })
end)

suite:test("json_object comes with the word json, OpenAI's models get their token field",
  function(t)
    local ask, notes = stage({ format = "json_object" }, { completion "{}" })
    ask:ask({ { role = "system", content = "A" }, { role = "user", content = "B" } }, SCHEMA)
    t:equal(notes.bodies[1].messages[2].content, "B\n\nAnswer with one JSON object.")
    ask:ask(MESSAGES, SCHEMA)
    t:equal(notes.bodies[2].messages, MESSAGES)
    ask, notes = stage({}, { completion "{}" }, { LIMAX_LLM_URL = "https://api.openai.com",
      LIMAX_LLM_MODEL = "m", OPENAI_API_KEY = KEY })
    ask:ask(MESSAGES)
    t:equal({ notes.bodies[1].max_completion_tokens, notes.bodies[1].max_tokens }, { 4096 })
    t:equal(notes.requests[1].headers.Authorization, "Bearer " .. KEY)
  end)

-- ---- the breaker --------------------------------------------------------------------------------

-- Asks before each of these generations; those in which something was sent.
local function asked_in(ask, notes, from, to)
  local list = {}
  for generation = from, to do
    local sent = #notes.requests
    ask:ask(MESSAGES, { generation = generation })
    if #notes.requests > sent then list[#list + 1] = generation end
  end
  return list
end

suite:test("the breaker opens for 5, 10, 20 generations and closes with an answer", function(t)
  local alive = false
  local ask, notes = stage({ budget = 20 }, { function()
    return alive and completion "{}" or { status = 500, body = "" }
  end })
  t:equal(asked_in(ask, notes, 1, 40), { 1, 2, 3, 9, 20 })
  -- state goes over a checkpoint
  local other, seen = stage({ budget = 20 }, { completion "{}" })
  other:restore(host.json.decode(host.json.encode(ask:state())))
  local _, failure = other:ask(MESSAGES, { generation = 40 })
  t:equal({ failure.class, #seen.requests }, { "breaker", 0 })
  -- no probe is sent without time for it
  _, failure = other:ask(MESSAGES, { generation = 41, budget = 0 })
  t:equal({ failure.class, #seen.requests }, { "budget", 0 })
  t:equal({ other:ask(MESSAGES, { generation = 41 }).attempts, #seen.requests }, { 2, 2 })
  t:equal(seen.bodies[1].max_tokens, 16)
  t:equal({ seen.records[1].probe, seen.records[1].attempt, seen.records[2].probe,
    seen.records[2].attempt }, { true, 1, false, 2 })
  -- generations that were not asked in count as well
  alive = true
  ask:ask(MESSAGES, { generation = 45 })
  t:equal({ #notes.requests - 3 * 3 - 2, ask:state().breaker.failures }, { 2, 0 })
  -- if only probes are answered, it opens again for longer
  ask, notes = stage({ budget = 20 }, { function(request)
    return request.body:find("the word OK", 1, true) and completion "OK"
      or { status = 500, body = "" }
  end })
  t:equal(asked_in(ask, notes, 1, 25), { 1, 2, 3, 9, 20 })
end)

suite:test("failures of a working endpoint do not open the breaker", function(t)
  for _, answer in ipairs {
    { status = 400, body = { error = { code = "context_length_exceeded" } } },
    completion("", { choices = { { message = { refusal = "I would rather not" } } } }),
    completion("", { choices = { { message = {}, finish_reason = "content_filter" } } }),
  } do
    local ask, notes = stage({}, { answer })
    for generation = 1, 5 do ask:ask(MESSAGES, { generation = generation }) end
    t:equal({ #notes.requests, ask:state().breaker.failures }, { 5, 0 })
  end
end)
