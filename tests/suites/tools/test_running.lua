--- test_running.lua: how `limax test` runs tests: matrices, fixtures, orders, folders, statistics;
--- goldens, from the first recording to a change with its reason.

local host = require "limax.host"
local source = require "limax.base.source"
local test = require "limax.test"
local trials = require "support.trial"

local limax, contains, trial = trials.limax, trials.contains, trials.file

local running = test.suite "limax test, running"

running:test("a test runs for every combination of its matrix", function(t)
  local path = trial(t, [[
suite:test("threads", { devices = { "cpu" }, threads = { 1, 2 } }, function(t)
  t:equal({ t.device.kind, t.device.threads }, { "cpu", t.threads })
end)
suite:test("plain", function(t) t:equal({ t.device, t.threads }, {}) end)
suite:test("everywhere", { devices = "all" }, function(t) t:ok(t.device); t:note(t.device.kind) end)
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
  contains(t, output,
    "ok   trial: threads [cpu, 1 thread]\n  ok   trial: threads [cpu, 2 threads]\n",
    "ok   trial: everywhere [cpu]\n       # cpu\n",
    "ok   trial: all [cpu, single, leapfrog, seed 3]",
    "ok   trial: all [cpu, double, symplectic_euler, seed 4]",
    "skip trial: impossible [cuda, rk4] (rk4 runs only on the cpu)",
    "skip trial: later (no rock here)")
  t:ok(output:find("ok   trial: everywhere [cuda]", 1, true)
    or output:find "skip trial: everywhere %[cuda%] %(.+%)", output)
end)

running:test("fixtures are made at their first use and ended in time", function(t)
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
  local output = limax("test", path)
  contains(t, output, ':19: fixture: the suite has no "comon"; did you mean "common"?',
    "closed\n", "\n2 passed, 1 failed, 0 skipped\n")
  t:equal(select(2, output:gsub("closed", "")), 1)
end)

running:test("a folder of suites runs from anywhere, and files do not share modules", function(t)
  local counts = [[
local counter = require "mine.counter"
counter.count = counter.count + 1
local before
suite:test("golden", function(t) t:golden("count", { counter.count }) end)
suite:test("writes", function(t)
  before = t:folder()
  local file = require("limax.host").file
  t:ok(file.mkdir(before .. "/deep") and file.write_atomic(before .. "/deep/file", "text"))
  t:ok(t:folder() ~= before)
end)
suite:test("its folder is gone", function(t)
  t:equal(require("limax.host").file.exists(before), nil)
end)
]]
  local folder, elsewhere = trials.files(t, { a = counts, b = counts }), t:folder()
  host.file.mkdir(folder .. "/mine")
  host.file.write_atomic(folder .. "/mine/counter.lua", "return { count = 0 }\n")
  for _, call in ipairs { { folder, ".", "--update-golden" }, { folder, "a.lua", "b.lua" },
    { elsewhere, folder, "-j", "2" }, { "/", folder .. "/a.lua", folder .. "/b.lua" } } do
    local output, status = trials.run({ "test", unpack(call, 2) }, ("cd '%s' &&"):format(call[1]))
    t:ok(status == 0, output)
    contains(t, output, "\n6 passed, 0 failed, 0 skipped\n")
  end
  t:equal(host.json.decode(
    assert(io.open(folder .. "/golden/b/count.json")):read "*a").values, { 1 })
end)

running:test("a test without a check fails, and 0 is not a true value", function(t)
  contains(t, limax("test", trial(t, [[
suite:test("nothing", function() return false end)
suite:test("zero", function(t) t:ok(0) end)
suite:test("misspelt", function(t) t:okay(true) end)
suite:test("swapped", function(t) t:raises(function() end, "text") end)
]])), "it passed without a check: call t:ok", "got 0, which is true in Lua",
    'a test\'s t has no "okay"', "raises: write t:raises(", "\n0 passed, 4 failed, 0 skipped\n")
end)

running:test("a statistic fails if chance does not explain it", function(t)
  local path = trial(t, [[
local engine = require "limax.engine"
local function normal(seed) return 2 + engine.random(seed, 1, "user", 0, 0):normal() end
local function shifted(seed) return normal(1000 + seed) + 3 end
local function share(seed) return normal(seed) > 2 end
local function nan() return 0 / 0 end
for name, case in pairs {
  mean = { normal, { seeds = 20, expected = 2 } },
  share = { share, { expected = 0.5, at_least = 0.5 } },
  bound = { normal, { at_least = 1.5, at_most = 2.5 } },
  ["other mean"] = { shifted, { seeds = 20, expected = 2 } },
  ["not least"] = { normal, { seeds = 20, at_least = 6 } },
  ["not most"] = { normal, { seeds = 20, at_most = -2 } },
  nothing = { normal, {} },
  nan = { nan, { expected = 1 } },
} do
  suite:test(name, function(t) t:statistically(unpack(case)) end)
end
]])
  local output = limax("test", path)
  contains(t, output, "\n3 passed, 5 failed, 0 skipped\n",
    "nothing is expected: set expected, at_least or at_most", "seed 1 gave nan")
  t:ok(output:find "ok   trial: mean\n       # mean [%d.]+ %+%- [%d.]+ of 20 seeds", output)
  t:ok(output:find ": statistically: mean 5[%d.]* %+%- [%d.]+ of 20 seeds %(level 0.0001%); exp",
    output)
end)

-- ---- goldens ------------------------------------------------------------------------------------

local goldens = test.suite "goldens"

-- The record of the golden `name` of a suite file.
local function record_of(path, name)
  local file = path:gsub("trial%.lua$", ("golden/trial/%s.json"):format(name))
  return assert(host.json.decode(source.read(file), file))
end

goldens:test("are recorded on demand, compared, and changed with a reason", function(t)
  local path = trial(t, [[
local value, rtol = tonumber(os.getenv "TRIAL_VALUE") or 1, tonumber(os.getenv "TRIAL_RTOL")
suite:test("golden", function(t)
  local second = tonumber(os.getenv "TRIAL_SECOND") or 2.5
  t:golden("one", { a = { 1, second }, b = value }, { rtol = rtol or 1e-3,
    why = os.getenv "TRIAL_WHY" or "a trial" })
end)
]])
  local function run(before, ...) return trials.run({ "test", path, ... }, before) end
  local output, status = run()
  t:equal(status, 1)
  contains(t, output, "there is no golden", "--update-golden")
  contains(t, run("", "--update-golden"), "golden one: new")
  local record = record_of(path, "one")
  t:equal({ record.schema, record.suite, record.test, record.why, record.rtol, record.values },
    { "limax.golden/2", "trial", "golden", "a trial", 1e-3, { a = { 1, 2.5 }, b = 1 } })
  t:ok(record.recorded.compiler and record.recorded.device and record.recorded.limax)
  t:equal(select(2, run()), 0)
  t:ok(not run("", "--update-golden"):find("golden one", 1, true))
  contains(t, run "TRIAL_VALUE=1.01", "golden one: .b: expected 1, got 1.01", "a trial")
  contains(t, run "TRIAL_VALUE=1.01 TRIAL_SECOND=5", "golden one: .a[2]: expected 2.5, got 5",
    "recorded -> now, the worst first", "  .b: 1 -> 1.01, relative 0.01\n")
  -- without a reason nothing is recorded
  contains(t, run("TRIAL_VALUE=1.01", "--update-golden"), "golden one: 1 value, old -> new\n",
    ".b: 1 -> 1.01, relative 0.01", "it is not recorded: an update needs a reason")
  t:equal(record_of(path, "one").values.b, 1)
  contains(t, run("TRIAL_VALUE=1.01", "--update-golden", "--reason", "a new law"),
    "1 passed, 0 failed", ".b: 1 -> 1.01, relative 0.01")
  -- so does another tolerance
  local wider = "TRIAL_VALUE=1.01 TRIAL_RTOL=1e-6 TRIAL_WHY=sums"
  contains(t, run(wider, "--update-golden"), "an update needs a reason",
    "another tolerance: short horizon (rtol 0.001, atol 0: a trial) -> rounding (rtol 1e-06, ")
  contains(t, run(wider, "--update-golden", "--reason", "exact now"), "1 passed, 0 failed")
  record = record_of(path, "one")
  t:equal({ record.values.b, record.class, record.why }, { 1.01, "rounding", "sums" })
  t:equal({ record.changes[1], record.changes[2].reason },
    { { reason = "a new law", change = "1 value, old -> new" }, "exact now" })
end)

goldens:test("need a name, finite values and a reason for a tolerance", function(t)
  local path = trial(t, [[
suite:test("name", function(t) t:golden("../up", {}) end)
suite:test("finite", function(t) t:golden("a", { x = { 1, 0 / 0 } }) end)
suite:test("reason", function(t) t:golden("b", { 1 }, { rtol = 1 }) end)
suite:test("shared", function(t) t:golden("a", { 1 }) end)
suite:test("class", function(t) t:golden("c", { 1 }, { class = "near" }) end)
suite:test("wide", function(t) t:golden("d", { 1 }, { class = "rounding", rtol = 1 }) end)
suite:test("damaged", function(t) t:golden("e", { 1 }) end)
]])
  local folder = path:gsub("trial%.lua$", "golden/trial")
  t:ok(host.file.mkdir(folder))
  host.file.write_atomic(folder .. "/e.json", '{"schema": "limax.golden/1", "values": [1]}')
  contains(t, limax("test", path, "--update-golden"),
    ":2: golden: a name has letters, digits, _ and -",
    ":3: a.x[2] is nan: a golden holds finite numbers", ":4: golden: a tolerance needs a reason",
    ':5: golden: "a" belongs to the test "finite"',
    ':6: golden.class: expected one of "bits", "rounding", "short horizon", "statistics", got',
    ':7: golden: rtol 1 is more than the class "rounding" allows, 1e-05',
    "e.json is not a golden of schema limax.golden/2")
end)
