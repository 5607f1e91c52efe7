--- interrupt.lua: Ctrl-C ends whatever runs, and an interrupted run resumes to the same bytes.

local evolution = require "support.evolution"
local faulty_server = require "support.faulty_server"
local process = require "support.process"

local suite = require("limax.test").suite "interrupt"

-- Without the interrupt each case runs until it is killed as a process that hangs.
local READY = 'io.stderr:write "ready\\n" '

-- A loop that prints "ready" when it has been compiled, where no hook can reach it.
local COMPILED = "local n = 0 while true do n = n + 1 if n == 1e7 then " .. READY .. "end end"

-- Starts a script, and waits until it prints "ready".
local function started(t, text)
  local folder = t:folder()
  process.write(folder .. "/script.lua", text)
  local child = process.start(folder, { "script.lua" })
  child:wait_for "ready"
  return child
end

-- Sends SIGINT, or another signal, to a script that is ready, and returns its output.
local function interrupt(t, text, signal)
  local child = started(t, text)
  child:signal(signal or "INT")
  local status, output = child:finish()
  t:equal(status, signal == "TERM" and 143 or 130)
  return output
end

suite:test("Ctrl-C ends interpreted loops, pcall loops, coroutines, waits and parsers", function(t)
  for _, loop in ipairs {
    "jit.off() while true do end",
    "while true do pcall(error, 'x') end",
    "while true do xpcall(function() tostring {} end, function(m) return m .. '' end) end",
    "local f = coroutine.wrap(function() while true do pcall(tostring) coroutine.yield() end end) "
      .. "jit.off() while true do f() end",
    "while true do local p = io.popen 'sleep 0.01' p:read '*a' p:close() end",
    "io.popen('exec sleep 3600'):read '*a'",
    "require('limax.host').wait(3600)",
    "require('limax.host').sandbox { source = 'return function() while true do end end', "
      .. "name = '=loop', text = '', limits = {} }",
  } do
    t:equal(interrupt(t, READY .. loop), "ready\nlimax: interrupted\n")
  end
  -- a scheduler asks a job to end so
  t:equal(interrupt(t, READY .. "require('limax.host').wait(3600)", "TERM"),
    "ready\nlimax: interrupted\n")
end)

suite:test("Ctrl-C ends compiled loops, by a hard stop if need be", function(t)
  local output = interrupt(t, "require('limax.host').signal.on_hard_stop 'continue' " .. COMPILED)
  t:ok(output:find("stopping hard.* complete%.\ncontinue\n$"), output)
  for _, loop in ipairs {
    "local n = 0 local function f() n = n + 1 end while true do pcall(f) end",
    "local raise = require('limax.host').raise_if_interrupted while true do pcall(raise) end",
  } do
    interrupt(t, READY .. loop)
  end
end)

-- A script that prints "cleaned" after Ctrl-C: with lines before, and after it.
local CLEANING = [[
local host, engine = require "limax.host", require "limax.engine"
%s
local ok, value = host.protect(function()
  io.stderr:write "ready\n"
  while true do pcall(error) end
end)
assert(not ok and value == host.interrupt)
host.raise_if_interrupted()
assert(tostring(value) == "interrupted")
-- interpreted and compiled Lua, and the engine, work as before
local sum = 0
for i = 1, 1e6 do sum = sum + i %% 7 end
engine.population { lattice = { 2, 2, 2 }, count = 1 }
print "cleaned" io.stdout:flush()
%s
host.exit(130)
]]

suite:test("clean-up runs after Ctrl-C; a second press ends at once, with a message if set",
  function(t)
    t:equal(interrupt(t, CLEANING:format("", "")), "ready\ncleaned\n")
    local set = "host.signal.on_hard_stop 'go on'"
    for before, message in pairs { [""] = "", [set] = "\ngo on\n" } do
      local child = started(t, CLEANING:format(before, "while true do end"))
      child:signal "INT"
      child:wait_for "cleaned"
      -- two signals within a tenth of a second are one press
      os.execute "sleep 0.2"
      child:signal "INT"
      local status, output = child:finish()
      t:equal({ status, output }, { 130, "ready\ncleaned\n" .. message })
    end
    -- both signals by one command
    local child = started(t, CLEANING:format("", "os.execute 'sleep 0.3'"))
    os.execute(("kill -INT %s %s"):format(child.pid, child.pid))
    local status, output = child:finish()
    t:equal({ status, output }, { 130, "ready\ncleaned\n" })
  end)

