--- test_running.lua: how `limax test` runs tests: matrices, fixtures, orders, folders, statistics.

local compare = require "limax.tools.test.compare"
local host = require "limax.host"
local test = require "limax.test"
local trials = require "support.trial"

local HEAD, limax, contains, trial = trials.HEAD, trials.limax, trials.contains, trials.file

local running = test.suite "limax test, running"

running:test("a test runs once for each device and number of threads", function(t)
  local path = trial(t, [[
suite:test("matrix", { devices = { "cpu" }, threads = { 1, 2 } }, function(t)
  t:equal({ t.device.kind, t.device.threads }, { "cpu", t.threads })
end)
suite:test("plain", function(t) t:equal({ t.device, t.threads }, {}) end)
suite:test("everywhere", { devices = "all" }, function(t) t:note(t.device.kind) end)
]])
  local output, status = limax("test", path)
  t:equal(status, 0)
  contains(t, output, "ok   trial: matrix [cpu, 1 thread]\n  ok   trial: matrix [cpu, 2 threads]\n")
  contains(t, output, "ok   trial: everywhere [cpu]\n       # cpu\n")
  t:ok(output:find("ok   trial: everywhere [cuda]", 1, true)
    or output:find "skip trial: everywhere %[cuda%] %(.+%)", output)
end)

running:test("a matrix is every combination, and options of a simulation", function(t)
  local path = trial(t, [[
suite:test("all", { devices = "cpu", precisions = { "single", "double" }, integrators = "all",
  seeds = { 3, 4 } }, function(t)
  local o = t:with { duration = 2 }
  t:equal({ o.device, o.precision, o.integrator, o.duration },
    { t.device, t.precision, t.integrator, 2 })
  t:ok(t.seed == 3 or t.seed == 4)
end)
suite:test("impossible", { devices = "cuda", integrators = "rk4" }, function() end)
suite:test("later", { skip = "no rock here" }, function() error "never" end)
]])
  local output, status = limax("test", path)
  t:ok(status == 0, output)
  contains(t, output, "ok   trial: all [cpu, single, leapfrog, seed 3]")
  contains(t, output, "ok   trial: all [cpu, double, xpbd, seed 4]")
  contains(t, output, "skip trial: impossible [cuda, rk4] (rk4 runs on the cpu alone)")
  contains(t, output, "skip trial: later (no rock here)")
  contains(t, output, "\n16 passed, 0 failed, 2 skipped\n")
  path = trial(t, 'suite:test("a", { precisions = "doubel" }, function() end)\n')
  contains(t, limax("test", path), ':2: precisions: unknown precision "doubel"; did you mean')
end)

