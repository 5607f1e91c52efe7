--- llm_faults.lua: the client of a language model against a server that misbehaves, fault by fault:
--- the class of the outcome, the number of requests, the deadline, a record for each attempt, and a
--- key that shows up nowhere. Waits between retries are noted, not waited for, except where the
--- wait is what is tested. Faults of payload, injection and host are not the client's: their suites
--- are the parser's and the run's.
---
--- What a process alone cannot stage: a network that loses packets (a full queue on the loopback
--- interface stands for it), a resolver that answers wrongly or late (a name that no resolver can
--- be asked for stands for one that fails), a clock that jumps (waits are counted on a clock that
--- never steps back: see llm_client.lua).

local base64 = require "limax.llm.base64"
local client = require "limax.llm.client"
local faulty_server = require "support.faulty_server"
local ffi = require "ffi"
local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "llm faults"

local KEY = "sk-SENTINEL/0123+456789=abcdef"
local GOOD = '{"mutation_rate": 0.2}'
local MESSAGES = { { role = "user", content = "Propose something as JSON." } }
local LATE = 2 -- s after its deadline by which a wait has ended
local BUDGET = 5 -- s; no fault here needs more

-- What would give the key away: its first eight characters, base64, percent, hexadecimal.
local function leaks(text)
  local hex = KEY:gsub(".", function(letter) return ("%02x"):format(letter:byte()) end)
  for _, form in ipairs { KEY:sub(1, 8), "SENTINEL", base64.encode(KEY):sub(1, 11),
    base64.encode("user:" .. KEY):sub(9, 20), "SENTINEL%2F0123", hex:sub(1, 16) } do
    if text:find(form, 1, true) then return form end
  end
  return nil
end

---@class played
---@field url? string instead of the scenario's own
---@field options? table of the client
---@field messages? table
---@field asked? table of the question
---@field real? boolean waits are waited for

