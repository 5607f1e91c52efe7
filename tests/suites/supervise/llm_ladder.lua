--- llm_ladder.lua: what a client learns of its endpoint: which fields and forms of an answer it
--- accepts, and when the breaker opens.

local host = require "limax.host"
local model_stage = require "support.model_stage"

local suite = require("limax.test").suite "llm ladder"

local KEY, MESSAGES = model_stage.KEY, model_stage.MESSAGES
local stage, completion = model_stage.new, model_stage.completion

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

suite:test("the breaker opens for 5, 10, 20 generations and closes with an answer", function(t)
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
  -- no probe is sent without time for it
  _, failure = other:ask(MESSAGES, { generation = 41, budget = 0 })
  t:equal({ failure.class, #seen.requests }, { "budget", 0 })
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

suite:test("if only probes are answered, the breaker opens again for longer", function(t)
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

suite:test("clients with the same table of endpoints share breaker and form", function(t)
  local endpoints, dead = {}, { { status = 400, body = { error = { param = "response_format" } } },
    { kind = "connect" } }
  local function one(model, answers)
    return stage({ budget = 20, model = model }, answers, nil, endpoints)
  end
  -- the same generations, of one repetition after another: each is a generation of its own
  for repetition = 1, 3 do
    local ask, notes = one("m", repetition == 1 and dead or { { kind = "connect" } })
    local _, failure = ask:ask(MESSAGES, { generation = 1, schema = SCHEMA.schema,
      name = SCHEMA.name })
    t:equal(failure.class, "transport")
    local form = notes.bodies[#notes.bodies].response_format
    t:equal(form.type, "json_object")
  end
  -- the next client probes once
  local ask, notes = one("m", { { kind = "connect" } })
  for generation = 1, 5 do
    local _, failure = ask:ask(MESSAGES, { generation = generation })
    t:equal({ failure.class, #notes.requests }, { "breaker", 1 })
  end
  t:equal({ ask:totals().calls, notes.records[1].probe }, { 1, true })
  ask, notes = one("m", { completion "{}" })
  t:ok(ask:ask(MESSAGES, { generation = 1 }))
  t:equal(#notes.requests, 2)
  -- another model of the endpoint, and a client that shares nothing
  t:ok(one("other", { completion "{}" }):ask(MESSAGES, { generation = 1 }))
  t:ok(stage({ model = "m" }, { completion "{}" }):ask(MESSAGES, { generation = 1 }))
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
