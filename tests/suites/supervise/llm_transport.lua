--- llm_transport.lua: the client of a language model against a server that misbehaves below JSON:
--- connections, TLS, proxies, bodies without an end, keys that come back. Waits between attempts
--- are noted and skipped.

local client = require "limax.supervise.llm.client"
local faulty_server = require "support.faulty_server"
local host = require "limax.host"
local played = require "support.played"
local process = require "support.process"
local proxies = require "support.proxies"

local suite = require("limax.test").suite "llm transport"

local play, play_all = played.once, played.all

suite:test("names, ports and connections that fail are retried", function(t)
  local server = faulty_server.open(t)
  local function port(number) return ("http://127.0.0.1:%d"):format(number) end
  -- a name too long for any resolver: nothing leaves the machine
  local result = proxies.with({}, function()
    return play(t, server, "no such name", { options = { allow_insecure = true },
      url = ("http://%s.invalid"):format(("x"):rep(64)) })
  end)
  t:equal({ result.class, result.requests, result.waits }, { "transport", 3, { 0.5, 1 } })
  result = play(t, server, "refused", { url = port(server.ports.refused) })
  t:equal({ result.class, result.requests, result.kind }, { "transport", 3, "connect" })
  -- a full queue: no connection is accepted
  result = play(t, server, "blackhole", { url = port(server.ports.blackhole),
    options = { budget = 1 } })
  t:equal({ result.class, result.requests, result.kind }, { "timeout", 1, "connect_timeout" })
  play_all(t, server, {
    { "reset", "transport", 3 }, { "reset_in_body", "transport", 3 },
    { "length_too_long", "transport", 3, "partial" }, { "broken_chunks", "transport", 3 },
    { "chunks_break_off", "transport", 3 }, { "no_http", "transport", 1 },
    { "length_too_short", "envelope", 1, nil, "not JSON" },
    { "redirect", "http", 1, nil, "a redirect, which is not followed" },
    { "proxy_page", "http", 3, nil, "HTTP 502" },
  })
  t:equal(server:counts().redirect_target, nil)
  server:close()
end)

