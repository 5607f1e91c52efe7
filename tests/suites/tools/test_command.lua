--- test_command.lua: `limax test` itself, run on suites that pass, fail, skip and do not load; the
--- suggestions of error messages; and `limax doctor`.

local compare = require "limax.tools.test.compare"
local engine = require "limax.engine"
local host = require "limax.host"
local shell = require "limax.base.shell"
local suggest = require "limax.engine.suggest"
local test = require "limax.test"
local trials = require "support.trial"

local HEAD, limax, contains, trial = trials.HEAD, trials.limax, trials.contains, trials.file

-- ---- what it prints ----------------------------------------------------------------------------

local printing = test.suite "limax test"

printing:test("counts on a line of its own and exits 0 or 1", function(t)
  local path = trial(t, [[
suite:test("passes", function(t) t:equal(1 + 1, 2) end)
suite:test("waits", function(t) t:skip "not today" end)
]])
  local output, status = limax("test", path)
  t:equal(status, 0)
  contains(t, output, "\n1 passed, 0 failed, 1 skipped\n")
  contains(t, output, "skip trial: waits (not today)")
  path = trial(t, 'suite:test("fails", function(t) t:ok(false, "no luck") end)\n')
  output, status = limax("test", path)
  t:equal(status, 1)
  contains(t, output, "\n0 passed, 1 failed, 0 skipped\n")
  contains(t, output, ("FAIL trial: fails\n        %s:2: no luck\n"):format(path))
end)

printing:test("shows line, expected, got and difference", function(t)
  local path = trial(t, [[
suite:test("numbers", function(t) t:near(1.5, 1, { rtol = 1e-3 }) end)
suite:test("tables", function(t) t:near({ 1, { x = 2 } }, { 1, { x = 4 } }) end)
suite:test("bits", function(t) t:same_bits({ 0 }, { -0 }) end)
suite:test("missing", function(t) t:equal({ a = 1 }, { a = 1, b = 2 }) end)
suite:test("error", function() local x = nil; x.y = 1 end)
suite:test("raises", function(t) t:raises("wanted", function() error "came" end) end)
suite:test("quiet", function(t) t:raises("wanted", function() end) end)
]])
  local output = limax("test", path)
  contains(t, output,
    ":2: near (rtol 0.001, atol 0): expected 1, got 1.5; difference 0.5, relative 0.5")
  contains(t, output, ":3: near (rtol 1e-09, atol 0): [2].x: expected 4, got 2")
  contains(t, output, ":4: same_bits: [1]: expected -0, got 0")
  contains(t, output, ":5: equal: .b: is missing (2)")
  contains(t, output, ":6: attempt to index local 'x' (a nil value)")
  contains(t, output, ':7: raises: expected an error with "wanted", got "')
  contains(t, output, ":8: raises: expected an error")
  contains(t, output, "\n0 passed, 7 failed, 0 skipped\n")
end)

printing:test("names a suite that does not load", function(t)
  local folder = t:folder()
  local texts = {
    broken = "local x = = 1\n",
    duplicate = HEAD .. 'suite:test("a", function() end)\nsuite:test("a", function() end)\n',
    empty = "return 1\n",
    global = HEAD .. "x = 1\n",
    good = HEAD .. 'suite:test("passes", function() end)\n',
    option = HEAD .. 'suite:test("a", { limits = 1 }, function() end)\n',
  }
  for name, text in pairs(texts) do
    host.file.write_atomic(("%s/%s.lua"):format(folder, name), text)
  end
  local output, status = limax("test", folder)
  t:equal(status, 1)
  contains(t, output, folder .. "/broken.lua\n  FAIL does not load\n")
  contains(t, output, "broken.lua:1: unexpected symbol")
  contains(t, output, 'duplicate.lua:3: suite "trial" has a test "a" already')
  contains(t, output, "empty.lua begins no suite")
  contains(t, output, "global.lua:2:")
  contains(t, output, 'option.lua:2: suite:test: unknown option "limits"; did you mean "limit"?')
  contains(t, output, "\n1 passed, 5 failed, 0 skipped\n")
end)

printing:test("TAP", function(t)
  local path = trial(t, [[
suite:test("passes # not a directive", function(t) t:note "a note" end)
suite:test("fails", function(t) t:ok(false, "no luck") end)
suite:test("waits", function(t) t:skip "not today" end)
]])
  local output, status = limax("test", path, "--tap")
  t:equal(status, 1)
  t:equal(output, table.concat({
    "TAP version 13", "1..3", "# " .. path,
    "ok 1 - trial: passes \\# not a directive", "# a note",
    "not ok 2 - trial: fails", "  ---", "  message: |", ("    %s:3: no luck"):format(path), "  ...",
    "ok 3 - trial: waits # SKIP not today", "",
  }, "\n"))
end)

