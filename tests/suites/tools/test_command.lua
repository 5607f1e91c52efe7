--- test_command.lua: output and options of `limax test`; comparisons; suggestions in messages; and
--- `limax doctor`.

local compare = require "limax.tools.test.compare"
local engine = require "limax.engine"
local host = require "limax.host"
local process = require "support.process"
local shell = require "limax.base.shell"
local test = require "limax.test"
local trials = require "support.trial"

local limax, contains, trial = trials.limax, trials.contains, trials.file

local MIXED = [[
suite:test("passes & <notes> # 1", function(t) t:ok(true); t:note "a \"note\"\1" end)
suite:test("it's out [of luck]", function(t) t:ok(false, "no \255 luck") end)
suite:test("waits", function(t) t:skip "not today" end)
suite:test("long", { tags = "full" }, function(t) t:ok(false, "runs only by name") end)
]]

-- ---- output ------------------------------------------------------------------------------------

local printing = test.suite "limax test"

printing:test("plain lines, and a command line for what failed", function(t)
  local path = trial(t, MIXED)
  local output, status = limax("test", path)
  t:equal(status, 1)
  contains(t, output, "ok   trial: passes & <notes> # 1\n       # a \"note\"",
    ("FAIL trial: it's out [of luck]\n        %s:3: no ? luck\n"):format(path),
    "skip trial: waits (not today)", "\n1 passed, 1 failed, 1 skipped\n")
  local line = output:match "to run only what failed:\n  ([^\n]+)\n"
  contains(t, process.output(line .. " 2>&1"), "\n0 passed, 1 failed, 0 skipped\n")
  contains(t, limax("test", path, "--only", "trial: long"), "\n0 passed, 1 failed, 0 skipped\n")
  -- -q prints only failures and the last line
  output = limax("test", path, "-q")
  t:equal(output, ("%s\n  FAIL trial: it's out [of luck]\n        %s:3: no ? luck\n\n"
    .. "to run only what failed:\n  %s test %s --only %s\n\n1 passed, 1 failed, 1 skipped\n")
    :format(path, path, shell.program(), path, shell.quoted "trial: it's out [of luck]"))
end)

printing:test("line, expected, got and difference of a failed check", function(t)
  local path = trial(t, [[
suite:test("numbers", function(t) t:near(1.5, 1, { rtol = 1e-3 }) end)
suite:test("tables", function(t) t:near({ 1, { x = 2 } }, { 1, { x = 4 } }) end)
suite:test("bits", function(t) t:same_bits({ 0 }, { -0 }) end)
suite:test("missing", function(t) t:equal({ a = 1 }, { a = 1, b = 2 }) end)
suite:test("error", function() local x = nil; x.y = 1 end)
suite:test("raises", function(t) t:raises("wanted", function() error "came" end) end)
suite:test("quiet", function(t) t:raises("wanted", function() end) end)
]])
  contains(t, limax("test", path),
    ":2: near (rtol 0.001, atol 0): expected 1, got 1.5; difference 0.5, relative 0.5",
    ":3: near (rtol 1e-09, atol 0): [2].x: expected 4, got 2",
    ":4: same_bits: [1]: expected -0, got 0", ":5: equal: .b: is missing (2)",
    ":6: attempt to index local 'x' (a nil value)",
    ':7: raises: expected an error with "wanted", got "', ":8: raises: expected an error",
    "\n0 passed, 7 failed, 0 skipped\n")
end)

printing:test("suites that do not load, and misuse at its line", function(t)
  local folder = trials.files(t, {
    broken = "local x = = 1\n",
    duplicate = 'suite:test("a", function() end)\nsuite:test("a", function() end)\n',
    global = "x = 1\n",
    good = 'suite:test("passes", function(t) t:ok(true) end)\n',
    option = 'suite:test("a", { limits = 1 }, function() end)\n',
    colon = 'suite.test("a", function() end)\n',
    twice = 'suite:test("a", { seeds = { 3, 3 } }, function() end)\n',
    precision = 'suite:test("a", { precisions = "doubel" }, function() end)\n',
    dot = 'suite:test("a", function(t) t.ok(true) end)\n',
  })
  host.file.write_atomic(folder .. "/empty.lua", "return 1\n")
  local output, status = limax("test", folder)
  t:equal(status, 1)
  contains(t, output, folder .. "/broken.lua\n  FAIL does not load\n",
    "broken.lua:2: unexpected symbol", 'duplicate.lua:3: suite "trial" already has a test "a"',
    "empty.lua begins no suite", "global.lua:2:",
    'option.lua:2: suite:test.limits: unknown field; did you mean "limit"?',
    "colon.lua:2: write a colon: suite:test(...)\n",
    'twice.lua: there are two tests "trial: a [seed 3]"',
    'precision.lua:2: precisions[1]: expected one of "compensated", "double", ',
    'got "doubel"; did you mean "double"?\n',
    "dot.lua:2: write a colon: t:ok(...)", "\n1 passed, 9 failed, 0 skipped\n")
  t:ok(not output:find("runner.lua", 1, true), output)
end)

