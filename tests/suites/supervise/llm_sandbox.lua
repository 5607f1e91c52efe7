--- llm_sandbox.lua: the Lua state in which parsers of a model's text run: what it offers, and that
--- nothing in it gets out, goes on for ever, or eats the machine.

local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "llm sandbox"

-- Runs a function's body over a text.
local function run(body, text, options)
  local request = { source = "return function(text, limits) " .. body .. "\nend",
    name = "=probe.lua", text = text or "", limits = '[{"field":"mutation_rate"}]' }
  for name, value in pairs(options or {}) do request[name] = value end
  return host.sandbox(request)
end

suite:test("text in, plain values out", function(t)
  local ok, value, message, note = run([[
    return { upper = text:upper(), first = limits[1].field, list = { 1, 2 }, yes = true,
      sum = math.floor(2.5) + #table.concat({ "a", "b" }), null = json.null,
      decoded = json.decode('{"a": [0.5]}').a[1], back = json.encode { 1 } }, "said", "stage"]],
    "hello")
  t:equal({ ok, message, note }, { true, "said", "stage" })
  value.null = value.null == host.json.null
  t:equal(value, { upper = "HELLO", first = "mutation_rate", list = { 1, 2 }, yes = true, sum = 4,
    null = true, decoded = 0.5, back = "[1]" })
  t:equal({ run "return nil, 'nothing here'" }, { true, nil, "nothing here", nil })
  -- each text has a state of its own
  run "string.upper = nil; leaked = 1"
  t:equal({ run "return { text:upper(), leaked == nil }" }, { true, { "", true } })
end)

-- Each tries to get something that a parser has no use for; it returns true where it could.
local ESCAPES = {
  ["io"] = "return io ~= nil",
  ["os"] = "return os ~= nil",
  ["ffi"] = "return ffi ~= nil or jit ~= nil or bit ~= nil",
  ["require"] = "return require ~= nil or package ~= nil or module ~= nil",
  ["debug"] = "return debug ~= nil",
  ["load"] = "return load ~= nil or loadstring ~= nil or loadfile ~= nil or dofile ~= nil",
  ["getfenv"] = "return getfenv ~= nil or setfenv ~= nil",
  ["metatables"] = "return getmetatable ~= nil or setmetatable ~= nil or newproxy ~= nil",
  ["raw access"] = "return rawget ~= nil or rawset ~= nil or rawequal ~= nil",
  ["coroutines"] = "return coroutine ~= nil",
  ["collector"] = "return collectgarbage ~= nil or gcinfo ~= nil",
  ["the global table"] = "return _G ~= nil",
  ["printing"] = "return print ~= nil",
  ["bytecode"] = "return string.dump ~= nil",
  ["the string metatable"] = "return ('').dump ~= nil or text.dump ~= nil",
  ["random numbers"] = "return math.random ~= nil or math.randomseed ~= nil",
  ["addresses"] = "return tostring({}):find '%d' ~= nil"
    .. " or string.format('%s', pairs):find '%d' ~= nil",
  ["addresses by %p"] = "return (pcall(string.format, '%10p', {}))",
  ["the main state's values"] = "return limax ~= nil or host ~= nil or arg ~= nil",
  ["what the main state's json can"] = "return json.file ~= nil or json.sandbox ~= nil",
  ["null's metatable"] = "return (pcall(function() return json.null.x end))",
}