printing:test("the line for the failures runs them and nothing else", function(t)
  local path = trial(t, [[
suite:test("passes", function() end)
suite:test("it's out [of luck]", function(t) t:ok(false, "no luck") end)
suite:test("long", { tags = "full" }, function(t) t:ok(false, "never asked for") end)
]])
  local output = limax("test", path)
  local line = output:match "what failed, alone:\n  ([^\n]+)\n"
  local pipe = io.popen(line .. " 2>&1")
  output = pipe:read "*a"
  pipe:close()
  contains(t, output, "FAIL trial: it's out [of luck]")
  contains(t, output, "\n0 passed, 1 failed, 0 skipped\n")
  contains(t, limax("test", path, "--only", "trial: long"), "\n0 passed, 1 failed, 0 skipped\n")
end)

printing:test("the slowest tests", function(t)
  local path = trial(t, [[
local host = require "limax.host"
for i = 1, 11 do
  suite:test(("waits %d"):format(i), function() host.wait(0.1 + 0.01 * i) end)
end
suite:test("quick", function() end)
]])
  local output = trials.timed("test", path)
  local slowest = output:match "\nslowest:\n(.-)\n\n"
  t:equal(select(2, slowest:gsub("[^\n]+", "")), 10)
  t:ok(slowest:find "^ +%d%.%d s  trial: waits %d+\n", slowest)
  t:ok(not slowest:find("quick", 1, true), slowest)
  t:ok(not trials.timed("test", path, "-q", "--filter=s [12]$"):find("slowest", 1, true))
end)

printing:test("JUnit's XML is well-formed and tells everything", function(t)
  local path = trial(t, [[
suite:test("passes & <notes>", function(t) t:note "a \"note\"\1" end)
suite:test("fails", function(t) t:ok(false, "no \255 luck é") end)
suite:test("waits", function(t) t:skip "not today" end)
]])
  local file = t:folder() .. "/results.xml"
  local _, status = limax("test", path, "--junit", file)
  t:equal(status, 1)
  -- a reader that is not ours
  local script = t:folder() .. "/read.py"
  host.file.write_atomic(script, [==[
import sys, json, xml.etree.ElementTree as tree
suite, = tree.parse(sys.argv[1]).getroot()
print(json.dumps([suite.attrib["name"], suite.attrib["tests"], suite.attrib["failures"],
    suite.attrib["skipped"], [[case.attrib["classname"], case.attrib["name"],
    [[part.tag, part.attrib.get("message"), part.text] for part in case]] for case in suite]]))
]==])
  local pipe = io.popen(("python3 '%s' '%s' 2>&1"):format(script, file))
  local text = pipe:read "*a"
  pipe:close()
  local null = host.json.null
  t:equal(assert(host.json.decode(text, "python"), text), { path, "3", "1", "1", {
    { "trial", "passes & <notes>", { { "system-out", null, 'a "note"?' } } },
    { "trial", "fails", { { "failure", "no ? luck é", path .. ":3: no ? luck é" } } },
    { "trial", "waits", { { "skipped", "not today", null } } } } })
end)

printing:test("chooses by name and tag, and lists", function(t)
  local path = trial(t, [[
suite:test("one", { tags = "slow" }, function() end)
suite:test("two", { tags = { "slow", "gait" } }, function() end)
suite:test("three", function() end)
]])
  local function passed(...)
    local output, status = limax("test", path, "-q", ...)
    t:equal(status, 0)
    return tonumber(output:match "(%d+) passed, 0 failed, 0 skipped\n$")
  end
  t:equal(passed "--filter=trial: t", 2)
  t:equal(passed "--filter=^trial: t.o$", 1)
  t:equal(passed "--tags=gait", 1)
  t:equal(passed "--tags=slow,gait", 2)
  t:equal(passed "--tags=-slow", 1)
  t:equal(passed "--tags=slow,-gait", 1)
  -- what takes minutes waits to be asked for
  local long = trial(t, 'suite:test("long", { tags = "full" }, function() end)\n'
    .. 'suite:test("short", function() end)\n')
  t:equal(limax("test", long, "--list"), long .. "\n  trial: short\n")
  t:equal(limax("test", long, "--list", "--tags=full"), long .. "\n  trial: long (full)\n")
  t:equal(limax("test", path, "--list", "--tags=slow"),
    path .. "\n  trial: one (slow)\n  trial: two (slow, gait)\n")
  local output, status = limax("test", path, "--filter", "nothing like this")
  t:equal(status, 1)
  contains(t, output, "no test was chosen")
end)

