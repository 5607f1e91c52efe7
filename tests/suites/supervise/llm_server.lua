--- llm_server.lua: the client of a language model, and whole runs under it, against a server that
--- misbehaves: connections, TLS, bodies without an end, keys that come back.

local client = require "limax.supervise.llm.client"
local evolution = require "support.evolution"
local faulty_server = require "support.faulty_server"
local host = require "limax.host"
local model_stage = require "support.model_stage"
local process = require "support.process"
local talker = require "support.talker"

local suite = require("limax.test").suite "llm server"

local KEY, leaks = model_stage.KEY, model_stage.leaks
local LONGEST = 60 -- s; no scenario needs more on a slow machine

-- Plays a scenario to a client and checks what holds for all of them: the deadline, a record for
-- each attempt, no key in any output. `options` are the client's; `real` waits between attempts.
local function play(t, server, name, options, real)
  local records, waits = {}, {}
  local all = evolution.with({ url = server:url(name), model = "m", budget = LONGEST }, options)
  local made = t:ok(client.new(all, {
    environment = function(variable) return variable == "LIMAX_LLM_KEY" and KEY or nil end,
    record = function(record) records[#records + 1] = record end,
    wait = real and host.wait or function(seconds) waits[#waits + 1] = seconds end,
  }))
  local start = host.clock()
  local answer, failure = made:ask(model_stage.MESSAGES,
    { schema = { type = "object" }, name = "proposal" })
  local took = host.clock() - start
  t:ok(took < all.budget + process.LATE, ("%s: it took %.1f s"):format(name, took))
  t:ok(not leaks(host.json.encode { answer = answer, failure = failure, records = records,
    state = made:state(), description = made:describe() }), name .. " shows the key")
  t:equal(#records, (answer or failure).attempts)
  return { answer = answer, records = records, waits = waits, took = took,
    class = failure and failure.class or "answer", requests = #records,
    kind = records[1] and records[1].curl_kind, message = failure and failure.message or "" }
end

-- Scenario, class, number of requests, and where they matter: libcurl's kind of the failure, text
-- of the message, options.
local HALF_A_SECOND = { budget = 0.5 }
local FAULTS = {
  { "reset", "transport", 3 }, { "length_too_long", "transport", 3, "partial" },
  { "no_http", "transport", 1 },
  { "redirect", "http", 1, nil, "a redirect, which is not followed" },
  { "proxy_page", "http", 3, nil, "HTTP 502" },
  -- stopped by the deadline or by their size
  { "silent", "timeout", 1, nil, nil, HALF_A_SECOND },
  { "slow_body", "timeout", 1, nil, nil, HALF_A_SECOND },
  { "endless_headers", "transport", 1, nil, "64 KiB of headers" },
  { "endless_body", "envelope", 1, "size", "answered more than 1 MiB" },
  { "gzip_bomb", "envelope", 1, "size", "answered more than 1 MiB" },
  { "gzip_good", "answer", 1 },
}

suite:test("each fault of a connection has its class and its number of requests", function(t)
  local server = faulty_server.open(t)
  for _, row in ipairs(FAULTS) do
    local name, class, requests, kind, text, options = unpack(row, 1, 6)
    local result = play(t, server, name, options)
    t:equal({ name, result.class, result.requests, kind and result.kind },
      { name, class, requests, kind })
    t:ok(not text or result.message:find(text, 1, true), name .. ": " .. result.message)
    t:ok(options ~= HALF_A_SECOND or result.took > 0.4, name)
    t:equal(server:ask "counts"[name].requests, requests)
    local record = result.records[1]
    t:equal(record.raw_body_truncated, kind == "size")
    t:ok(not record.raw_body or #record.raw_body <= 2 ^ 20)
    if class == "answer" then t:equal(result.answer.content, '{"mutation_rate": 0.2}') end
  end
  t:equal(server:ask "counts".redirect_target, nil)
  local result = play(t, server, "refused", {
    url = "http://127.0.0.1:" .. server.ports.refused })
  t:equal({ result.class, result.requests, result.kind }, { "transport", 3, "connect" })
  -- the wait that a server asks for is kept
  result = play(t, server, "retry_after", nil, true)
  t:equal({ result.class, result.requests }, { "answer", 2 })
  t:ok(result.took >= 0.3)
  server:close()
end)

suite:test("without a valid certificate the key is not sent", function(t)
  local server = faulty_server.open(t, true)
  if server.ports.tls_missing then t:skip(server.ports.tls_missing) end
  local certificates = server.ports.certificates
  -- server, certificates that the client trusts -> class, requests, kind
  for _, row in ipairs {
    { "good", certificates.good, "answer", 1 },
    { "good", nil, "transport", 1, "certificate" },
    { "expired", certificates.expired, "transport", 1, "certificate" },
    { "wrong_host", certificates.wrong_host, "transport", 1, "certificate" },
    { "without TLS", certificates.good, "transport", 3, "tls" },
  } do
    local name, ca_file, class, requests, kind = unpack(row, 1, 5)
    local result = play(t, server, name, { ca_file = ca_file,
      url = ("https://127.0.0.1:%d/good"):format(server.ports.tls[name] or server.ports.port) })
    t:equal({ name, result.class, result.requests, result.kind }, { name, class, requests, kind })
  end
  t:equal(server:ask "counts".good, { requests = 1, keys = 1 })
  server:close()
end)

suite:test("a key that a server echoes is replaced everywhere", function(t)
  local server = faulty_server.open(t)
  local result = play(t, server, "echo")
  local answer, record = result.answer, result.records[1]
  t:equal(answer.content, "your key: [key]")
  for _, text in ipairs { answer.id, answer.model, answer.finish_reason, record.answer.id,
    record.x_request_id, record.retry_after, host.json.decode(record.raw_body).id } do
    t:equal(text, "[key]")
  end
  result = play(t, server, "echo_reset")
  t:equal({ result.class, result.records[1].raw_body }, { "transport", "[key]" })
  result = play(t, server, "unauthorized")
  t:equal(result.records[1].x_request_id, "req-[key]")
  t:equal(server:ask "counts".echo, { requests = 1, keys = 1 })
  server:close()
end)

suite:test("limax doctor describes the endpoint and asks it only with --llm", function(t)
  local server = faulty_server.open(t)
  local function doctor(words, name)
    return process.run(t:folder(), { "doctor", "--json", unpack(words) },
      ("LIMAX_LLM_URL=%s LIMAX_LLM_MODEL=m LIMAX_LLM_KEY='%s'"):format(server:url(name), KEY))
  end
  t:equal({ (doctor({}, "good")), server:ask "counts".good }, { 0, nil })
  t:equal({ (doctor({ "--llm" }, "good")), server:ask "counts".good.requests }, { 0, 1 })
  local status, output = doctor({ "--llm" }, "unauthorized")
  local facts = host.json.decode(output).llm
  t:equal({ status, facts.answered }, { 1, false })
  t:ok(facts.failure:find("^auth: HTTP 401: .*%[key%]") and not leaks(output), output)
  server:close()
end)

-- ---- whole runs ---------------------------------------------------------------------------------

-- Seconds of a generation and of an attempt.
local BUDGET, TIMEOUT = 10, 0.5

-- A client that asks another URL before each generation, without waits between attempts.
local function client_of(urls)
  return function(_, hooks)
    local made = {}
    function made:describe() return { endpoint = "http://127.0.0.1", model = "m" } end
    function made:state() return {} end
    function made:restore() end
    function made:ask(messages, question)
      return client.new({ url = urls[question.generation], model = "m", timeout = TIMEOUT }, {
        environment = function(name) return name == "LIMAX_LLM_KEY" and KEY or nil end,
        record = hooks.record, wait = function() end,
      }):ask(messages, question)
    end
    return made
  end
end

suite:test("a run with a different fault in each generation", { limit = 300 }, function(t)
  local server, urls = faulty_server.open(t), {}
  local names = server:ask "names"
  for k, name in ipairs(names) do urls[k] = server:url(name) end
  local done = talker.run(t, { "llm", client = client_of(urls), budget = BUDGET },
    { generations = #names + 1 })
  local outcomes, attempts, sources = talker.of_kind(done, "outcome"), {}, {}
  t:equal({ #outcomes, #done.ledger }, { #names, #names + 1 })
  for _, line in ipairs(talker.of_kind(done, "attempt")) do
    attempts[line.generation] = (attempts[line.generation] or 0) + 1
  end
  for k, line in ipairs(outcomes) do
    t:equal({ line.generation, done.ledger[k + 1].source }, { k, line.source })
    t:ok(line.seconds < BUDGET + process.LATE, ("%s: it took %.1f s"):format(names[k],
      line.seconds))
    local noted, usable = 0, false
    for _, ask in ipairs(line.asks) do
      noted = noted + ask.attempts
      usable = usable or not ask.failure and #ask.problems == 0
    end
    t:equal({ names[k], noted }, { names[k], attempts[k] })
    t:ok((line.source == "model") == usable, names[k] .. ": " .. line.source)
    t:ok(usable or line.why and not line.why:find "%c", names[k])
    sources[line.source] = (sources[line.source] or 0) + 1
  end
  -- on a loaded machine good answers time out too
  t:ok(sources.model and sources.keep, "some answers should be usable, some not")
  t:ok(server:ask "counts".echo.keys > 0, "the server should see the key")
  server:close()
  local search = ("grep -rl %s %s"):format(KEY:match "%u+", process.quote(done.folder))
  t:equal(process.output(search), "")
  t:ok(not leaks(done.output), done.output)
  local again = talker.run(t, { "replay", run = done.folder }, { generations = #names + 1 })
  evolution.same_files(t, again.folder, done.folder, { "r01/metrics.jsonl", "r01/ledger.jsonl" })
end)

-- Its supervisor has a second for each generation.
local ASKING = 'generations = 21, repetitions = 3, supervisor = { "llm", budget = 1 }'

suite:test("a dead endpoint costs its budgets once, not in each repetition",
  { limit = 120 }, function(t)
    local server, folder = faulty_server.open(t), t:folder()
    evolution.script(folder .. "/dead.lua", ASKING)
    local function run(name, ...)
      local done = process.completes(t, folder, { "run", "dead.lua", "--out", name, "-q",
        "--device", "cpu", ... }, { before = ("export LIMAX_LLM_MODEL=m "
          .. "LIMAX_LLM_URL=http://127.0.0.1:%d;"):format(server.ports.refused) })
      -- printed once, not in each repetition
      t:equal(select(2, done.stderr:gsub("is not asked again", "")), 1, done.stderr)
      return #talker.of_kind(talker.read(folder .. "/" .. name), "attempt")
    end
    t:equal({ run("apart", "--apart"), run("together", "--together") }, { 3, 3 })
    evolution.same_files(t, folder .. "/together", folder .. "/apart", { "r01/metrics.jsonl" })
    server:close()
  end)

suite:test("without an endpoint no run begins", { limit = 30 }, function(t)
  local folder = t:folder()
  evolution.script(folder .. "/none.lua", ASKING)
  local done = process.ends(folder, { "run", "none.lua", "--out", "r" },
    { before = "unset LIMAX_LLM_URL;" })
  process.failed(t, done, 2, 'supervisor "llm": no endpoint of a language model is configured')
  t:equal(host.file.exists(folder .. "/r"), nil)
end)
