--- http.lua: host.http against a server of this process on the loopback interface; nothing leaves
--- the machine.

local host = require "limax.host"
local process = require "support.process"
local server = require "support.server"

local suite = require("limax.test").suite "http"

local ANSWER = "HTTP/1.1 %s\r\nContent-Length: %d\r\nX-Two: a\r\nx-two: b\r\n"
  .. "Connection: close\r\n\r\n%s"

-- Asks as a second process, prints what came, and leaves the answering to this one.
local ASK = [[
local host = require "limax.host"
local request = host.json.decode(arg[1])
local answer, message = host.http(request)
print(host.json.encode(answer or { failure = message }))
]]

local function ask(t, request, bytes, environment)
  local folder, here = t:folder(), server.open()
  process.write(folder .. "/ask.lua", ASK)
  request.url = request.url or here.url .. "v1"
  local child = process.start(folder, { "ask.lua", host.json.encode(request) }, environment)
  local came = bytes and here:answer(bytes)
  local status, output, seconds = child:finish()
  here:close()
  t:equal(status, 0)
  return t:ok(host.json.decode(output), output), came, seconds
end

suite:test("a request is sent as it was given, and its answer comes back whole", function(t)
  local body = '{"a":"é\\u0000"}'
  local answer, came = ask(t, { body = body, headers = { ["Content-Type"] = "application/json",
    Authorization = "Bearer key" } }, ANSWER:format("201 Created", 4, "done"))
  t:equal(answer, { status = 201, body = "done", headers = { connection = "close",
    ["content-length"] = "4", ["x-two"] = "a, b" } })
  t:ok(came:find("POST /v1 HTTP/1.1\r\n", 1, true) == 1, came)
  t:ok(came:find("\r\nContent-Type: application/json\r\n", 1, true), came)
  t:ok(came:find("\r\nAuthorization: Bearer key\r\n", 1, true), came)
  t:ok(came:find("\r\nContent-Length: " .. #body .. "\r\n", 1, true), came)

  answer, came = ask(t, {}, ANSWER:format("503 Busy", 0, ""))
  t:equal({ answer.status, answer.body }, { 503, "" })
  t:ok(came:find("GET /v1 HTTP/1.1\r\n", 1, true) == 1, came)
end)

suite:test("a redirect is an answer, not a journey", function(t)
  local answer = ask(t, {}, "HTTP/1.1 302 Found\r\nLocation: https://example.org/\r\n"
    .. "Content-Length: 0\r\nConnection: close\r\n\r\n")
  t:equal({ answer.status, answer.headers.location }, { 302, "https://example.org/" })
end)

suite:test("this machine is never asked through a proxy", function(t)
  -- nothing listens on port 9
  local answer = ask(t, {}, ANSWER:format("200 OK", 2, "me"),
    "http_proxy=http://127.0.0.1:9 all_proxy=http://127.0.0.1:9")
  t:equal(answer.body, "me")
end)

suite:test("a server that never answers costs the timeout and no more", function(t)
  local answer, _, seconds = ask(t, { timeout = 0.5 })
  t:ok(answer.failure:find("did not answer within 0.5 s", 1, true), answer.failure)
  t:ok(seconds < 2.5)
end)

suite:test("an answer is capped at 16 MiB", function(t)
  local answer = ask(t, {}, ANSWER:format("200 OK", 2 ^ 24 + 1, ("x"):rep(2 ^ 24 + 1)))
  t:ok(answer.failure:find("answered more than 16 MiB", 1, true), answer.failure)
end)

suite:test("an answer that breaks off is a failure", function(t)
  local answer = ask(t, {}, "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nhalf")
  t:ok(answer.failure:find "^http://127%.0%.0%.1:%d+: ", answer.failure)
end)

suite:test("only https, or http to this machine, may be asked", function(t)
  for _, url in ipairs { "http://example.org/", "ftp://127.0.0.1/", "file:///etc/hostname",
    "http://127.0.0.1.example.org/", "http://localhost.example.org/", "http://10.0.0.1/" } do
    local answer, message = host.http { url = url }
    t:equal(answer, nil)
    t:ok(message:find("only https, or http to this machine, may be asked", 1, true), message)
  end
  local answer, message = host.http { url = "http://127.0.0.1:1/?key=secret" }
  t:equal(answer, nil)
  t:ok(not message:find("secret", 1, true), message)
end)

suite:test("misuse raises", function(t)
  t:raises("the field url is missing", function() host.http {} end)
  t:raises("unknown field 'tmeout'", function() host.http { url = "x", tmeout = 1 } end)
  t:raises("timeout must be a number", function() host.http { url = "x", timeout = "1" } end)
  t:raises("must not hold a line break", function()
    host.http { url = "http://127.0.0.1:1/", headers = { a = "x\r\nHost: y" } }
  end)
end)