printing:test("-q prints failures and the last line alone", function(t)
  local path = trial(t, [[
suite:test("passes", function(t) t:note "a note" end)
suite:test("waits", function(t) t:skip "not today" end)
]])
  t:equal({ limax("test", path, "-q") }, { "1 passed, 0 failed, 1 skipped\n", 0 })
  path = trial(t, [[
suite:test("passes", function(t) t:note "a note" end)
suite:test("fails", function(t) t:ok(false, "no luck") end)
]])
  t:equal({ limax("test", path, "-q") }, { ("%s\n  FAIL trial: fails\n        %s:3: no luck\n\n"
    .. "what failed, alone:\n  %s test %s --only 'trial: fails'\n\n"
    .. "1 passed, 1 failed, 0 skipped\n"):format(path, path, shell.program(), path), 1 })
end)

printing:test("refuses what it cannot understand", function(t)
  local function refused(part, ...)
    local output, status = limax("test", ...)
    t:equal(status, 2)
    contains(t, output, part)
  end
  refused("there is no file or folder /nowhere", "/nowhere")
  refused("holds no .lua file", t:folder())
  refused("unknown option --taps", "--taps")
  refused("is no Lua pattern", "--filter=(")
  refused("--jobs is 0; it must be 1 to 1024", "--jobs=0")
  refused("--tap and --json exclude each other", "--tap", "--json")
  refused("--json and --json-seq exclude each other", "--json-seq", "--json")
  refused("--one-process and --jobs exclude each other", "--one-process", "-j", "2")
  refused("--reason goes with --update-golden", "--reason=why")
  refused("--junit: there is no folder /nowhere", "--junit=/nowhere/results.xml")
  refused("--junit: cannot ", "--junit=" .. t:folder(), trial(t, ""))
  refused("leave out --jobs", "--update-golden", "--jobs=2")
  -- an installed limax has no suites of its own
  local home = t:folder()
  for _, name in ipairs { "bindings", "scripts", "materials" } do
    os.execute(("cp -r '%s/%s' '%s'"):format(host.home, name, home))
  end
  local pipe = io.popen(("LIMAX_HOME='%s' '%s' test 2>&1; echo $?"):format(home, host.executable))
  local output = pipe:read "*a"
  pipe:close()
  t:equal(output, ("limax: limax's own suites are in its source tree and not in %s; name a file or "
    .. "folder of yours: limax test FILE.lua\n2\n"):format(home))
end)

-- ---- comparing ---------------------------------------------------------------------------------

local comparing = test.suite "comparing"

comparing:test("near", function(t)
  local function count(expected, got, rtol, atol)
    return #compare.near(expected, got, { rtol = rtol, atol = atol })
  end
  t:equal(count(100, 100.1, 1e-3, 0), 0)
  t:equal(count(100, 100.2, 1e-3, 0), 1)
  t:equal(count(0, 1e-7, 1, 0), 1)
  t:equal(count(0, 1e-7, 0, 1e-6), 0)
  t:equal(count(0 / 0, 0 / 0, 1, 1), 1)
  t:equal(count(math.huge, math.huge, 0, 0), 0)
  t:equal(count(math.huge, 1, 1, 1), 1)
  t:equal(count({ 1, { 2, 3 } }, { 1, { 2, 4 } }, 0, 0), 1)
  t:equal(count({ 1, 2 }, { 1 }, 1, 1), 1)
  t:equal(count({ a = "x" }, { a = "y" }, 1, 1), 1)
  t:equal(count(1, "1", 1, 1), 1)
end)

