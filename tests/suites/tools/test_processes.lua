--- test_processes.lua: how `limax test` keeps tests from one another: a process for each file,
--- limits, deaths, interrupts.

local host = require "limax.host"
local process = require "support.process"
local runner = require "limax.tools.test.runner"
local test = require "limax.test"
local trials = require "support.trial"

local HEAD, limax, contains, trial = trials.HEAD, trials.limax, trials.contains, trials.file

local running = test.suite "limax test, processes"

running:test("a test that never returns is ended, and those after it run", { limit = 120 },
  function(t)
    local folder = t:folder()
    -- a loop that is compiled; one that is interpreted and swallows errors; one in C
    host.file.write_atomic(folder .. "/a.lua", HEAD .. [[
suite:test("before", function() io.write "printed" end)
suite:test("loops", { limit = 0.2 }, function() local x = 0 while true do x = x + 1 end end)
suite:test("between", function() end)
suite:test("catches", { limit = 0.2 }, function(t)
  t:note(t:folder())
  jit.off(true, true)
  while true do pcall(tostring) end
end)
suite:test("sleeps", { limit = 0.2 }, function() os.execute "sleep 60" end)
suite:test("after", function(t) t:ok(false, "no luck") end)
suite:test("last", function() end)
]])
    local output, status = limax("test", folder)
    t:equal(status, 1)
    for _, name in ipairs { "between", "last" } do
      contains(t, output, "  ok   trial: " .. name .. "\n")
    end
    contains(t, output, "\nprinted\n  ok   trial: before\n")
    for _, name in ipairs { "loops", "catches", "sleeps" } do
      t:ok(output:find(("FAIL trial: %s\n        it did not come back within 2 s of its limit of "
        .. "0.2 s: its process was ended\n"):format(name)), output)
    end
    contains(t, output, "FAIL trial: after\n        " .. folder .. "/a.lua:11: no luck")
    contains(t, output, "--only 'trial: sleeps' --only 'trial: after'\n")
    contains(t, output, "\n3 passed, 4 failed, 0 skipped\n")
  end)

