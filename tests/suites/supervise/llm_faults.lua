--- llm_faults.lua: the client of a language model against a server that misbehaves in HTTP and in
--- its answers, fault by fault (17 to 33, and 49: keys that come back). llm_faults_transport.lua
--- has 1 to 16 and says what is held for all. Faults of payload, injection and host are not the
--- client's: their suites are the parser's and the run's.

local base64 = require "limax.supervise.llm.base64"
local client = require "limax.supervise.llm.client"
local faulty_server = require "support.faulty_server"
local host = require "limax.host"
local played = require "support.played"
local process = require "support.process"

local suite = require("limax.test").suite "llm faults"

local KEY, GOOD, MESSAGES = played.KEY, played.GOOD, played.MESSAGES
local play, play_all, leaks = played.once, played.all, played.leaks
local USUAL = { 0.5, 1 } -- s between three attempts

suite:test("17: Retry-After in all its forms", function(t)
  local server = faulty_server.open(t)
  play_all(t, server, {
    { "f17_retry_after_float", "answer", 2, { 0.7 } },
    { "f17_retry_after_seconds", "answer", 2, { 3 } },
    { "f17_retry_after_date", "http", 1, {}, "the server asks to wait" }, -- in the year 2100
    { "f17_retry_after_past", "answer", 2, { 0.5 } },
    { "f17_retry_after_zero", "answer", 2, { 0.5 } },
    { "f17_retry_after_negative", "answer", 2, { 0.5 } },
    { "f17_retry_after_abc", "answer", 2, { 0.5 } },
    { "f17_retry_after_86400", "http", 1, {}, "the server asks to wait 86400 s" },
    { "f17_retry_after_ms", "answer", 2, { 0.25 } },
    { "f17_retry_after_minute", "http", 1, {}, "no time is left" },
    { "f17_should_retry", "answer", 2, { 0.5 } },
    { "f17_should_not_retry", "http", 1, {} },
  })
  -- and one that is waited for
  local came = play(t, server, "f17_retry_real", { real = true })
  t:equal({ came.class, came.requests }, { "answer", 2 })
  t:ok(came.took >= 0.3)
  server:close()
end)

suite:test("18 to 20: quotas, servers that fail once or always, models that load", function(t)
  local server = faulty_server.open(t)
  play_all(t, server, {
    { "f18_quota", "quota", 1, {}, "You exceeded your current quota" },
    { "f18_quota_words", "http", 3, USUAL },
    { "f18_quota_403", "quota", 1, {}, "HTTP 403: used up" },
    { "f18_quota_402", "quota", 1, {}, "the account has to be paid" },
    { "f19_408_once", "answer", 2, { 0.5 } }, { "f19_409_once", "answer", 2, { 0.5 } },
    { "f19_500_once", "answer", 2, { 0.5 } }, { "f19_502_once", "answer", 2, { 0.5 } },
    { "f19_503_once", "answer", 2, { 0.5 } }, { "f19_504_once", "answer", 2, { 0.5 } },
    { "f19_529_once", "answer", 2, { 0.5 } },
    { "f19_500_always", "http", 3, USUAL, "HTTP 500: oops; 3 attempts failed" },
    { "f20_loading_503", "answer", 3, USUAL }, { "f20_loading_500", "answer", 2, { 0.5 } },
    { "f20_busy", "http", 3, USUAL },
  })
  server:close()
end)

suite:test("21: what a refusal names is left out, and the next question begins there", function(t)
  local server = faulty_server.open(t)
  local cases = {
    f21_max_tokens = { 2, function(last)
      t:equal({ last.max_tokens, last.max_completion_tokens }, { nil, 4096 })
    end },
    f21_temperature = { 2, function(last) t:equal(last.temperature, nil) end },
    f21_response_format = { 2, function(last)
      t:equal(last.response_format, { type = "json_object" })
    end },
    f21_no_form = { 3, function(last) t:equal(last.response_format, nil) end },
    f21_seed = { 2, function(last) t:equal({ last.seed, last.temperature }, { nil, 0.3 }) end },
    f21_grammar = { 2, function(last) t:equal(last.response_format.type, "json_object") end },
    f21_json_word = { 2, function(last)
      t:ok(last.messages[1].content:find("one JSON object", 1, true))
    end },
  }
  for name, case in pairs(cases) do
    local requests, check = unpack(case)
    local came = play(t, server, name, { options = { temperature = 0.3, seed = 5 },
      messages = name == "f21_json_word" and { { role = "user", content = "Propose." } } or nil })
    t:ok(came.class == "answer" and came.requests == requests, ("%s: %s after %d requests")
      :format(name, came.class, came.requests))
    t:equal(came.waits, {})
    check(server:last(name))
    t:equal(came.client:ask(MESSAGES, { schema = { type = "object" } }).attempts, 1)
    t:equal(server:counts()[name].requests, requests + 1)
  end
  server:close()
end)

