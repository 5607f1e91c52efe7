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
