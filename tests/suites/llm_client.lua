--- llm_client.lua: the client of a language model with an injected HTTP function, clock and waits:
--- what is sent, what is read, what is tried again and when.

local client = require "limax.llm.client"
local host = require "limax.host"

local suite = require("limax.test").suite "llm client"

local KEY = "sk-SENTINEL/0123+456789=abcdef"
local MESSAGES = { { role = "user", content = "Propose something as JSON." } }

-- A client with a fake clock, whose requests are answered by `answers` in turn: an answer, a
-- function of the request, or { kind = } of a failure. What happened is noted.
local function stage(options, answers, environment)
  local notes = { requests = {}, bodies = {}, records = {}, waits = {}, now = 1000 }
  environment = environment or { LIMAX_LLM_URL = "http://127.0.0.1:1", LIMAX_LLM_MODEL = "m",
    LIMAX_LLM_KEY = KEY }
  local made, message = client.new(options or {}, {
    clock = function() return notes.now end,
    wall = function() return 1445412480 end, -- Wed, 21 Oct 2015 07:28:00 GMT
    wait = function(seconds)
      notes.waits[#notes.waits + 1] = seconds
      notes.now = notes.now + seconds
    end,
    random = function() return notes.random or 0 end,
    record = function(record) notes.records[#notes.records + 1] = record end,
    environment = function(name) return environment[name] end,
    http = function(request)
      notes.requests[#notes.requests + 1] = request
      notes.bodies[#notes.bodies + 1] = host.json.decode(request.body)
      local answer = answers[math.min(#notes.requests, #answers)]
      if type(answer) == "function" then answer = answer(request) end
      notes.now = notes.now + (answer.takes or 0)
      if answer.kind then
        notes.now = notes.now + (answer.kind == "timeout" and request.timeout or 0)
        return nil, "http://127.0.0.1:1: " .. answer.kind, { kind = answer.kind, curl = "curl",
          status = 0, headers = {}, body = "" }
      end
      return { status = answer.status or 200, headers = answer.headers or {},
        body = type(answer.body) == "table" and host.json.encode(answer.body) or answer.body }
    end,
  })
  return made, notes, message
end

local function completion(content, fields)
  local body = { id = "c1", model = "m-1",
    choices = { { message = { role = "assistant", content = content }, finish_reason = "stop" } },
    usage = { prompt_tokens = 100, completion_tokens = 20 } }
  for name, value in pairs(fields or {}) do body[name] = value end
  return { body = body }
end

suite:test("a good answer comes back with what it cost, and is recorded", function(t)
  local ask, notes = stage({ price = { input = 2, output = 10 }, temperature = 0.5, seed = 7 },
    { completion '{"mutation_rate":0.2}' })
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
    record["gen_ai.usage.input_tokens"], record["gen_ai.response.finish_reasons"] },
    { 200, 1, "m", 7, "c1", 100, { "stop" } })
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

-- ---- the ladder ---------------------------------------------------------------------------------

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

suite:test("what a refusal names is left out from then on, one step for each", function(t)
  local ask, notes = stage({ temperature = 0.2, seed = 1 }, { refusing {
    { "max_tokens", { error = { message = "Unsupported parameter: 'max_tokens' is not supported"
      .. " with this model. Use 'max_completion_tokens' instead.", param = "max_tokens",
      code = "unsupported_parameter" } } },
    { "temperature", "Unsupported value: 'temperature' does not support 0.2 with this model." },
    { "seed", { detail = { { loc = { "body", "seed" }, msg = "extra fields not permitted" } } },
      422 },
    { "json_schema", "Invalid parameter: 'response_format' of type 'json_schema' is unknown" },
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

suite:test("steps down are no retries, end, and keep to the budget", function(t)
  -- two retries after a step
  local first = true
  local ask, notes = stage({}, { function()
    local body = first and { error = { message = "response_format?" } } or { error = "down" }
    local status = first and 400 or 500
    first = false
    return { status = status, body = body }
  end })
  local _, failure = ask:ask(MESSAGES, SCHEMA)
  t:equal({ failure.class, failure.attempts, #notes.waits }, { "http", 4, 2 })
  -- a server that refuses whatever it gets
  ask, notes = stage({ temperature = 1, seed = 1 }, { { status = 400, body = { error = {
    message = "max_tokens, max_completion_tokens, temperature, seed, response_format: no" } } } })
  _, failure = ask:ask(MESSAGES, SCHEMA)
  t:equal(failure.class, "http")
  t:ok(#notes.requests <= 6, tostring(#notes.requests))
  -- each takes 10 s
  ask, notes = stage({ temperature = 1, seed = 1, budget = 25 }, { { status = 400, takes = 10,
    body = { error = { message = "temperature, seed, response_format: no" } } } })
  _, failure = ask:ask(MESSAGES, SCHEMA)
  t:equal({ failure.class, #notes.requests }, { "budget", 3 })
  -- a value that is out of range is no field that is not known
  ask, notes = stage({}, { { status = 400, body = { error = { message =
    "max_tokens is too large: 4096. This model supports at most 1024" } } } })
  _, failure = ask:ask(MESSAGES)
  t:equal({ failure.class, #notes.requests }, { "http", 1 })
end)

suite:test("json_object is never asked for without the word, and OpenAI's models get their field",
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

suite:test("a prompt that does not fit is a class of its own", function(t)
  for _, error in ipairs {
    { message = "the request exceeds the available context size", code = 400,
      type = "exceed_context_size_error" },
    { message = "too long", code = "context_length_exceeded" },
    { message = "This model's maximum context length is 4096 tokens, max_tokens is too large" },
  } do
    local ask, notes = stage({}, { { status = 400, body = { error = error } } })
    local _, failure = ask:ask(MESSAGES, SCHEMA)
    t:equal({ failure.class, #notes.requests, failure.http_status }, { "context", 1, 400 })
  end
end)

-- ---- what is read -------------------------------------------------------------------------------

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

-- ---- the breaker --------------------------------------------------------------------------------

suite:test("a dead endpoint costs three budgets and four probes in 100 generations", function(t)
  local ask, notes = stage({ budget = 180, timeout = 120 }, { { kind = "timeout" } })
  local start, opened, probes = notes.now, 0, 0
  for generation = 0, 99 do
    local before, sent = notes.now, #notes.requests
    local _, failure = ask:ask(MESSAGES, { generation = generation })
    if failure.class == "breaker" then
      opened = opened + 1
      probes = probes + #notes.requests - sent
      t:ok(notes.now - before <= 5, "a probe takes at most 5 s")
    end
  end
  t:ok(notes.now - start <= 3 * 180 + 25, ("%g s"):format(notes.now - start))
  t:equal({ opened, probes }, { 97, 4 })
  t:equal(#notes.records, #notes.requests)
end)

suite:test("the breaker opens for 5, 10, 20 generations, and closes with an answer", function(t)
  local alive = false
  local ask, notes = stage({ budget = 20 }, { function()
    return alive and completion "{}" or { status = 500, body = "" }
  end })
  local probed = {}
  local function run(from, to)
    for generation = from, to do
      local sent = #notes.requests
      ask:ask(MESSAGES, { generation = generation })
      if #notes.requests > sent then probed[#probed + 1] = generation end
    end
  end
  run(1, 40)
  t:equal(probed, { 1, 2, 3, 9, 20 })
  -- state goes over a checkpoint
  local other, seen = stage({ budget = 20 }, { completion "{}" })
  other:restore(host.json.decode(host.json.encode(ask:state())))
  local _, failure = other:ask(MESSAGES, { generation = 40 })
  t:equal({ failure.class, #seen.requests }, { "breaker", 0 })
  local answer = other:ask(MESSAGES, { generation = 41 })
  t:equal({ answer.attempts, #seen.requests }, { 2, 2 })
  t:equal(seen.bodies[1].max_tokens, 16)
  t:equal({ seen.records[1].probe, seen.records[1].attempt, seen.records[2].probe,
    seen.records[2].attempt }, { true, 1, false, 2 })
  -- generations that were not asked in count as well
  alive, probed = true, {}
  ask:ask(MESSAGES, { generation = 45 })
  t:equal(#notes.requests - 3 * 3 - 2, 2)
  t:equal(ask:state().breaker.failures, 0)
end)

suite:test("a probe that is answered while requests fail opens it again for longer", function(t)
  local ask, notes = stage({ budget = 20 }, { function(request)
    return request.body:find("the word OK", 1, true) and completion "OK"
      or { status = 500, body = "" }
  end })
  local sent = {}
  for generation = 1, 25 do
    local before = #notes.requests
    ask:ask(MESSAGES, { generation = generation })
    if #notes.requests > before then sent[#sent + 1] = generation end
  end
  t:equal(sent, { 1, 2, 3, 9, 20 })
end)

suite:test("what says nothing against the endpoint does not open it", function(t)
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
