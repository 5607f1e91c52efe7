--- user_call.lua: limited calls of user functions, which may raise an error or loop.

local failure = require "limax.base.failure"

local suite = require("limax.test").suite "user call"

local function hot()
  local sum = 0
  for i = 1, 1e5 do sum = sum + i % 7 end
  return sum
end

-- Compiled before the call, and called forever in it.
local function for_ever()
  while true do hot() end
end

-- Endless loops, with and without pcall.
local ENDLESS = {
  ["a plain loop"] = function() while true do end end,
  ["a loop that is compiled"] = for_ever,
  ["a loop that catches"] = function()
    while true do pcall(function() while true do end end) end
  end,
}

suite:test("endless loops are stopped, compiled or not", function(t)
  for _ = 1, 100 do hot() end
  for name, call in pairs(ENDLESS) do
    local ok, message = failure.attempt_within(0.2, call)
    t:equal(ok, false)
    local expected = "it did not come back within 0.2 s"
    t:ok(tostring(message):find(expected, 1, true), name .. ": " .. tostring(message))
    t:ok(jit.status(), "the compiler is on again")
    t:equal(debug.gethook(), nil)
    t:ok(hot() > 0)
  end
end)

suite:test("a loop that allocates memory is stopped", function(t)
  local ok, message = failure.attempt_within(600, function()
    local list = {}
    for i = 1, 1e9 do list[i] = ("x"):rep(1e5) .. i end
    return list
  end)
  t:ok(not ok and message:find("it took more than 1024 MB", 1, true), tostring(message))
  collectgarbage()
  t:ok(collectgarbage "count" < 5e5)
end)

suite:test("a nested call keeps the outer limit", function(t)
  local ok, message = failure.attempt_within(0.2, function()
    t:equal({ failure.attempt_within(60, function(a) return a, 2 end, 1) }, { true, 1, 2 })
    local fine, inner = failure.attempt_within(60, function() error("inner", 0) end)
    t:equal({ fine, inner }, { false, "inner" })
    failure.attempt_within(60, function() while true do pcall(for_ever) end end)
  end)
  t:equal(ok, false)
  t:ok(message:find("it did not come back within 0.2 s", 1, true), message)
end)

suite:test("results, errors and their places are returned", function(t)
  t:equal({ failure.attempt_user(function(...) return select("#", ...), ... end, 1, nil, 3) },
    { true, 3, 1, nil, 3 })
  local ok, message, trace = failure.attempt_user(function() error "mine" end)
  t:equal(ok, false)
  t:ok(message:find("user_call.lua:%d+: mine"), message)
  t:ok(trace:find("user_call.lua", 1, true), trace)
  local thrown = {}
  ok, message = failure.attempt_user(function() error(thrown) end)
  t:ok(not ok and message == thrown)
  ok, message = failure.attempt_user(function() coroutine.yield() end)
  t:ok(not ok and message:find "yield", message)
  t:equal(debug.gethook(), nil)
  t:ok(jit.status())
end)