comparing:test("bits and equality", function(t)
  t:equal(#compare.same_bits({ 0.1, "a", true }, { 0.1, "a", true }), 0)
  t:equal(#compare.same_bits(0, -0), 1)
  t:equal(#compare.same_bits(1, 1 + 2 ^ -52), 1)
  t:equal(#compare.equal(0, -0), 0)
  t:equal(#compare.equal(0 / 0, 0 / 0), 0)
  t:equal(#compare.equal({}, { 1 }), 1)
  t:equal(compare.text(compare.equal({ x = { 1, 2 } }, { x = { 1, 3 } })[1]),
    ".x[2]: expected 2, got 3; difference 1, relative 0.5")
end)

comparing:test("suggestions", function(t)
  local names = { "gravity", "ground", "friction", "damping", "actuation" }
  t:equal(suggest("gravty", names), "gravity")
  t:equal(suggest("Grvaity", names), "gravity")
  t:equal(suggest("grav", names), "gravity")
  t:equal(suggest("wind", names), nil)
  t:equal(suggest("", names), nil)
  t:equal(suggest(3, names), nil)
  t:equal(suggest("x", {}), nil)
  t:equal(suggest("ab", { "b", "a" }), "a")
  t:equal(suggest.distance("abcd", "acbd"), 1)
  t:equal(suggest.distance("", "abc"), 3)
  t:equal(suggest.ending("gravty", names), '; did you mean "gravity"?')
  t:equal(suggest.ending("zzz", names),
    "; known are: actuation, damping, friction, gravity, ground")
end)

-- ---- doctor ------------------------------------------------------------------------------------

local doctor = test.suite "limax doctor"

doctor:test("describes this machine and checks that bodies fall", function(t)
  local text, status = limax("doctor", "--json")
  t:equal(status, 0)
  local facts = host.json.decode(text, "doctor")
  t:equal({ facts.version, facts.home, facts.executable },
    { host.version, host.home, host.executable })
  t:equal(facts.self_check.passed, true)
  t:near(facts.self_check.fallen, 4.905, { rtol = 1e-4 })
  -- what it says of CUDA is what the engine says
  local found, device = pcall(engine.device, "cuda")
  if found then
    t:equal({ facts.cuda, facts.gpus }, { device:describe().cuda, device:describe().gpus })
    t:equal(facts.walk_kernel.device, "cuda")
    t:ok(facts.walk_kernel.registers > 0 and facts.self_check_cuda.passed)
    t:near(facts.self_check_cuda.fallen, 4.905, { rtol = 1e-4 })
  else
    t:ok(tostring(device):find(facts.cuda_missing, 1, true), facts.cuda_missing)
  end
  t:equal(facts.cuda_compiler, host.environment().cuda_compiler)
  t:equal(facts.cuda_driver, (host.opens "libcuda.so.1") or false)
  t:ok(facts.cuda_driver or facts.cuda_driver_missing:find "libcuda.so.1")
  for _, name in ipairs { "compiler", "build", "isa", "luajit", "system", "cpu" } do
    t:ok(facts[name] ~= nil and facts[name] ~= "", name)
  end
  text, status = limax "doctor"
  t:equal(status, 0)
  contains(t, text, "self check")
  contains(t, text, found and facts.gpus[1].name or "none: " .. facts.cuda_missing)
  contains(t, text, facts.cuda_compiler or "no nvcc at build time")
  contains(t, text, facts.cuda_driver and "can be opened" or "none: libcuda.so.1")
end)

doctor:test("says what a scene will run", { limit = 180 }, function(t)
  local file = t:folder() .. "/e.lua"
  t:ok(host.file.write_atomic(file, [[
local limax = require "limax"
return limax.experiment { lattice = { 3, 2, 2 }, fitness = "walk", scene = {
  gravity = true, terrain = { heights = { { 0, 0 }, { 0, 0 }, { 0, 0 } } }, friction = true,
  planes = { { offset = -1 }, { offset = -2 } } } }
]]))
  local text, status = limax("doctor", "--json", "--scene", file)
  t:equal(status, 0)
  local facts, names = host.json.decode(text, "doctor"), {}
  for i, effect in ipairs(facts.effects) do
    names[i] = effect.name
    t:ok(effect.cost > -1 and effect.cost < 1, effect.name)
  end
  t:equal(names, { "gravity", "friction", "planes", "terrain" })
  t:equal(facts.effects[3].fields[2].offset, -2)
  t:ok(facts.springs > 0 and facts.step > 0 and facts.noise >= 0)
  t:ok(facts.runs.passes or facts.runs.path)
  text, status = limax("doctor", "--scene", file)
  t:equal(status, 0)
  contains(t, text, "planes[2]")
  contains(t, text, "us a step on one CPU thread, measured to within ")
  contains(t, text, "what a step saves without it")
  -- what lies below the noise of measuring is no gain
  t:ok(not text:find "\n *%-%d+ %%", text)
  contains(t, text, "heights 3 x 2 m")
  t:ok(not text:find("fewer than 20", 1, true), text)
  -- a drive whose periods are few steps
  t:ok(host.file.write_atomic(file, [[
return require("limax").experiment { lattice = { 2, 2, 2 }, fitness = "walk",
  simulation = { time_step = 2e-4 }, scene = { damping = true, actuation = { frequency = 500 } } }
]]))
  text, status = limax("doctor", "--scene", file)
  t:equal(status, 0)
  contains(t, text, "at 500 Hz a period is 10 steps of 0.0002 s, fewer than 20")
  t:ok(host.file.write_atomic(file, "return 1"))
  text, status = limax("doctor", "--scene", file)
  t:equal(status, 2)
  contains(t, text, "returns no experiment")
end)