printing:test("a JSON text sequence is mixed with what tests print", function(t)
  local path = trial(t, [[
suite:test("fails", { limit = 5 }, function(t) t:note "n"; t:ok(false, "no luck") end)
suite:test("waits", function(t) io.write "half a line"; t:skip "not today" end)
]])
  local expected = { { event = "begin", total = 2 }, { event = "file", path = path },
    { event = "start", suite = "trial", test = "fails", limit = 5 },
    { event = "test", suite = "trial", test = "fails", status = "failed", text = "no luck",
      where = path .. ":2", notes = { "n" } },
    { event = "start", suite = "trial", test = "waits" },
    { event = "test", suite = "trial", test = "waits", status = "skipped", text = "not today",
      notes = {} },
    { event = "end", passed = 0, failed = 1, skipped = 1 } }
  local output, events = limax("test", path, "--json-seq"), {}
  for line in output:gmatch "\30([^\n]*)\n" do
    local event = assert(host.json.decode(line, "a line"), line)
    event.seconds = nil
    events[#events + 1] = event
  end
  t:equal(events, expected)
  t:equal((output:gsub("\30([^\n]*)\n", "")), "half a line")
end)

printing:test("chooses by name and tag, and lists", function(t)
  local path = trial(t, [[
suite:test("one", { tags = "slow" }, function(t) t:ok(true) end)
suite:test("two", { tags = { "slow", "gait" } }, function(t) t:ok(true) end)
suite:test("three", function(t) t:ok(true) end)
suite:test("long", { tags = "full" }, function(t) t:ok(true) end)
]])
  for option, names in pairs { ["--filter=trial: t"] = "two three",
    ["--filter=^trial: t.o$"] = "two", ["--tags=gait"] = "two", ["--tags=slow,gait"] = "one two",
    ["--tags=-slow"] = "three", ["--tags=slow,-gait"] = "one", ["--tags=full"] = "long",
    ["--list"] = "one two three" } do
    local listed = {}
    for name in limax("test", path, "--list", option):gmatch "  trial: (%w+)" do
      listed[#listed + 1] = name
    end
    t:equal(table.concat(listed, " "), names)
  end
  t:equal(limax("test", path, "--list", "--tags=slow"),
    path .. "\n  trial: one (slow)\n  trial: two (slow, gait)\n")
  t:equal({ limax("test", path, "--filter", "nothing") },
    { "0 passed, 0 failed, 0 skipped\nlimax: no test was chosen\n", 1 })
end)

-- ---- comparing ---------------------------------------------------------------------------------

local comparing = test.suite "comparing"

comparing:test("near, equal and the same bits", function(t)
  local nan, infinity = 0 / 0, math.huge
  for _, case in ipairs {
    { 0, 100, 100.1, 1e-3, 0 }, { 1, 100, 100.2, 1e-3, 0 }, { 1, 0, 1e-7, 1, 0 },
    { 0, 0, 1e-7, 0, 1e-6 }, { 1, nan, nan, 1, 1 }, { 0, infinity, infinity, 0, 0 },
    { 1, infinity, 1, 1, 1 }, { 1, { 1, 2 }, { 1 }, 1, 1 }, { 1, 1, "1", 1, 1 },
  } do
    local differences = compare.near(case[2], case[3], { rtol = case[4], atol = case[5] })
    t:ok(#differences == case[1], compare.shown(case[2]) .. " " .. compare.shown(case[3]))
  end
  t:equal(#compare.same_bits({ 0.1, "a", true }, { 0.1, "a", true }), 0)
  t:equal({ #compare.same_bits(0, -0), #compare.same_bits(1, 1 + 2 ^ -52) }, { 1, 1 })
  t:equal({ #compare.equal(0, -0), #compare.equal(nan, nan), #compare.equal({}, { 1 }) },
    { 0, 0, 1 })
end)

-- ---- doctor ------------------------------------------------------------------------------------

local doctor = test.suite "limax doctor"

doctor:test("describes this machine and checks that bodies fall", function(t)
  local text, status = limax("doctor", "--json")
  t:equal(status, 0)
  local facts = host.json.decode(text, "doctor")
  t:equal({ facts.version, facts.home, facts.executable, facts.cuda_compiler },
    { host.version, host.home, host.executable, host.environment().cuda_compiler })
  t:near(facts.self_check.fallen, 4.905, { rtol = 1e-4 })
  local found, device = pcall(engine.device, "cuda")
  if found then
    t:equal({ facts.cuda, facts.gpus }, { device:describe().cuda, device:describe().gpus })
    t:ok(facts.walk_kernel.registers > 0 and facts.self_check_cuda.passed)
  else
    t:ok(tostring(device):find(facts.cuda_missing, 1, true), facts.cuda_missing)
  end
  text, status = limax "doctor"
  t:equal(status, 0)
  contains(t, text, "self check", found and facts.gpus[1].name or "none: " .. facts.cuda_missing,
    facts.cuda_driver and "can be opened" or "none: libcuda.so.1")
end)
