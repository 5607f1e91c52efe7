--- llm_sandbox.lua: the process in which parsers of a model's text run: what it offers, and that a
--- parser can neither leave it, nor run for ever, nor take the machine's memory.

local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "llm sandbox"

-- Runs the body of a parser function over a text.
local function run(body, text, seconds)
  return host.sandbox({ source = "return function(text, limits) " .. body .. "\nend",
    name = "=probe.lua", text = text or "", limits = { { field = "mutation_rate" } } }, seconds)
end

suite:test("takes a text and returns plain values", function(t)
  local ok, value, message, note = run([[
    return { upper = text:upper(), first = limits[1].field, list = { 1, 2 }, yes = true,
      sum = math.floor(2.5) + #table.concat({ "a", "b" }), null = json.null,
      decoded = json.decode('{"a": [0.5]}').a[1], back = json.encode { 1 } }, "why", "stage"]],
    "hello")
  t:equal({ ok, message, note }, { true, "why", "stage" })
  value.null = value.null == host.json.null
  t:equal(value, { upper = "HELLO", first = "mutation_rate", list = { 1, 2 }, yes = true, sum = 4,
    null = true, decoded = 0.5, back = "[1]" })
  t:equal({ run "return nil, 'nothing here'" }, { true, nil, "nothing here", nil })
  local long = ("0123456789"):rep(1e5)
  t:equal({ run("return { #text, text }", long) }, { true, { 1e6, long } })
end)

suite:test("a parser finds string, table, math, json and nothing that leads out", function(t)
  local names = {}
  for name in ("io os ffi jit bit require package module debug load loadstring loadfile dofile"
    .. " getfenv setfenv getmetatable setmetatable newproxy rawget rawset coroutine collectgarbage"
    .. " _G print limax host arg"):gmatch "%S+" do
    names[#names + 1] = ("%s = %s ~= nil"):format(name, name)
  end
  local ok, found = run(("local list = { %s } for name, there in pairs(list) do"
    .. " if there then return { name } end end return {}"):format(table.concat(names, ", ")))
  t:equal({ ok, found }, { true, {} })
  -- bytecode could do anything
  local message
  ok, message = host.sandbox { source = string.dump(function() return print end), name = "=b",
    text = "", limits = {} }
  t:equal(ok, false)
  t:ok(message:find("bytecode", 1, true) or message:find("mode", 1, true), message)
end)

-- Writes the system's status of our child process that runs a parser.
local LOOK = [[
tries=0
while [ $tries -lt 500 ]; do
  for child in $(cat /proc/PID/task/PID/children); do
    if tr '\0' ' ' </proc/$child/cmdline | grep -q -- --parser-process; then
      [ "$(ls /proc/$child/fd | wc -l)" = 3 ] || continue
      grep -q '^Max processes  *0 ' /proc/$child/limits || continue # not limited yet
      cat /proc/$child/limits; echo "environment: $(tr '\0' ' ' </proc/$child/environ)"; exit
    fi
  done
  tries=$((tries + 1)); sleep 0.01
done
]]

suite:test("its process has no environment, no files and limits of the system", function(t)
  local own = io.open("/proc/self/stat"):read "*n"
  local script = t:folder() .. "/look.sh"
  assert(host.file.write_atomic(script, (LOOK:gsub("PID", own))))
  local pipe = io.popen("sh " .. process.quote(script))
  t:equal({ run("while true do end", "", 3) }, { false, "stopped after 3.00 s" })
  local seen = pipe:read "*a"
  pipe:close()
  for name, most in pairs { ["Max open files"] = 0, ["Max file size"] = 0, ["Max processes"] = 0,
    ["Max core file size"] = 0, ["Max cpu time"] = 6 } do
    t:equal({ name, tonumber(seen:match(name .. "%s+(%d+)")) }, { name, most })
  end
  t:ok(tonumber(seen:match "Max address space%s+(%d+)"), seen)
  t:ok(seen:find "environment: \n", seen)
end)

suite:test("a parser that does not end is killed", { limit = 60 }, function(t)
  for _, body in ipairs {
    "while true do pcall(function() while true do end end) end",
    -- one call into the library, in which no hook would look
    "return ('a'):rep(60):find(('a-'):rep(30) .. 'b')", "table.insert({}, -2 ^ 31, 1)",
  } do
    local began = host.clock()
    local ok, message = run(body, "", 0.2)
    t:equal({ body, ok, message }, { body, false, "stopped after 0.20 s" })
    t:ok(host.clock() - began < 0.2 + process.LATE, body)
  end
end)

suite:test("a parser that takes too much memory fails", { limit = 60 }, function(t)
  for _, body in ipairs {
    "local s = 'ab' while true do s = s .. s end",
    "return ('x'):rep(1e9)", "return { ('x'):rep(3e7) }",
  } do
    local ok, message = run(body)
    t:ok(not ok and (message:find("more than 64 MB", 1, true)
      or message:find("stopped after", 1, true)), ("%s: %s"):format(body, tostring(message)))
  end
end)

suite:test("errors and values that JSON cannot hold come back as a message", function(t)
  for body, expected in pairs {
    ["return function() end"] = "cannot write JSON: a function",
    ["return { 0 / 0 }"] = "cannot write JSON: NaN", ["return { a = 1 / 0 }"] = "infinity",
    ["local t = {} t.t = t return t"] = "cannot write JSON", ["return { '\\255' }"] = "UTF-8",
    ["error '\\255'"] = "UTF-8", ["error {}"] = "an error that is a table",
    ["return nowhere.field"] = "probe.lua:1", ["this is not Lua"] = "probe.lua:1",
  } do
    local ok, message = run(body)
    t:ok(not ok and message:find(expected, 1, true), ("%s: %s"):format(body, tostring(message)))
  end
  local ok, message = host.sandbox { source = "return 7", name = "=n", text = "", limits = {} }
  t:equal({ ok, message }, { false, "expected a file that returns a function, got number" })
end)
