--- user_call.lua: limited calls of user functions. A supervisor that raises an error, loops or
--- returns an invalid value costs the change of a generation, but not the run.

local failure = require "limax.base.failure"
local host = require "limax.host"
local limax = require "limax"

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

-- The history and the printed text of a run with a supervisor.
local function supervised(supervisor)
  local printed = {}
  local run = limax.start(limax.experiment { fitness = "distance", lattice = { 2, 2, 2 },
    population = 4, generations = 3, repetitions = 1, supervisor = supervisor,
    simulation = { duration = 0.06, settle = 0, accuracy = "preview" } },
    { device = "cpu", say = function(text) printed[#printed + 1] = text end })
  run:finish()
  return run.history, table.concat(printed, "\n")
end

suite:test("a supervisor that fails costs the change, and is reported",
  function(t)
    local usual = failure.USER_SECONDS
    local cases = {
      ["no idea"] = function() error "no idea" end,
      ["did not come back within 0.2 s"] = function() while true do pcall(error) end end,
      ["the supervisor returned 7, expected a table"] = function() return 7 end,
    }
    local ok, trouble = pcall(function()
      for expected, supervisor in pairs(cases) do
        -- a short limit only for the loop
        failure.USER_SECONDS = expected:find("0.2 s", 1, true) and 0.2 or usual
        local history, output = supervised(supervisor)
        t:equal(#history, 3)
        t:equal(history[3].parameters, history[1].parameters)
        t:equal(history[2].supervisor_failed, true)
        t:ok(output:find("FAILED IN EVERY GENERATION (2 of 2)", 1, true), output)
        local reason = history[2].ledger.reason
        t:ok(reason:find(expected, 1, true), reason)
        t:ok(output:find(expected, 1, true), output)
      end
    end)
    failure.USER_SECONDS = usual
    if not ok then error(trouble, 0) end
    local history = supervised(function()
      return { mutation_rate = 0 / 0, materials = 3, [print] = 1, crossover_rate = { 1 },
        mutation_scale = 0.12 }
    end)
    t:equal(history[2].parameters.mutation_scale, 0.12)
    t:equal(history[2].parameters.mutation_rate, 0.1)
    t:equal(history[2].supervisor_failed, nil)
  end)

suite:test("a file of limax is one also where Lua shortens its path", function(t)
  local path = host.home .. "/scripts/lib/" .. ("x"):rep(36) .. ".lua"
  local _, message = pcall(loadstring("error 'wrong'", "@" .. path))
  t:equal(failure.bare(message), "wrong")
  t:ok(not failure.is_ours ".../another/scripts/lib/x.lua:1: wrong")
end)