suite:test("a user's function that loops is reported after 5 s, and Ctrl-C names it",
  function(t)
    local children = {}
    for _, role in ipairs { "fitness", "selection" } do
      local folder = t:folder()
      evolution.script(folder .. "/script.lua",
        role .. " = function() while true do pcall(error) end end")
      children[role] = process.start(folder, { "run", "script.lua", "--device", "cpu" })
    end
    for role, child in pairs(children) do
      local name = ("the %s (script.lua:5)"):format(role)
      child:wait_for(name .. " has been running for 5 s")
      child:signal "INT"
      local status, output = child:finish()
      t:equal(status, 130)
      t:ok(output:find("interrupted in " .. name, 1, true), output)
    end
  end)

-- An experiment that hangs in generation 2, or before it is bred, as the environment names.
local EXPERIMENT = [[
local limax = require "limax"
-- a table with a metatable is none of what is compared when the run goes on
local how = setmetatable({ name = os.getenv "LIMAX_TEST_HANG" }, {})
local function ready() io.stderr:write "ready\n" end
local hang = {}
function hang.loop()
  local n = 0
  while true do
    n = n + 1
    if n == 1e7 then ready() end -- it has long been compiled
  end
end
function hang.pcall() ready() while true do pcall(tostring, {}) end end
-- asks a language model, which a scenario of the faulty server plays
local function ask(scenario, record)
  require("limax.supervise.llm.client").new({ model = "m",
    url = os.getenv "LIMAX_TEST_URL" .. scenario .. "/v1" }, { record = record }):ask {
      { role = "user", content = "json" } }
end
function hang.answer() ready() ask("silent", function() end) end
function hang.retry() ask("retry_after_minute", ready) end
function hang.simulation(robot)
  ready()
  robot:simulate { duration = 1e5 }
end
local function supervisor(history)
  if how.name == "supervisor" and #history == 2 then hang.pcall() end
end
return limax.experiment {
  lattice = { 3, 3, 3 }, population = 6, generations = 4, seed = 7,
  simulation = { duration = 0.5, settle = 0.1, accuracy = "preview" },
  fitness = function(robot)
    local call = hang[how.name]
    if call and robot.generation == 2 then call(robot) end
    return robot:distance()
  end,
  supervisor = supervisor,
}
]]

local RESULTS = { "r01/metrics.jsonl", "r01/ledger.jsonl", "r01/robots/g0003.npy",
  "r01/genomes/g0003.npy", "r01/champions/g0003.json" }

suite:test("an interrupted run resumes to the bytes of an uninterrupted one", function(t)
  local server, whole = faulty_server.open(t), t:folder()
  process.write(whole .. "/e.lua", EXPERIMENT)
  local status, output = process.run(whole, { "run", "e.lua", "-q", "--out", "run" })
  t:ok(status == 0, output)

  for _, how in ipairs { "loop", "pcall", "answer", "retry", "simulation", "supervisor" } do
    local folder = t:folder()
    process.write(folder .. "/e.lua", EXPERIMENT)
    local child = process.start(folder, { "run", "e.lua", "--out", "run" },
      ("LIMAX_TEST_HANG=%s LIMAX_TEST_URL=%s LIMAX_LLM_KEY=any"):format(how, server.base))
    child:wait_for "ready"
    child:signal "INT"
    status, output = child:finish()
    t:ok(status == 130, how .. ": " .. output)
    t:ok(output:find "\ncontinue with: [^\n]*limax run %-%-resume run\n", output)
    -- also after a hard stop, which writes nothing
    t:equal(evolution.state(folder .. "/run"), "stopped")

    status, output = process.run(folder, { "run", "--resume", "run", "-q" })
    t:ok(status == 0, output)
    evolution.same_files(t, folder .. "/run", whole .. "/run", RESULTS)
  end
  server:close()
end)
