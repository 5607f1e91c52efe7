--- http.lua: host.http against the faulty server of tests/llm on the loopback interface.

local faulty_server = require "support.faulty_server"
local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "http"

-- Sends a request from a process with these variables: the answer, or the problem.
local function ask(t, url, environment)
  local status, output = process.script(t:folder(), ([[
local host = require "limax.host"
local answer, _, problem = host.http { url = %q, allow_insecure = true }
print(host.json.encode(answer or problem))
]]):format(url), environment)
  t:equal(status, 0)
  return t:ok(host.json.decode(output), output)
end

suite:test("a request is sent unchanged, and its answer is complete", function(t)
  local server, body = faulty_server.open(t), '{"a":"é\\u0000"}'
  local answer = host.http { url = server:url "mirror", body = body,
    headers = { ["Content-Type"] = "application/json", Authorization = "Bearer key" } }
  t:equal({ answer.status, answer.headers }, { 201, { connection = "close", ["x-two"] = "a, b",
    ["content-type"] = "application/json", ["content-length"] = tostring(#answer.body) } })
  local came = host.json.decode(answer.body)
  t:equal({ came.line, came.body }, { "POST /mirror/v1 HTTP/1.1", body })
  t:equal({ came.headers["Content-Type"], came.headers.Authorization,
    came.headers["Content-Length"] }, { "application/json", "Bearer key", tostring(#body) })

  came = host.json.decode(host.http { url = server:url "mirror" }.body)
  t:equal(came.line, "GET /mirror/v1 HTTP/1.1")
  answer = host.http { url = server:url "redirect" }
  t:equal({ answer.status, answer.body }, { 307, "" })
  -- nothing listens on port 9
  answer = ask(t, server:url "mirror", "http_proxy=http://127.0.0.1:9 all_proxy=http://127.0.0.1:9")
  t:equal(answer.status, 201, "requests to this machine never use a proxy")
  server:close()
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
  t:equal(ask(t, "http://" .. name, "http_proxy= all_proxy= ALL_PROXY=").kind, "resolve")
  local _, _, problem = host.http { url = "ftp://" .. name, allow_insecure = true }
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
