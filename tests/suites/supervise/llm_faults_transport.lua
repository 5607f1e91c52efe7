--- llm_faults_transport.lua: the client of a language model against a server that misbehaves below
--- HTTP, fault by fault (1 to 16): the class of the outcome, the number of requests, the deadline,
--- a record for each attempt, and a key that shows up nowhere. Waits between retries are noted, not
--- waited for, except where the wait is what is tested.
---
--- What a process alone cannot stage: a network that loses packets (a full queue on the loopback
--- interface stands for it), a resolver that answers wrongly or late (a name that no resolver can
--- be asked for stands for one that fails), a clock that jumps (waits are counted on a clock that
--- never steps back: see llm_client.lua).

local faulty_server = require "support.faulty_server"
local played = require "support.played"
local process = require "support.process"
local proxies = require "support.proxies"

local suite = require("limax.test").suite "llm faults transport"

local GOOD, LATE = played.GOOD, played.LATE
local play, play_all = played.once, played.all
local USUAL = { 0.5, 1 } -- s between three attempts

suite:test("1 to 5, 9: names, ports and connections that fail are tried thrice", function(t)
  local server = faulty_server.open(t)
  local function port(number) return ("http://127.0.0.1:%d"):format(number) end
  -- a name that no resolver can even ask for: nothing leaves the machine
  local came = proxies.with({}, function()
    return play(t, server, "1 no such name", { options = { allow_insecure = true },
      url = ("http://%s.invalid"):format(("x"):rep(64)) })
  end)
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
  -- a name that only a proxy is asked for
  local function through(name)
    return proxies.with({ http_proxy = server.base }, function()
      return play(t, server, name, { options = { allow_insecure = true },
        url = "http://model.invalid/" .. name })
    end)
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
local client = require "limax.supervise.llm.client"
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
    local child = process.start(folder, { "ask.lua" },
      ("LIMAX_LLM_KEY=any LIMAX_TEST_URL=%s"):format(server:url(name)))
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

suite:test("the server ends with its standard input, and so with its parent", function(t)
  local server = faulty_server.open(t)
  t:equal(play(t, server, "good").class, "answer")
  server:close()
  t:equal(play(t, server, "good").records[1].curl_kind, "connect")
end)