suite:test("nothing that leads out is there", function(t)
  local names = {}
  for name, body in pairs(ESCAPES) do
    local ok, reached = run(body)
    t:ok(ok, ("%s: %s"):format(name, tostring(reached)))
    t:ok(reached == false, name .. " is within reach")
    names[#names + 1] = name
  end
  t:ok(#names >= 20)
  -- text chunks only: bytecode could do anything
  local ok, message = host.sandbox { source = string.dump(function() return print end),
    name = "=b", text = "", limits = "[]" }
  t:equal(ok, false)
  t:ok(message:find("bytecode", 1, true) or message:find("mode", 1, true), message)
end)

-- Each would never end; by what it is stopped.
local ENDLESS = {
  ["a loop"] = { "while true do end", "million instructions" },
  ["a loop that catches"] = { "while true do pcall(function() while true do end end) end",
    "million instructions" },
  ["a recursion that catches"] = {
    "local function f() pcall(f) while true do end end f()", "recursion has no end" },
  ["a recursion that never gives up"] = {
    "local function f() pcall(f) return f() end return f()", "recursion has no end" },
  ["a tail call"] = { "local function f() return f() end return f()", "million instructions" },
  ["iterating for ever"] = { "for _ in function() return 1 end do end", "million instructions" },
  ["a pattern"] = { "return ('a'):rep(60):find(('a-'):rep(30) .. 'b')", "stopped after 0.20 s" },
  ["a pattern that catches"] = {
    "while true do pcall(string.find, ('a'):rep(60), ('a-'):rep(30) .. 'b') end",
    "stopped after 0.20 s" },
  ["a pattern over a long text"] = {
    "local s = ('a'):rep(1e6) return s:match '.-.-b'", "stopped after 0.20 s" },
  ["gsub that grows"] = { "for i = 1, 1e9 do (('a'):rep(1e5)):gsub('a', 'aaaaaaaa') end",
    "stopped after 0.20 s" },
}

suite:test("what never ends is stopped", { limit = 300 }, function(t)
  for name, case in pairs(ENDLESS) do
    local by_time = case[2]:find("0.20 s", 1, true)
    local began = host.clock()
    local ok, message = run(case[1], "", { seconds = by_time and 0.2 or 5 })
    t:equal(ok, false)
    -- on a slow or busy machine the clock may come before the count
    t:ok(message:find(case[2], 1, true) or message:find("stopped after ", 1, true),
      name .. ": " .. message)
    t:ok(host.clock() - began < (by_time and 0.2 or 5) + process.LATE, name)
  end
end)

-- Each takes memory without end.
local HUNGRY = {
  ["a table of tables"] = "local t = {} for i = 1, 1e9 do t[i] = { i } end",
  ["a doubled string"] = "local s = 'ab' while true do s = s .. s end",
  ["strings that stay"] = "local t = {} for i = 1, 1e9 do t[i] = ('x'):rep(1e5) .. i end",
  ["concat"] = "local t = {} for i = 1, 2e5 do t[i] = ('x'):rep(1000) end return table.concat(t)",
  ["closures"] = "local t = {} for i = 1, 1e9 do t[i] = function() return i end end",
  ["catching"] = "while true do pcall(function() local t = {} for i = 1, 1e9 do t[i] = {} end end)"
    .. " end",
}

suite:test("memory has an end, and the process keeps none of it", { limit = 60 }, function(t)
  for name, body in pairs(HUNGRY) do
    local ok, message = run(body, "", { seconds = 2 })
    t:equal(ok, false)
    t:ok(message:find("more than 64 MB", 1, true) or message:find("stopped after", 1, true),
      name .. ": " .. message)
  end
  local function resident()
    return tonumber(io.open("/proc/self/status"):read("*a"):match "VmRSS:%s*(%d+)")
  end
  local before = resident()
  for _ = 1, 20 do run(HUNGRY["a table of tables"], "", { bytes = 16 * 2 ^ 20 }) end
  t:ok(resident() - before < 32 * 1024, "kB more: " .. resident() - before)
  for _, body in ipairs { "return ('x'):rep(1e9)", "return ('x'):rep(2 ^ 60)",
    "return ('x'):rep(1e6, ('y'):rep(1e6))",
    "return (('x'):rep(1e6)):gsub('x', ('y'):rep(1e4))" } do
    local ok, message = run(body)
    t:ok(not ok and message:find("longer than", 1, true), body .. ": " .. tostring(message))
  end
end)

suite:test("what is no plain value, or fails, is told", function(t)
  for body, expected in pairs {
    ["return function() end"] = "cannot write JSON: a function",
    ["return { 0 / 0 }"] = "cannot write JSON: NaN",
    ["return { a = 1 / 0 }"] = "infinity",
    ["local t = {} t.t = t return t"] = "cannot write JSON",
    ["return { '\\255' }"] = "UTF-8",
    ["error 'my own words'"] = "my own words",
    ["error {}"] = "an error that is a table",
    ["return nowhere.field"] = "probe.lua:1",
    ["this is no Lua"] = "probe.lua:1",
    ["return text:find '['"] = "malformed pattern",
    ["return text:find '%'"] = "malformed pattern",
    ["return ('a'):find(('('):rep(40))"] = "too many captures",
    ["return ('a'):gsub('a', '%2')"] = "invalid capture index",
    ["return ('a'):rep(1000):find(('a?'):rep(1000))"] = "pattern too complex",
  } do
    local ok, message = run(body)
    t:equal(ok, false)
    t:ok(message:find(expected, 1, true), ("%s: %s"):format(body, message))
  end
  local ok, message = host.sandbox { source = "return 7", name = "=n", text = "", limits = "[]" }
  t:equal(ok, false)
  t:ok(message:find("expected a file that returns a function, got number", 1, true), message)
end)

suite:test("patterns find what the standard library finds", function(t)
  -- texts and patterns from a small alphabet, by a generator of its own
  local state = 12345
  local function below(n)
    state = (state * 1103515245 + 12345) % 2147483648
    return math.floor(state / 65536) % n
  end
  local pieces = { "a", "b", ".", "%a", "%d", "[ab]", "[^a]", "[a-c]", "[%d_]", "%W", "%(", "[]]",
    "[^]%s]", "%bxy", "%f[%w]", "%S", "%%" }
  local signs = { "", "", "", "*", "+", "-", "?" }
  local letters = { "a", "b", "c", "1", "_", " ", "x", "y", "]", "(", "%" }
  local function pattern()
    local parts, open = {}, 0
    if below(4) == 0 then parts[1] = "^" end
    for _ = 1, 1 + below(4) do
      local capture = below(4) == 0
      if capture then parts[#parts + 1], open = "(", open + 1 end
      local piece = pieces[1 + below(#pieces)]
      local long = piece:find "^%%[bf]"
      parts[#parts + 1] = piece .. (long and "" or signs[1 + below(#signs)])
      if capture then parts[#parts + 1] = ")" end
    end
    if open > 0 and below(6) == 0 then parts[#parts + 1] = "%1" end
    if below(6) == 0 then parts[#parts + 1] = "()" end
    if below(5) == 0 then parts[#parts + 1] = "$" end
    return table.concat(parts)
  end
  local cases, expected = {}, {}
  for k = 1, 3000 do
    local text = {}
    for i = 1, below(12) do text[i] = letters[1 + below(#letters)] end
    local case = { text = table.concat(text), pattern = pattern(), from = below(6) - 2 }
    cases[k] = case
    local function list(...)
      local made = {}
      for i = 1, select("#", ...) do made[i] = tostring((select(i, ...))) end
      return table.concat(made, "|")
    end
    local words = {}
    if case.pattern:sub(1, 1) ~= "^" then
      for word in case.text:gmatch(case.pattern) do words[#words + 1] = tostring(word) end
    end
    expected[k] = { list(case.text:find(case.pattern, case.from)),
      list(case.text:match(case.pattern, case.from)),
      list(case.text:gsub(case.pattern, "<%0>")),
      list(case.text:gsub(case.pattern, function(first) return first ~= "a" and "-" end, 2)),
      table.concat(words, "|") }
  end
  local ok, got = run([[
    local function list(...)
      local made = {}
      for i = 1, select("#", ...) do made[i] = tostring((select(i, ...))) end
      return table.concat(made, "|")
    end
    local results = {}
    for k, case in ipairs(json.decode(text)) do
      local words = {}
      if case.pattern:sub(1, 1) ~= "^" then
        for word in case.text:gmatch(case.pattern) do words[#words + 1] = tostring(word) end
      end
      results[k] = { list(case.text:find(case.pattern, case.from)),
        list(case.text:match(case.pattern, case.from)),
        list(case.text:gsub(case.pattern, "<%0>")),
        list(case.text:gsub(case.pattern, function(first) return first ~= "a" and "-" end, 2)),
        table.concat(words, "|") }
    end
    return results]], host.json.encode(cases))
  t:ok(ok, tostring(got))
  for k, case in ipairs(cases) do
    for i = 1, 5 do
      t:ok(got[k][i] == expected[k][i], ("%q in %q from %d: %q, the library says %q (%d)"):format(
        case.pattern, case.text, case.from, got[k][i], expected[k][i], i))
    end
  end
end)