running:test("a file that is not read to its end does not load", function(t)
  local path = trial(t, "while true do end\n")
  local file = runner.load(path, 0.3)
  t:ok(file.failure:find "^it did not come back within 0.3%d* s %(at .-trial.lua:2%)$",
    file.failure)
  t:equal({ #file.instances, type(os.exit) }, { 0, "function" })
end)

running:test("--limit is that of tests which name none", { limit = 60 }, function(t)
  local path = trial(t, [[
suite:test("loops", function() while true do end end)
suite:test("takes", { limit = 60 }, function() require("limax.host").wait(0.3) end)
]])
  local output = limax("test", path, "--limit=0.2")
  contains(t, output, "of its limit of 0.2 s: its process was ended")
  contains(t, output, "ok   trial: takes")
end)

running:test("os.exit passes nothing, in a test or beside it", function(t)
  local inside = trial(t, [[
suite:test("exits", function() os.exit(0) end)
suite:test("next", function() end)
]])
  local beside = trial(t, "os.exit(0)\n")
  for _, word in ipairs { "--jobs=1", "--one-process" } do
    local output, status = limax("test", inside, beside, word)
    t:equal(status, 1)
    contains(t, output, ":2: a suite may not end its process: os.exit")
    contains(t, output, "\n1 passed, 2 failed, 0 skipped\n")
  end
end)

running:test("a process that dies after its tests is a failure", function(t)
  local path = trial(t, [[
suite:fixture("last", { shared = true, close = function() os.execute "kill -KILL $PPID" end },
  function() return 1 end)
suite:test("first", function() end)
suite:test("uses it", function(t) t:fixture "last" end)
]])
  local output, status = limax("test", path)
  t:equal(status, 1)
  contains(t, output, "FAIL trial: uses it")
  contains(t, output, "its process ended with status 137 before this test did")
  -- the collector's last round comes after everything was said
  path = trial(t, [[
local trap
suite:test("leaves", function()
  trap = newproxy(true)
  getmetatable(trap).__gc = function() os.execute "kill -KILL $PPID" end
end)
suite:test("passes", function(t) t:ok(trap) end)
]])
  output, status = limax("test", path)
  t:equal(status, 1)
  contains(t, output, "ok   trial: passes\n")
  contains(t, output, "its process ends well\n        it ended with status 137 after its tests")
  contains(t, output, " test " .. path .. "\n")
end)

running:test("messages of any bytes arrive", function(t)
  local path = trial(t, [[
suite:test("fails \255", function(t)
  t:ok(false, "no \192\175 luck \237\160\128 é \240\159\166\145 \255\254")
end)
suite:test("notes", function(t) t:note "\128" end)
]])
  local output, status = limax("test", path)
  t:equal(status, 1)
  contains(t, output, ("FAIL trial: fails \255\n        %s:3: no ? luck ? é %s ?\n"):format(path,
    "\240\159\166\145"))
  contains(t, output, "\n1 passed, 1 failed, 0 skipped\n")
end)

running:test("an interrupt ends the processes too", { limit = 60 }, function(t)
  local folder = t:folder()
  host.file.write_atomic(folder .. "/quick.lua", HEAD .. 'suite:test("quick", function() end)\n')
  host.file.write_atomic(folder .. "/long1.lua", HEAD .. [[
suite:test("long", function()
  require("limax").robot { voxels = "es" }:simulate { duration = 1e5, time_step = 1e-5 }
end)
]])
  -- one that does not hear the interrupt: the C library ignores it while a command runs
  host.file.write_atomic(folder .. "/long2.lua", HEAD
    .. 'suite:test("long", function() os.execute "echo asleep; sleep 60" end)\n')
  local child = process.start(folder, { "test", "quick.lua", "long2.lua", "long1.lua", "-j", "2" })
  child:wait_for "asleep"
  child:signal "INT"
  -- it waits for its own processes: that it ends says that they have
  local status, output, seconds = child:finish()
  t:equal(status, 130)
  contains(t, output, "limax: interrupted")
  t:ok(seconds < process.LATE, ("the processes ended after %.1f s"):format(seconds))
end)

running:test("its processes end with it, however it ends", { limit = 60 }, function(t)
  local folder = t:folder()
  host.file.write_atomic(folder .. "/long.lua", HEAD .. [[
suite:test("long", function()
  os.execute "echo $PPID >pid.part; mv pid.part pid; echo begun"
  while true do end
end)
]])
  local child = process.start(folder, { "test", "long.lua" })
  child:wait_for "begun"
  local pid = process.read(folder .. "/pid"):match "%d+"
  t:equal(os.execute(("kill -0 %s 2>/dev/null"):format(pid)), 0)
  child:signal "KILL"
  child:finish()
  local start = host.clock()
  while os.execute(("kill -0 %s 2>/dev/null"):format(pid)) == 0 do
    t:ok(host.clock() - start < process.LATE, "the process of a test has outlived limax")
    host.wait(0.02)
  end
end)

running:test("names of any letters are run, and said once", function(t)
  local folder = t:folder()
  host.file.write_atomic(folder .. "/-it's BASE & $HOME.lua", HEAD .. [==[
suite:test("it's \"quoted\" $HOME `x` %d COMMAND", function() end)
suite:test("dies $(echo no)", function() os.execute "kill -KILL $PPID" end)
suite:test("BASE", function() end)
]==])
  local pipe = io.popen(("cd '%s' && '%s' test --shuffle 3 -- * 2>&1"):format(folder,
    host.executable))
  local output = pipe:read "*a"
  pipe:close()
  contains(t, output, "\n2 passed, 1 failed, 0 skipped\n")
  contains(t, output, "--only 'trial: dies $(echo no)'\n")
  t:equal(select(2, output:gsub("limax: %-%-shuffle 3\n", "")), 1)
end)

running:test("processes give the same results, and one that dies costs a test alone", function(t)
  local folder = t:folder()
  local function write(name, text) host.file.write_atomic(folder .. "/" .. name, text) end
  for _, name in ipairs { "a", "b", "c" } do
    local held = name ~= "b" and "true" or "false, 'no luck'"
    write(name .. ".lua", HEAD .. ('suite:test("%s", function(t) t:ok(%s) end)\n'):format(name,
      held))
  end
  local function counted(...)
    local output, status = limax("test", folder, ...)
    return output:match "%d+ passed, %d+ failed, %d+ skipped", status, output
  end
  local one, status = counted()
  t:equal((counted "--jobs=3"), one)
  local _, same, output = counted "--jobs=2"
  t:equal({ status, same }, { 1, 1 })
  contains(t, output, "b.lua\n  FAIL trial: b\n        " .. folder .. "/b.lua:2: no luck")
  contains(t, output, "--only 'trial: b'")
  write("d.lua", HEAD .. 'suite:test("first", function() end)\n'
    .. 'suite:test("dies", function() os.execute "kill -KILL $PPID" end)\n'
    .. 'suite:test("goes on", function() end)\n')
  write("e.lua", "local x = = 1\n")
  one, _, output = counted "--jobs=2"
  t:equal(one, "4 passed, 3 failed, 0 skipped")
  contains(t, output, "its process ended with status 137 before this test did")
  contains(t, output, "e.lua:1: unexpected symbol")
end)

running:test("a limit ends a simulation and fails a slow test", function(t)
  local path = trial(t, [[
local engine = require "limax.engine"
suite:test("simulates", { limit = 0.2 }, function()
  local materials = engine.materials "paper"
  local body = engine.population { lattice = { 3, 3, 3 }, count = 1 }
  local voxels = {}
  for i = 1, 27 do voxels[i] = 1 end
  body:set_body(1, voxels)
  body:check(materials)
  engine.simulation(body, materials, engine.scene {}, { duration = 1e5 }):run()
end)
suite:test("computes", { limit = 0.01 }, function()
  require("limax.host").wait(0.05)
end)
suite:test("is not limited by the one before", function() end)
]])
  local output = limax("test", path)
  -- one that the machine kept from saying so for two seconds was ended from outside
  t:ok(output:find("the time limit of 0.2 s has passed", 1, true)
    or output:find("of its limit of 0.2 s: its process was ended", 1, true), output)
  t:ok(output:find("s; its limit is 0.01 s", 1, true)
    or output:find("of its limit of 0.01 s: its process was ended", 1, true), output)
  contains(t, output, "\n1 passed, 2 failed, 0 skipped\n")
end)
