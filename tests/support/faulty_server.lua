--- faulty_server.lua: the faulty server of tests/llm as a child process. It ends with this process,
--- which holds its standard input.

local host = require "limax.host"
local process = require "support.process"

local faulty_server = {}

local START = 120 -- s, for Python and perhaps openssl

local methods = {}
local class = { __index = methods }

--- Starts the server; skips the test without Python.
---@param tls? boolean makes certificates and speaks TLS too
---@return table server with .ports: see faulty_server.py
function faulty_server.open(t, tls)
  if os.execute "command -v python3 >/dev/null 2>&1" ~= 0 then t:skip "python3 is not installed" end
  local folder = t:folder()
  local script = host.home .. "/tests/llm/faulty_server.py"
  if host.file.exists(script) ~= "file" then t:skip "tests/llm is not installed" end
  local pipe = assert(io.popen(("exec python3 -B %s %s >%s 2>%s"):format(process.quote(script),
    tls and process.quote(folder) or "", process.quote(folder .. "/ports"),
    process.quote(folder .. "/log")), "w"))
  local start = host.clock()
  while not process.read(folder .. "/ports"):find "\n" do
    t:ok(host.clock() - start < START, process.read(folder .. "/log"))
    host.wait(0.02)
  end
  local ports = host.json.decode(process.read(folder .. "/ports"))
  return setmetatable({ pipe = pipe, ports = ports,
    base = ("http://127.0.0.1:%d/"):format(ports.port) }, class)
end

--- The base URL of a scenario.
function methods:url(name) return self.base .. name .. "/v1" end

--- Asks the server for "counts", of the requests of each scenario, { name = { requests = , keys = }
--- }, or for "names", a list.
---@param what "counts"|"names"
function methods:ask(what)
  return host.json.decode(assert(host.http { url = self.base .. "_" .. what }).body)
end

function methods:close() self.pipe:close() end

return faulty_server
