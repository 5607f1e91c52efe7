--- test_processes.lua: how `limax test` isolates tests: a process for each file, limits, crashes,
--- interrupts.

local process = require "support.process"
local test = require "limax.test"
local trials = require "support.trial"

local limax, contains = trials.limax, trials.contains

local running = test.suite "limax test, processes"

running:test("a test that never returns is ended, and those after it run", function(t)
  -- a compiled loop, and one that catches errors
  local folder = trials.files(t, { a = [[
suite:test("before", function(t) t:ok(io.write "printed") end)
suite:test("loops", function() local x = 0 while true do x = x + 1 end end)
suite:test("between", function(t) t:ok(true) end)
suite:test("takes", { limit = 60 }, function(t) t:ok(true); require("limax.host").wait(0.3) end)
]], b = [[
suite:test("catches", { limit = 0.2 }, function()
  jit.off(true, true)
  while true do pcall(tostring) end
end)
suite:test("after", function(t) t:ok(false, "no luck") end)
]] })
  local output, status = limax("test", folder, "-j", "2", "--limit=0.2")
  t:equal(status, 1)
  contains(t, output, "\nprinted\n  ok   trial: before\n", "  ok   trial: between\n",
    "  ok   trial: takes\n", "FAIL trial: after\n        " .. folder .. "/b.lua:6: no luck",
    "--only 'trial: catches' --only 'trial: after'\n", "\n3 passed, 3 failed, 0 skipped\n")
  for _, name in ipairs { "loops", "catches" } do
    contains(t, output, ("FAIL trial: %s\n        it did not return within 2 s of its limit of "
      .. "0.2 s: its process was ended\n"):format(name))
  end
end)

running:test("os.exit hides no failure", function(t)
  local folder = trials.files(t, { inside = [[
suite:test("exits", function() os.exit(0) end)
suite:test("next", function(t) t:ok(true) end)
]], outside = "os.exit(0)\n" })
  for _, word in ipairs { "--jobs=1", "--one-process" } do
    local output, status = limax("test", folder, word)
    t:equal(status, 1)
    contains(t, output, ":2: a suite must not end its process: os.exit",
      "\n1 passed, 2 failed, 0 skipped\n")
  end
end)

running:test("a process that dies fails its test, and the others run", function(t)
  local folder = trials.files(t, {
    -- names that a shell would interpret
    ["-it's BASE & $HOME"] = [==[
suite:test("it's \"quoted\" $HOME `x` %d COMMAND", function(t) t:ok(true) end)
suite:test("dies $(echo no)", function() os.execute "kill -KILL $PPID" end)
suite:test("goes on \255", function(t) t:ok(false, "no \192\175 luck") end)
]==], collector = [[
local trap
suite:test("leaves", function(t)
  trap = newproxy(true)
  t:ok(trap)
  getmetatable(trap).__gc = function() os.execute "kill -KILL $PPID" end
end)
suite:test("passes", function(t) t:ok(trap) end)
]] })
  local one = limax("test", folder)
  for _, part in ipairs { "ok   trial: it's \"quoted\" $HOME `x` %d COMMAND\n",
    "FAIL trial: dies $(echo no)\n        its process ended with status 137 before this test did",
    "FAIL trial: goes on \255\n", ":4: no ? luck\n",
    "ok   trial: passes\n",
    "its process ends well\n        it ended with status 137 after its tests",
    "\n3 passed, 3 failed, 0 skipped\n" } do
    contains(t, one, part)
  end
  t:equal(limax("test", folder, "--jobs=3"), one)
end)

running:test("an interrupt ends the processes too", function(t)
  local folder = trials.files(t, { long1 = [[
suite:test("long", function()
  require("limax").robot { voxels = "es" }:simulate { duration = 1e5, time_step = 1e-5 }
end)
]], -- the C library ignores the interrupt while a command runs
    long2 = 'suite:test("long", function() os.execute "echo asleep; sleep 60" end)\n' })
  local child = process.start(folder, { "test", "long2.lua", "long1.lua", "-j", "2" })
  child:wait_for "asleep"
  child:signal "INT"
  -- it waits for its processes
  local status, output, seconds = child:finish()
  t:equal(status, 130)
  contains(t, output, "limax: interrupted")
  t:ok(seconds < process.LATE, ("the processes ended after %.1f s"):format(seconds))
end)
