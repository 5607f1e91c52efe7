--- http.lua: host.http against a server in this process on the loopback interface.

local host = require "limax.host"
local process = require "support.process"
local proxies = require "support.proxies"
local server = require "support.server"

local suite = require("limax.test").suite "http"

local ANSWER = "HTTP/1.1 %s\r\nContent-Length: %d\r\nX-Two: a\r\nx-two: b\r\n"
  .. "Connection: close\r\n\r\n%s"

-- Sends a request from a second process; this one answers.
local ASK = [[
local host = require "limax.host"
local request = host.json.decode(arg[1])
local answer, _, problem = host.http(request)
print(host.json.encode(answer or problem))
]]

local function ask(t, request, bytes, environment)
  local folder, here = t:folder(), server.open()
  process.write(folder .. "/ask.lua", ASK)
  request.url = request.url or here.url .. "v1"
  local child = process.start(folder, { "ask.lua", host.json.encode(request) }, environment)
  local came = here:answer(bytes)
  local status, output = child:finish()
  here:close()
  t:equal(status, 0)
  return t:ok(host.json.decode(output), output), came
end

suite:test("a request is sent unchanged, and its answer is complete", function(t)
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

suite:test("requests to this machine never use a proxy", function(t)
  -- nothing listens on port 9
  local answer = ask(t, {}, ANSWER:format("200 OK", 2, "me"),
    "http_proxy=http://127.0.0.1:9 all_proxy=http://127.0.0.1:9")
  t:equal(answer.body, "me")
end)

suite:test("only https, or http to this machine, and no credentials in a URL", function(t)
  for _, url in ipairs { "http://example.org/", "ftp://127.0.0.1/", "file:///etc/hostname",
    "http://127.0.0.1.example.org/", "http://localhost.example.org/", "http://10.0.0.1/" } do
    local answer, message, problem = host.http { url = url }
    t:equal({ answer, problem.kind }, { nil, "url" })
    t:ok(message:find("only https, or http to this machine, is allowed", 1, true), message)
  end
  local _, message = host.http { url = "http://127.0.0.1:1/?key=secret" }
  t:ok(not message:find("secret", 1, true), message)
  _, message = host.http { url = "http://me:secret@127.0.0.1:1/" }
  t:equal(message, "a URL with credentials is not allowed: http://127.0.0.1:1")
  -- a name too long for any resolver: nothing leaves the machine
  local name = ("x"):rep(64) .. ".invalid"
  local _, _, problem = proxies.with({}, function()
    return host.http { url = "http://" .. name, allow_insecure = true }
  end)
  t:equal(problem.kind, "resolve")
  _, _, problem = host.http { url = "ftp://" .. name, allow_insecure = true }
  t:equal(problem.kind, "url")
end)

suite:test("a URL is read as libcurl reads it", function(t)
  t:equal(host.url "https://example.org:8443/a/b?c=d#e", { scheme = "https", host = "example.org",
    port = "8443", path = "/a/b", query = "c=d", fragment = "e", loopback = false,
    credentials = false })
  t:equal(host.url "http://u:p@[::1]", { scheme = "http", host = "[::1]", path = "/",
    loopback = true, credentials = true })
  for url, loopback in pairs { ["http://127.9.9.9"] = true, ["http://localhost"] = true,
    ["http://127.1"] = true, ["http://0x7f.1"] = true, ["http://2130706433"] = true,
    ["http://128.0.0.1"] = false, ["http://localhost.example.org"] = false } do
    t:ok(host.url(url).loopback == loopback, url)
  end
  for _, url in ipairs { "", "example.org", "http://", "http://a b/", "https://x\0y" } do
    local parts, message = host.url(url)
    t:equal(parts, nil)
    t:ok(message:find "URL", message)
  end
end)

suite:test("a wait lasts for its time", function(t)
  local start = host.clock()
  host.wait(0)
  host.wait(0.12)
  t:ok(host.clock() - start >= 0.12)
  t:raises("expected 0 to 86400 seconds", function() host.wait(-1) end)
  t:raises("expected 0 to 86400 seconds", function() host.wait(0 / 0) end)
end)