-- Asks once; holds everything that came out against the laws for all faults.
local function play(t, server, name, how)
  how = how or {}
  local records, waits = {}, {}
  local options = { url = how.url or server:url(name), model = "m", budget = BUDGET }
  for key, value in pairs(how.options or {}) do options[key] = value end
  local made, message = client.new(options, {
    environment = function(variable) return variable == "LIMAX_LLM_KEY" and KEY or nil end,
    random = function() return 0 end,
    record = function(record) records[#records + 1] = record end,
    wait = how.real and host.wait or function(seconds) waits[#waits + 1] = seconds end,
  })
  t:ok(made, message)
  local start = host.clock()
  local answer, failure = made:ask(how.messages or MESSAGES, how.asked or
    { schema = { type = "object" }, name = "proposal" })
  local took = host.clock() - start
  t:ok(took < options.budget + LATE, ("%s: it took %.1f s"):format(name, took))
  local said = host.json.encode { answer = answer, failure = failure, records = records,
    state = made:state(), description = made:describe() }
  t:ok(not leaks(said), ("%s: the key shows as %s"):format(name, tostring(leaks(said))))
  t:equal(#records, (answer or failure).attempts)
  if failure then
    t:ok(not failure.message:find "%c" and #failure.message < 500, failure.message)
  end
  return { answer = answer, failure = failure, records = records, waits = waits, took = took,
    class = failure and failure.class or "answer", client = made, requests = #records }
end

-- Plays scenarios of a table { name, class, requests, waits or nil, text of the message or nil }.
local function play_all(t, server, cases)
  local expected = {}
  for _, case in ipairs(cases) do
    local name, class, requests, waits, text = unpack(case, 1, 5)
    local came = play(t, server, name, { options = case.options, messages = case.messages })
    t:ok(came.class == class and came.requests == requests, ("%s: %s after %d requests%s")
      :format(name, came.class, came.requests, came.failure and ": " .. came.failure.message or ""))
    if waits then t:equal(came.waits, waits) end
    if text then t:ok(came.failure.message:find(text, 1, true), came.failure.message) end
    if class == "answer" then
      t:ok(came.answer.content == (case.content or GOOD), name .. ": " .. came.answer.content)
    end
    if case.check then case.check(came) end
    expected[name] = requests
  end
  local counts = server:counts()
  for name, requests in pairs(expected) do
    t:ok(counts[name].requests == requests, ("%s: the server counted %d requests"):format(name,
      counts[name].requests))
  end
end

local USUAL = { 0.5, 1 } -- s between three attempts

suite:test("1 to 5, 9: names, ports and connections that fail are tried thrice", function(t)
  local server = faulty_server.open(t)
  local function port(number) return ("http://127.0.0.1:%d"):format(number) end
  -- a name that no resolver can even ask for: nothing leaves the machine
  local came = play(t, server, "1 no such name", { options = { allow_insecure = true },
    url = ("http://%s.invalid"):format(("x"):rep(64)) })
  t:equal({ came.class, came.requests, came.waits }, { "transport", 3, USUAL })
  came = play(t, server, "2 refused", { url = port(server.ports.refused) })
  t:equal({ came.class, came.requests, came.records[1].curl_kind }, { "transport", 3, "connect" })
  -- nobody takes the connection
  came = play(t, server, "3 blackhole", { url = port(server.ports.blackhole),
    options = { budget = 1 } })
  t:equal({ came.class, came.requests, came.records[1].curl_kind },
    { "timeout", 1, "connect_timeout" })
  play_all(t, server, {
    { "f04_reset", "transport", 3, USUAL },
    { "f05_reset_in_body", "transport", 3, USUAL },
    { "f09_length_too_long", "transport", 3, USUAL, check = function(one)
      -- what had come is recorded
      t:equal({ one.records[1].curl_kind, one.records[1].http_status }, { "partial", 200 })
      t:ok(one.records[1].raw_body:find("cmpl-1", 1, true))
    end },
    { "f09_length_too_short", "envelope", 1, {}, "no JSON" },
    { "f09_broken_chunks", "transport", 3 },
    { "f09_chunks_break_off", "transport", 3 },
    { "f09_no_http", "transport", 1 },
  })
  server:close()
end)

suite:test("3, 6, 7, 8, 15: whatever never ends, ends with the deadline", function(t)
  local server = faulty_server.open(t)
  for _, name in ipairs { "f06_silent", "f07_slow_headers", "f08_slow_body",
    "f15_endless_events" } do
    local came = play(t, server, name, { options = { budget = 0.7 } })
    t:equal({ came.class, came.requests }, { "timeout", 1 })
    t:ok(came.took > 0.6, name)
  end
  -- one read timeout is tried again, two are not
  local came = play(t, server, "f06_silent", { options = { timeout = 0.3 } })
  t:equal({ came.class, came.requests, came.waits }, { "timeout", 2, { 0.5 } })
  server:close()
end)

suite:test("7, 14, 15: whatever is too large is cut off, and not asked for again", function(t)
  local server = faulty_server.open(t)
  local function cut(came)
    local record = came.records[1]
    t:equal({ record.curl_kind, record.raw_body_truncated }, { "size", true })
    t:ok(#record.raw_body <= 2 ^ 20)
  end
  play_all(t, server, {
    { "f07_endless_headers", "transport", 1, {}, "64 KiB of headers" },
    { "f07_endless_interim", "transport", 1, {}, "64 KiB of headers" },
    { "f14_gzip_bomb", "envelope", 1, {}, "answered more than 1 MiB", check = cut },
    { "f14_wrong_encoding", "envelope", 1, {} },
    { "f14_gzip", "answer", 1 },
    { "f15_large_body", "envelope", 1, {}, "answered more than 1 MiB", check = cut },
    { "f15_endless_body", "envelope", 1, {}, "answered more than 1 MiB", check = cut },
    { "f15_events", "envelope", 1, {}, "streams its answer" },
  })
  server:close()
end)

suite:test("10: a certificate that does not hold ends it before the key is sent", function(t)
  local server = faulty_server.open(t, { certificates = true })
  local tls = server.ports.tls
  if not tls then t:skip(server.ports.tls_missing) end
  local function ask(name, ca_file)
    return play(t, server, "10 " .. name, { options = { ca_file = ca_file },
      url = ("https://127.0.0.1:%d/good"):format(tls[name] or server.ports.port) })
  end
  local ours = server.ports.ca_file
  local came = ask("good", ours)
  t:equal({ came.class, came.answer.content }, { "answer", GOOD })
  t:equal(server:counts().good, { requests = 1, keys = 1 })
  for name, ca_file in pairs { good = false, self_signed = ours, expired = ours,
    wrong_host = ours } do
    came = ask(name, ca_file or nil)
    t:equal({ name, came.class, came.requests, came.records[1].curl_kind },
      { name, "transport", 1, "certificate" })
  end
  -- a server that speaks no TLS
  came = ask("plain", ours)
  t:equal({ came.class, came.requests, came.records[1].curl_kind }, { "transport", 3, "tls" })
  came = ask("good", "/nonexistent.pem")
  t:equal({ came.class, came.requests }, { "transport", 1 })
  t:equal(server:counts().good, { requests = 1, keys = 1 })
  server:close()
end)

suite:test("11: redirects are answers: neither followed nor given the key", function(t)
  local server, cases = faulty_server.open(t), {}
  for _, name in ipairs { "301", "302", "303", "307", "308", "host", "loop" } do
    cases[#cases + 1] = { "f11_redirect_" .. name, "http", 1, {},
      "a redirect, which is not followed" }
  end
  play_all(t, server, cases)
  t:equal(server:counts().f11_target, nil)
  server:close()
end)

suite:test("12: a proxy's page is no answer", function(t)
  local server = faulty_server.open(t)
  ffi.cdef "int setenv(const char*, const char*, int); int unsetenv(const char*);"
  -- a name that only a proxy is asked for
  local function through(name)
    ffi.C.setenv("http_proxy", server.base, 1)
    local came = play(t, server, name, { options = { allow_insecure = true },
      url = "http://model.invalid/" .. name })
    ffi.C.unsetenv "http_proxy"
    return came
  end
  local came = through "f12_proxy_page"
  t:equal({ came.class, came.requests, came.failure.http_status }, { "http", 3, 502 })
  came = through "f12_proxy_login"
  t:equal({ came.class, came.requests }, { "envelope", 1 })
  t:ok(came.failure.message:find("a web page", 1, true), came.failure.message)
  t:equal(server:counts().f12_proxy_page.requests, 3)
  server:close()
end)

suite:test("13: broken IPv6 before good IPv4", function(t)
  local server = faulty_server.open(t)
  if not server.ports.ipv6 then t:skip("no IPv6 here: " .. server.ports.ipv6_missing) end
  local came = play(t, server, "good", { url = ("http://localhost:%d/good"):format(
    server.ports.port) })
  t:equal({ came.class, came.requests }, { "answer", 1 })
  server:close()
end)

-- A script that asks and prints how long it waited.
local ASK = [[
local client = require "limax.llm.client"
local made = assert(client.new({ model = "m", url = os.getenv "LIMAX_TEST_URL" }, {
  record = function(record) io.stderr:write("recorded ", tostring(record.http_status), "\n") end,
}))
io.stderr:write "ready\n"
made:ask { { role = "user", content = "json" } }
print "not reached"
]]

suite:test("16: Ctrl-C ends a wait for an answer, and a wait between attempts", function(t)
  local server = faulty_server.open(t)
  for name, ready in pairs { f06_silent = "ready", f17_retry_after_minute = "recorded 503" } do
    local folder = t:folder()
    process.write(folder .. "/ask.lua", ASK)
    local child = process.start(folder, { "ask.lua" }, "LIMAX_TEST_URL=" .. server:url(name))
    child:wait_for(ready)
    child:signal "INT"
    local status, output, seconds = child:finish()
    t:equal(status, 130)
    t:ok(output:find("limax: interrupted", 1, true) and not output:find("not reached", 1, true),
      output)
    t:ok(seconds < LATE, ("%s: it took %.1f s"):format(name, seconds))
  end
  server:close()
end)

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
    f21_grammar = { 2, function(last) t:equal(last.response_format.type, "json_object") end },
    f21_json_word = { 2, function(last)
      t:ok(last.messages[1].content:find("one JSON object", 1, true))
    end },
  }
  for name, case in pairs(cases) do
    local requests, check = unpack(case)
    local came = play(t, server, name, { options = { temperature = 0.3 },
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
  t:ok(said:find("; answered in %d+%.%d s, form json_schema, 40 %+ 8 tokens"), said)
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