running:test("fixtures are made when asked for and ended in time", function(t)
  local path = trial(t, [[
local log = {}
local function write(text) log[#log + 1] = text end
suite:fixture("own", { close = function(value) write("end " .. value) end }, function(t)
  write("make for " .. t.name)
  return "own " .. t.name
end)
suite:fixture("common", { shared = true, close = function() io.stdout:write "closed\n" end },
  function() write "common"; return {} end)
suite:test("a", function(t)
  t:equal({ t:fixture "own", t:fixture "own" }, { "own a", "own a" })
  t:fixture("common").seen = true
end)
suite:test("b", function(t)
  t:fixture "own"
  t:ok(t:fixture("common").seen)
  t:equal(log, { "make for a", "common", "end own a", "make for b" })
end)
suite:test("c", function(t) t:fixture "comon" end)
]])
  local spoiled = trial(t, [[
for _, shared in ipairs { false, true } do
  suite:fixture(tostring(shared), { shared = shared, close = function() error "stuck" end },
    function() return 1 end)
  suite:test("uses " .. tostring(shared), function(t) t:fixture(tostring(shared)) end)
end
]])
  t:equal({ select(2, limax("test", spoiled)), limax("test", spoiled):match "%d+ passed.*" },
    { 1, "0 passed, 2 failed, 0 skipped\n" })
  local output = limax("test", path)
  contains(t, output, ':19: fixture: the suite has no "comon"; did you mean "common"?')
  contains(t, output, "closed\n")
  t:equal(select(2, output:gsub("closed", "")), 1)
  contains(t, output, "\n2 passed, 1 failed, 0 skipped\n")
end)

running:test("a JSON text sequence is the child's, with what tests print between", function(t)
  local path = trial(t, 'suite:test("prints", function() io.write "half a line" end)\n')
  local output, status = limax("test", path, "--json-seq")
  t:equal(status, 0)
  local texts, printed = {}, output:gsub("\30([^\n]*)\n", "")
  for text in output:gmatch "\30([^\n]*)\n" do
    texts[#texts + 1] = assert(host.json.decode(text, "a text")).event
  end
  t:equal({ texts, printed }, { { "begin", "file", "start", "test", "end" }, "half a line" })
  -- the lines for programs have the standard output for themselves
  local pipe = io.popen(("'%s' test '%s' --json 2>/dev/null"):format(host.executable, path))
  output = pipe:read "*a"
  pipe:close()
  t:equal(select(2, output:gsub('{"event":[^\n]*}\n', "")), 5)
  t:ok(not output:find("half", 1, true), output)
end)

running:test("misuse is said at its line, without the runner's own", function(t)
  local folder = t:folder()
  local texts = {
    colon = 'suite.test("a", function() end)\n',
    twice = 'suite:test("a", { seeds = { 3, 3 } }, function() end)\n',
    none = 'suite:test("a", { threads = 0 }, function() end)\n',
    half = 'suite:test("a", { seeds = 1.5 }, function() end)\n',
    lines = 'suite:test("a\\nb", function() end)\n',
    same = 'suite:test("a [seed 1]", function() end)\n'
      .. 'suite:test("a", { seeds = 1 }, function() end)\n',
    dot = 'suite:test("a", function(t) t.ok(true) end)\n',
  }
  for name, text in pairs(texts) do
    host.file.write_atomic(("%s/%s.lua"):format(folder, name), HEAD .. text)
  end
  local output = limax("test", folder)
  contains(t, output, "colon.lua:2: write a colon: suite:test(...)\n          ")
  contains(t, output, "twice.lua:2: seeds[2]: 3 stands there twice")
  contains(t, output, "none.lua:2: threads[1]: expected a whole number from 1 to 2^53, got 0")
  contains(t, output, "half.lua:2: seeds[1]: expected a whole number from 0 to 2^53, got 1.5")
  contains(t, output, "lines.lua:2: suite:test: name: expected one line")
  contains(t, output, 'same.lua: there are two tests "trial: a [seed 1]"')
  contains(t, output, "dot.lua:2: write a colon: t:ok(...)")
  contains(t, output, "\n0 passed, 7 failed, 0 skipped\n")
  t:ok(not output:find("runner.lua", 1, true), output)
end)

running:test("lines of JSON tell everything", function(t)
  local path = trial(t, [[
suite:test("fails", { limit = 5 }, function(t) t:note "n"; t:ok(false, "no luck") end)
suite:test("waits", function(t) t:skip "not today" end)
]])
  local events = {}
  for line in limax("test", path, "--json"):gmatch "[^\n]+" do
    local event = assert(host.json.decode(line, "a line"), line)
    event.seconds = nil
    events[#events + 1] = event
  end
  t:equal(events, { { event = "begin", total = 2 }, { event = "file", path = path },
    { event = "start", suite = "trial", test = "fails", limit = 5 },
    { event = "test", suite = "trial", test = "fails", status = "failed", text = "no luck",
      where = path .. ":2", notes = { "n" } },
    { event = "start", suite = "trial", test = "waits" },
    { event = "test", suite = "trial", test = "waits", status = "skipped", text = "not today",
      notes = {} },
    { event = "end", passed = 0, failed = 1, skipped = 1 } })
end)

running:test("a user's folder of suites runs from any folder", function(t)
  local folder, elsewhere = t:folder(), t:folder()
  host.file.mkdir(folder .. "/mine")
  host.file.write_atomic(folder .. "/mine/size.lua", "return 3\n")
  host.file.write_atomic(folder .. "/a.lua", HEAD .. [[
local size = require "mine.size"
suite:test("golden", function(t) t:golden("size", { size }) end)
]])
  local function from(where, word, ...)
    local pipe = io.popen(("cd '%s' && '%s' test '%s' %s 2>&1"):format(where, host.executable, word,
      table.concat({ ... }, " ")))
    local output = pipe:read "*a"
    pipe:close()
    return output
  end
  contains(t, from(folder, ".", "--update-golden"), "\n1 passed, 0 failed, 0 skipped\n")
  for _, call in ipairs { { folder, "a.lua" }, { elsewhere, folder }, { "/", folder .. "/a.lua" },
    { elsewhere, folder, "-j 2" } } do
    contains(t, from(unpack(call)), "\n1 passed, 0 failed, 0 skipped\n")
  end
end)

running:test("a drawn order repeats by its number", function(t)
  local lines = {}
  for i = 1, 12 do lines[i] = ('suite:test("%d", function() end)\n'):format(i) end
  local path = trial(t, table.concat(lines))
  local function order(...)
    local list, output = {}, limax("test", path, "--tap", ...)
    for name in output:gmatch "ok %d+ %- trial: (%d+)" do list[#list + 1] = tonumber(name) end
    return list, output
  end
  local plain, drawn = order(), order "--shuffle=7"
  t:equal(order "--shuffle=7", drawn)
  t:ok(#compare.equal(plain, drawn) > 0)
  table.sort(drawn)
  t:equal(drawn, plain)
  local _, output = order "--shuffle=0"
  t:ok(output:find "%-%-shuffle [1-9]", output)
end)

running:test("a statistic fails where chance does not explain it", function(t)
  local path = trial(t, [[
local engine = require "limax.engine"
local function normal(seed) return 2 + engine.random(seed, 1, "user", 0, 0):normal() end
local function shifted(seed) return normal(1000 + seed) + 3 end
local other = {}
for seed = 1, 20 do other[seed] = normal(500 + seed) end
suite:test("mean", function(t) t:statistically(normal, { seeds = 20, expected = 2 }) end)
suite:test("share", function(t)
  t:statistically(function(seed) return normal(seed) > 2 end, { expected = 0.5, at_least = 0.5 })
end)
suite:test("sample", function(t) t:statistically(normal, { seeds = 20, expected = other }) end)
suite:test("bound", function(t) t:statistically(normal, { at_least = 1.5, at_most = 2.5 }) end)
suite:test("other mean", function(t) t:statistically(shifted, { seeds = 20, expected = 2 }) end)
suite:test("other sample", function(t)
  t:statistically(shifted, { seeds = 20, expected = other })
end)
suite:test("not least", function(t) t:statistically(normal, { seeds = 20, at_least = 6 }) end)
suite:test("not most", function(t) t:statistically(normal, { seeds = 20, at_most = -2 }) end)
suite:test("few", function(t)
  t:statistically(shifted, { seeds = { 5, 6 }, expected = { 1, 2, 3 } })
end)
suite:test("nothing", function(t) t:statistically(normal, {}) end)
suite:test("nan", function(t)
  t:statistically(function() return 0 / 0 end, { expected = 1 })
end)
]])
  local output = limax("test", path)
  contains(t, output, "\n4 passed, 7 failed, 0 skipped\n")
  t:ok(output:find "ok   trial: mean\n       # mean [%d.]+ %+%- [%d.]+ of 20 seeds", output)
  t:ok(output:find ":13: statistically: mean 5[%d.]* %+%- [%d.]+ of 20 seeds %(level 0.0001%); exp",
    output)
  contains(t, output, "statistically: the samples differ: p ")
  contains(t, output, "2 and 3 values cannot differ at the level 0.0001")
  contains(t, output, "nothing is expected: name expected, at_least or at_most")
  contains(t, output, "seed 1 gave nan")
end)

running:test("files do not see one another's modules", function(t)
  local folder = t:folder()
  local function write(name, text) host.file.write_atomic(folder .. "/" .. name, text) end
  host.file.mkdir(folder .. "/mine")
  write("mine/counter.lua", "return { count = 0 }\n")
  for _, name in ipairs { "a", "b" } do
    write(name .. ".lua", HEAD .. [[
local counter = require "mine.counter"
counter.count = counter.count + 1
suite:test("counts", function(t) t:equal(counter.count, 1) end)
]])
  end
  local output, status = limax("test", folder)
  t:equal(status, 0, output)
  contains(t, output, "2 passed, 0 failed, 0 skipped")
end)

running:test("a folder lives as long as its test", function(t)
  local path = trial(t, [[
local host = require "limax.host"
local before
suite:test("writes", function(t)
  before = t:folder()
  host.file.mkdir(before .. "/deep")
  t:ok(host.file.write_atomic(before .. "/deep/file", "text"))
  t:ok(t:folder() ~= before)
end)
suite:test("is gone", function(t) t:equal(host.file.exists(before), nil) end)
]])
  local output, status = limax("test", path)
  t:equal({ status, output:match "2 passed" }, { 0, "2 passed" })
end)