suite:test("22 to 25: refusals that are final, and bodies that are no answer", function(t)
  local server = faulty_server.open(t)
  play_all(t, server, {
    { "f22_context", "context", 1, {}, "exceeds the available context size" },
    { "f23_401", "auth", 1, {}, "Incorrect API key provided: [key]", check = function(came)
      t:equal(came.records[1].x_request_id, "req-[key]")
      t:ok(came.records[1].raw_body:find("provided: [key]", 1, true))
    end },
    { "f23_403", "auth", 1, {}, "HTTP 403: this model is not yours" },
    { "f23_error_in_list", "http", 1, {}, "HTTP 400: API key not valid" },
    { "f23_404", "http", 1, {}, "does not exist; are the URL and the model right?" },
    { "f23_404_page", "http", 1, {}, "HTTP 404; are the URL and the model right?" },
    { "f23_422", "http", 1, {}, "HTTP 422: field required" },
    { "f24_error_object", "envelope", 1, {}, "upstream broke" },
    { "f24_error_text", "envelope", 1, {}, "model 'm' not found" },
    { "f24_error_status", "http", 3, USUAL, "provider busy" },
    { "f24_error_null", "answer", 1 }, { "f24_error_empty", "answer", 1 },
    { "f24_error_in_choice", "envelope", 1, {}, "holds no text: provider lost" },
    { "f25_html", "envelope", 1, {}, "a web page, not JSON" },
    { "f25_plain_type", "answer", 1 }, { "f25_bom", "answer", 1 },
    { "f25_empty_204", "envelope", 1, {}, "the answer is empty" },
    { "f25_empty_200", "envelope", 1, {}, "the answer is empty" },
    { "f25_list", "envelope", 1, {}, "no object" },
    { "f25_not_utf8", "envelope", 1, {}, "not UTF-8", check = function(came)
      t:equal(came.records[1].raw_body_base64, base64.encode '{"choices": "\255\254"}')
    end },
    { "f25_deep", "envelope", 1, {}, "nested deeper" },
    { "f25_half", "envelope", 1, {}, "no JSON" },
  })
  server:close()
end)

suite:test("26 to 29: envelopes without a text, refusals, and how an answer ended", function(t)
  local server = faulty_server.open(t)
  local function finish(expected, truncated)
    return function(came)
      t:equal({ came.answer.finish_reason, came.answer.truncated }, { expected, truncated })
    end
  end
  play_all(t, server, {
    { "f26_no_choices", "envelope", 1, {}, "no list of choices" },
    { "f26_empty_choices", "envelope", 1, {}, "choices is empty" },
    { "f26_choices_object", "envelope", 1, {}, "no list of choices" },
    { "f26_choices_numbers", "envelope", 1, {}, "holds no text" },
    { "f26_no_message", "envelope", 1, {}, "holds no text" },
    { "f27_content_null", "envelope", 1, {}, "holds no text" },
    { "f27_content_empty", "envelope", 1, {}, "holds no text" },
    { "f27_content_number", "envelope", 1, {}, "holds no text" },
    { "f27_parts", "answer", 1 },
    { "f27_parts_empty", "envelope", 1, {}, "holds no text" },
    { "f28_refusal", "refusal", 1, {}, "the model refuses: I cannot help [31mwith that" },
    { "f28_filter", "filter", 1, {}, "content filter" },
    { "f28_filter_400", "filter", 1, {}, "triggered the content policy" },
    { "f29_length", "answer", 1, content = '{"mutation_rate": 0.', check = finish("length", true) },
    { "f29_length_empty", "envelope", 1, {}, "all tokens were used up" },
    { "f29_tool_calls", "envelope", 1, {}, "a tool that it was not offered" },
    { "f29_unknown", "answer", 1, check = finish("because", false) },
    { "f29_no_finish", "answer", 1, check = finish(nil, false) },
  })
  server:close()
end)

suite:test("30 to 33: thinking, usage that is none, cut prompts, several choices", function(t)
  local server = faulty_server.open(t)
  local function no_usage(came)
    t:equal({ came.answer.usage == nil, came.answer.cost == nil }, { true, true })
    t:equal(came.client:totals().cost, host.json.null)
  end
  local function reasoning(came) t:equal(came.answer.reasoning, GOOD) end
  local priced = { price = { input = 1, output = 1 } }
  play_all(t, server, {
    { "f30_reasoning_only", "answer", 1, content = "", check = reasoning },
    { "f30_reasoning_field", "answer", 1, content = "", check = reasoning },
    { "f30_think", "answer", 1, content = '<think>{"mutation_rate": 9}</think>' .. GOOD },
    { "f31_no_usage", "answer", 1, options = priced, check = no_usage },
    { "f31_usage_negative", "answer", 1, options = priced, check = no_usage },
    { "f31_usage_text", "answer", 1, options = priced, check = no_usage },
    { "f31_usage_list", "answer", 1, options = priced, check = no_usage },
    { "f31_other_model", "answer", 1, check = function(came)
      t:equal(came.answer.model, "another-model")
      t:equal({ came.records[1]["gen_ai.request.model"], came.records[1]["gen_ai.response.model"] },
        { "m", "another-model" })
    end },
    { "f32_cut_prompt", "answer", 1,
      messages = { { role = "user", content = ("1.25 "):rep(2000) } },
      check = function(came)
        t:equal({ came.answer.truncated, came.answer.truncation }, { true, "prompt" })
      end },
    { "f33_two_choices", "answer", 1 },
  })
  server:close()
end)