suite:test("an answer that never ends is stopped by the deadline or by its size", function(t)
  local server = faulty_server.open(t)
  for _, name in ipairs { "silent", "slow_headers", "slow_body", "endless_events" } do
    local result = play(t, server, name, { options = { budget = 0.5 } })
    t:equal({ name, result.class, result.requests }, { name, "timeout", 1 })
    t:ok(result.took > 0.4, name)
  end
  local result = play(t, server, "silent", { options = { timeout = 0.3 } })
  t:equal({ result.class, result.requests, result.waits }, { "timeout", 2, { 0.5 } })
  play_all(t, server, {
    { "endless_headers", "transport", 1, nil, "64 KiB of headers" },
    { "endless_interim", "transport", 1, nil, "64 KiB of headers" },
    { "endless_body", "envelope", 1, "size", "answered more than 1 MiB" },
    { "gzip_bomb", "envelope", 1, "size", "answered more than 1 MiB" },
    { "gzip_wrong", "envelope", 1 }, { "gzip_good", "answer", 1 },
  })
  result = play(t, server, "endless_body")
  t:ok(result.records[1].raw_body_truncated and #result.records[1].raw_body <= 2 ^ 20)
  server:close()
end)

suite:test("without a valid certificate the key is not sent", function(t)
  local server = faulty_server.open(t, { certificates = true })
  local tls = server.ports.tls
  if not tls then t:skip(server.ports.tls_missing) end
  local function ask(name, ca_file)
    return play(t, server, name, { options = { ca_file = ca_file },
      url = ("https://127.0.0.1:%d/good"):format(tls[name] or server.ports.port) })
  end
  local ours = server.ports.ca_file
  t:equal(ask("good", ours).class, "answer")
  for name, ca_file in pairs { good = false, self_signed = ours, expired = ours,
    wrong_host = ours } do
    local result = ask(name, ca_file or nil)
    t:equal({ name, result.class, result.requests, result.kind },
      { name, "transport", 1, "certificate" })
  end
  -- a server without TLS
  local result = ask("plain", ours)
  t:equal({ result.class, result.requests, result.kind }, { "transport", 3, "tls" })
  t:equal(ask("good", "/nonexistent.pem").class, "transport")
  t:equal(server:counts().good, { requests = 1, keys = 1 })
  server:close()
end)

suite:test("a proxy is asked where the environment names one, IPv4 where IPv6 fails", function(t)
  local server = faulty_server.open(t)
  local result = proxies.with({ http_proxy = server.base }, function()
    return play(t, server, "good", { options = { allow_insecure = true },
      url = "http://model.invalid/good" })
  end)
  t:equal({ result.class, server:counts().good.requests }, { "answer", 1 })
  if server.ports.ipv6 then
    result = play(t, server, "good", { url = ("http://localhost:%d/good"):format(
      server.ports.port) })
    t:equal({ result.class, result.requests }, { "answer", 1 })
  end
  server:close()
end)

suite:test("the wait that a server asks for is kept", function(t)
  local server = faulty_server.open(t)
  local result = play(t, server, "retry_after", { real = true })
  t:equal({ result.class, result.requests }, { "answer", 2 })
  t:ok(result.took >= 0.3)
  server:close()
end)

suite:test("a key that a server echoes in any form is taken out everywhere", function(t)
  local server = faulty_server.open(t)
  local result = play(t, server, "echo")
  t:ok(result.answer.content:find("[key]", 1, true), result.answer.content)
  t:equal({ result.answer.id, result.answer.model, result.answer.finish_reason,
    result.records[1].x_request_id, result.records[1].retry_after },
    { "[key]", "[key]", "[key]", "[key]", "[key]" })
  result = play(t, server, "echo_reset")
  t:equal({ result.class, result.records[1].raw_body }, { "transport", "[key]" })
  result = play(t, server, "unauthorized")
  t:equal(result.records[1].x_request_id, "req-[key]")
  t:equal(server:counts().echo, { requests = 1, keys = 1 })
  server:close()
end)

-- Asks without an end.
local ASK = [[
local client = require "limax.supervise.llm.client"
local made = assert(client.new({ model = "m", url = os.getenv "LIMAX_TEST_URL" }, {
  record = function(record) io.stderr:write("recorded ", tostring(record.http_status), "\n") end,
}))
io.stderr:write "ready\n"
made:ask { { role = "user", content = "json" } }
print "not reached"
]]

suite:test("Ctrl-C ends a wait for an answer, and a wait between attempts", function(t)
  local server = faulty_server.open(t)
  for name, ready in pairs { silent = "ready", retry_after_minute = "recorded 503" } do
    local folder = t:folder()
    process.write(folder .. "/ask.lua", ASK)
    local child = process.start(folder, { "ask.lua" },
      ("LIMAX_LLM_KEY=any LIMAX_TEST_URL=%s"):format(server:url(name)))
    child:wait_for(ready)
    child:signal "INT"
    local status, output, seconds = child:finish()
    t:equal(status, 130)
    t:ok(output:find("limax: interrupted", 1, true) and not output:find("not reached", 1, true),
      output)
    t:ok(seconds < process.LATE, ("%s: it took %.1f s"):format(name, seconds))
  end
  server:close()
end)

suite:test("limax doctor describes the endpoint and asks it only with --llm", function(t)
  local server = faulty_server.open(t)
  local function doctor(words, name)
    return process.run(t:folder(), { "doctor", unpack(words) }, name and
      ("LIMAX_LLM_URL=%s LIMAX_LLM_MODEL=m LIMAX_LLM_KEY='%s'"):format(server:url(name),
        played.KEY) or "-u LIMAX_LLM_URL")
  end
  local status, output = doctor({}, "good")
  t:equal({ status, server:counts().good }, { 0, nil })
  t:ok(output:find(server:url "good" .. "/chat/completions, model m, key from LIMAX_LLM_KEY; not"
    .. " asked", 1, true), output)
  status, output = doctor({ "--llm" }, "good")
  t:equal({ status, server:counts().good.requests }, { 0, 1 })
  t:ok(output:find("; answered in %d+%.%d s, form json_schema, %d+ %+ 8 tokens"), output)
  t:ok(not played.leaks(output), output)
  status, output = doctor({ "--llm", "--json" }, "unauthorized")
  local facts = host.json.decode(output).llm
  t:equal({ status, facts.answered, facts.failure }, { 1, false, "auth: HTTP 401: Incorrect API key"
    .. " provided: [key]. You can find yours at /account; is the key right?" })
  status, output = doctor({ "--llm" }, nil)
  t:ok(status == 1 and output:find("set LIMAX_LLM_URL", 1, true), output)
  server:close()
end)

suite:test("a real endpoint answers, where LIMAX_LLM_URL names one", { tags = { "endpoint" } },
  function(t)
    if not os.getenv "LIMAX_LLM_URL" then t:skip "LIMAX_LLM_URL is not set" end
    local made = t:ok(client.new {})
    local answer, failure = made:ask({ { role = "user",
      content = 'Answer with this JSON object and nothing else: {"mutation_rate": 0.1}' } })
    t:ok(answer, failure and failure.message)
    t:ok((answer.content .. (answer.reasoning or "")):find("mutation_rate", 1, true),
      answer.content)
    t:note(("%s answered in %.1f s"):format(made:describe().endpoint, answer.seconds))
  end)