suite:test("49: a key that a server echoes in any form is taken out everywhere", function(t)
  local server = faulty_server.open(t)
  local came = play(t, server, "f49_echo")
  t:equal(came.class, "answer")
  t:ok(came.answer.content:find("[key]", 1, true), came.answer.content)
  t:equal({ came.answer.id, came.answer.model, came.answer.finish_reason,
    came.records[1].x_request_id, came.records[1].retry_after },
    { "[key]", "[key]", "[key]", "[key]", "[key]" })
  came = play(t, server, "f49_echo_reset")
  t:equal({ came.class, came.records[1].raw_body }, { "transport", "[key]" })
  -- the server did get it
  t:equal(server:counts().f49_echo, { requests = 1, keys = 1 })
  server:close()
end)

suite:test("a hundred questions to a server that fails two times of ten add up", function(t)
  local server = faulty_server.open(t)
  local records, answers = 0, 0
  local made = client.new({ url = server:url "unreliable", model = "m" }, {
    environment = function() return nil end, wait = function() end,
    record = function() records = records + 1 end })
  local attempts = 0
  for generation = 1, 100 do
    local answer, failure = made:ask(MESSAGES, { generation = generation })
    attempts = attempts + (answer or failure).attempts
    answers = answers + (answer and 1 or 0)
  end
  local counted = server:counts().unreliable.requests
  t:equal({ records, attempts, made:totals().calls }, { counted, counted, counted })
  t:equal({ answers, made:totals().answers }, { 100, 100 })
  server:close()
end)

suite:test("a real endpoint answers, where LIMAX_LLM_URL names one", { tags = { "endpoint" } },
  function(t)
    if not os.getenv "LIMAX_LLM_URL" then t:skip "LIMAX_LLM_URL is not set" end
    local made, message = client.new {}
    t:ok(made, message)
    local answer, failure = made:ask({ { role = "user",
      content = 'Answer with this JSON object and nothing else: {"mutation_rate": 0.1}' } }, {
      name = "proposal", schema = { type = "object", additionalProperties = false,
        required = { "mutation_rate" }, properties = { mutation_rate = { type = "number" } } } })
    t:ok(answer, failure and failure.message)
    t:ok((answer.content .. (answer.reasoning or "")):find("mutation_rate", 1, true),
      answer.content)
    t:note(("%s answered in %.1f s"):format(made:describe().endpoint, answer.seconds))
  end)

suite:test("limax doctor says which endpoint, and asks it only with --llm", function(t)
  local server = faulty_server.open(t)
  local function doctor(words, name)
    return process.run(t:folder(), { "doctor", unpack(words) }, name and
      ("LIMAX_LLM_URL=%s LIMAX_LLM_MODEL=m LIMAX_LLM_KEY='%s'"):format(server:url(name), KEY)
      or "-u LIMAX_LLM_URL")
  end
  local status, output = doctor {}
  t:equal(status, 0)
  t:ok(output:find("LLM           none: no endpoint of a language model is configured", 1, true),
    output)
  status, output = doctor({}, "good")
  t:equal(status, 0)
  t:ok(output:find(server:url "good" .. "/chat/completions, model m, key from LIMAX_LLM_KEY; not"
    .. " asked", 1, true), output)
  t:equal(server:counts().good, nil)
  local said
  status, said = doctor({ "--llm" }, "good")
  t:equal(status, 0)
  t:ok(said:find("; answered in %d+%.%d s, form json_schema, %d+ %+ 8 tokens"), said)
  t:equal(server:counts().good, { requests = 1, keys = 1 })
  output = output .. said
  status, said = doctor({ "--llm", "--json" }, "f23_401")
  t:equal(status, 1)
  local facts = host.json.decode(said).llm
  t:equal({ facts.answered, facts.failure }, { false, "auth: HTTP 401: Incorrect API key provided:"
    .. " [key]. You can find yours at /account; is the key right?" })
  t:ok(not leaks(output .. said), output .. said)
  status, said = doctor({ "--llm" }, nil)
  t:ok(status == 1 and said:find("set LIMAX_LLM_URL", 1, true), said)
  server:close()
end)
