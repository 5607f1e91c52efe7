--- test_goldens.lua: goldens, from the first recording to a change with its reason.

local host = require "limax.host"
local source = require "limax.base.source"
local test = require "limax.test"
local trials = require "support.trial"

local limax, contains, trial = trials.limax, trials.contains, trials.file

local goldens = test.suite "goldens"

goldens:test("are recorded on demand, compared, and refused when they differ", function(t)
  local path = trial(t, [[
local value = tonumber(os.getenv "TRIAL_VALUE") or 1
suite:test("golden", function(t)
  t:golden("one", { a = { 1, 2.5 }, b = value }, { rtol = 1e-3, why = "a trial" })
end)
]])
  local file = path:gsub("trial%.lua$", "golden/trial/one.json")
  local output, status = limax("test", path)
  t:equal(status, 1)
  contains(t, output, "--update-golden")
  t:equal(host.file.exists(file), nil)
  output, status = limax("test", path, "--update-golden")
  t:equal(status, 0)
  contains(t, output, "golden one: new")
  local handle = io.open(file)
  local text = handle:read "*a"
  handle:close()
  local record = host.json.decode(text, file)
  t:equal(record.values, { a = { 1, 2.5 }, b = 1 })
  t:equal({ record.schema, record.suite, record.test, record.why, record.rtol },
    { "limax.golden/2", "trial", "golden", "a trial", 1e-3 })
  t:ok(record.recorded.compiler and record.recorded.device and record.recorded.limax)
  output, status = limax("test", path)
  t:equal({ status, output:match "golden one" }, { 0 })
  -- the environment of this process is the child's too
  local child = ("TRIAL_VALUE=1.01 '%s' test '%s' 2>&1"):format(host.executable, path)
  local pipe = io.popen(child)
  output = pipe:read "*a"
  pipe:close()
  contains(t, output, "golden one: .b: expected 1, got 1.01")
  contains(t, output, "a trial")
  -- a change needs its reason, and there is nobody to ask
  local function update(reason)
    local opened = io.popen(child .. " --update-golden" .. reason .. " </dev/null")
    local said = opened:read "*a"
    opened:close()
    return said
  end
  output = update ""
  contains(t, output, "golden one: 1 value, old -> new\n")
  contains(t, output, ".b: 1 -> 1.01, relative 0.01")
  contains(t, output, "it stays as it is: an update needs its reason")
  t:equal(source.read(file), text)
  output = update " --reason 'a new law'"
  contains(t, output, "1 passed, 0 failed")
  contains(t, output, ".b: 1 -> 1.01, relative 0.01")
  record = host.json.decode(source.read(file), file)
  t:equal({ record.values.b, record.class, record.changes }, { 1.01, "short horizon",
    { { reason = "a new law", change = "1 value, old -> new" } } })
end)

goldens:test("a person at a terminal is asked for the reason", function(t)
  local path = trial(t, [[
local value = tonumber(os.getenv "TRIAL_VALUE") or 1
suite:test("golden", function(t) t:golden("one", { value }) end)
]])
  local file = path:gsub("trial%.lua$", "golden/trial/one.json")
  limax("test", path, "--update-golden")
  local folder = t:folder()
  local function typed(answer)
    host.file.write_atomic(folder .. "/type.py", ([[
import os, pty, sys
pid, fd = pty.fork()
if pid == 0:
    os.environ["TRIAL_VALUE"] = "2"
    os.execv(%q, ["limax", "test", %q, "--update-golden"])
text = b""
while b"as it is)? " not in text: text += os.read(fd, 4096)
os.write(fd, %q)
try:
    while True:
        more = os.read(fd, 4096)
        if not more: break
        text += more
except OSError: pass
os.waitpid(pid, 0)
sys.stdout.buffer.write(text)
]]):format(host.executable, path, "@"):gsub('"@"', 'b"' .. answer .. '\\n"'))
    local pipe = io.popen(("timeout 300 python3 '%s/type.py' 2>&1"):format(folder))
    local said = pipe:read "*a"
    pipe:close()
    return said
  end
  contains(t, typed "", "it stays as it is: an update needs its reason")
  t:equal(host.json.decode(source.read(file), file).values, { 1 })
  contains(t, typed "because", "[1]: 1 -> 2, relative 1")
  local record = host.json.decode(source.read(file), file)
  t:equal({ record.values, record.changes[1].reason }, { { 2 }, "because" })
end)

goldens:test("of another configuration are an error, whatever the values", function(t)
  local path = trial(t, [[
local limax = require "limax"
suite:test("still", { precisions = { "single", "double" }, devices = "all" }, function(t)
  local robot = limax.robot { voxels = "es" }:simulate(t:with { settle = 0, duration = 0.05,
    time_step = 1e-4, scene = { gravity = { acceleration = {
      0, 0, tonumber(os.getenv "TRIAL_VALUE") or -9.81 } } } })
  t:golden("mass", { robot.body.mass }, { class = "rounding", why = "sums of equal numbers" })
end)
]])
  local output, status = limax("test", path, "--update-golden")
  t:ok(status == 0, output)
  output, status = limax("test", path)
  t:ok(status == 0, output)
  local pipe = io.popen(("TRIAL_VALUE=-5 '%s' test '%s' 2>&1"):format(host.executable, path))
  output = pipe:read "*a"
  pipe:close()
  contains(t, output, "golden mass is of another configuration (")
  contains(t, output, "\n0 passed, 2 failed")
end)

goldens:test("of the first schema, and what is no golden, need a reason", function(t)
  local path = trial(t, 'suite:test("golden", function(t) t:golden("one", { 1.5 }) end)\n')
  local file = path:gsub("trial%.lua$", "golden/trial/one.json")
  t:ok(host.file.mkdir(file:match "^(.*)/"))
  local first = '{"schema": "limax.golden/1", "suite": "trial", "test": "golden", "name": "one", '
    .. '"why": "the same bits", "rtol": 0, "atol": 0, "recorded": {"device": "cpu"}, '
    .. '"values": [%s]}\n'
  for text, said in pairs {
    [first:format "1.5"] = "of schema limax.golden/1, without a configuration",
    [first:format "1.25"] = "without a configuration, and 1 value\n          [1]: 1.25 -> 1.5",
    ["{"] = "in the place of what cannot be read: ",
    ['{"schema": "limax.golden/2", "values": [1]}'] = "one.json is no golden of schema",
    ['{"schema": "limax.golden/2", "values": [1], "recorded": {}, "changes": [1]}'] =
      "one.json is no golden of schema",
  } do
    t:ok(host.file.write_atomic(file, text))
    t:equal(select(2, limax("test", path)), 1)
    local output, status = limax("test", path, "--update-golden")
    t:equal({ status, source.read(file) }, { 1, text })
    contains(t, output, said)
    contains(t, output, "it stays as it is: an update needs its reason")
    output, status = limax("test", path, "--update-golden", "--reason", "to the second schema")
    t:ok(status == 0, output)
    local record = host.json.decode(source.read(file), file)
    t:equal({ record.schema, record.values, record.changes[1].reason, record.changes[2] },
      { "limax.golden/2", { 1.5 }, "to the second schema" })
    t:equal(select(2, limax("test", path)), 0)
  end
end)

goldens:test("with another tolerance, or another why, need a reason", function(t)
  local path = trial(t, [[
suite:test("golden", function(t)
  t:golden("one", { 1 }, { rtol = tonumber(os.getenv "TRIAL_RTOL"), why = os.getenv "TRIAL_WHY" })
end)
]])
  local function update(rtol, why, ...)
    local words = {}
    for i, word in ipairs { ... } do words[i] = ("'%s'"):format(word) end
    local pipe = io.popen(("TRIAL_RTOL=%s TRIAL_WHY='%s' '%s' test '%s' --update-golden %s 2>&1 "
      .. "</dev/null"):format(rtol, why, host.executable, path, table.concat(words, " ")))
    local output = pipe:read "*a"
    pipe:close()
    return output
  end
  contains(t, update("1e-6", "rounding"), "golden one: new")
  t:ok(not update("1e-6", "rounding"):find("golden one", 1, true))
  local wider = "another tolerance: rounding (rtol 1e-06, atol 0) -> short horizon (rtol 0.001, "
  contains(t, update("1e-3", "rounding"), wider)
  contains(t, update("1e-3", "rounding"), "an update needs its reason")
  contains(t, update("1e-3", "rounding", "--reason", "another law"), "1 passed, 0 failed")
  contains(t, update("1e-3", "chaos"), "another why: rounding -> chaos\n")
  contains(t, update("1e-3", "chaos", "--reason", "said better"), "1 passed, 0 failed")
  local record = host.json.decode(source.read((path:gsub("trial%.lua$",
    "golden/trial/one.json"))))
  t:equal({ #record.changes, record.changes[2].reason, record.why }, { 2, "said better", "chaos" })
end)

goldens:test("know what a shared fixture simulated, whichever test made it", function(t)
  local path = trial(t, [[
local limax = require "limax"
suite:fixture("walked", { shared = true }, function()
  return limax.robot { voxels = "es" }:simulate { settle = 0, duration = 0.05, time_step = 1e-4 }
end)
for _, name in ipairs { "a", "b" } do
  suite:test(name, function(t)
    t:golden(name, { t:fixture("walked"):distance(), t:fixture("walked").body.mass })
  end)
end
]])
  local output, status = limax("test", path, "--update-golden")
  t:ok(status == 0, output)
  local folder, hashes = path:gsub("trial%.lua$", "golden/trial/"), {}
  for i, name in ipairs { "a", "b" } do
    hashes[i] = host.json.decode(source.read(folder .. name .. ".json"), name).configuration
  end
  t:equal(hashes[1], hashes[2])
  for _, word in ipairs { "--only=trial: a", "--only=trial: b", "--shuffle=3" } do
    output, status = limax("test", path, word)
    t:ok(status == 0, output)
  end
end)

goldens:test("need a name, finite values and a reason for a tolerance", function(t)
  local path = trial(t, [[
suite:test("name", function(t) t:golden("../up", {}) end)
suite:test("finite", function(t) t:golden("a", { x = { 1, 0 / 0 } }) end)
suite:test("reason", function(t) t:golden("b", { 1 }, { rtol = 1 }) end)
suite:test("shared", function(t) t:golden("a", { 1 }) end)
suite:test("class", function(t) t:golden("c", { 1 }, { class = "near" }) end)
suite:test("wide", function(t) t:golden("d", { 1 }, { class = "rounding", rtol = 1 }) end)
]])
  local output = limax("test", path, "--update-golden")
  contains(t, output, ":2: golden: a name is made of letters, digits, _ and -")
  contains(t, output, ":3: a.x[2] is nan: a golden holds finite numbers")
  contains(t, output, ":4: golden: a tolerance needs its reason")
  contains(t, output, ':5: golden: "a" belongs to the test "finite"')
  contains(t, output, ":6: golden: class: near is none; known are: bits, rounding, short horizon")
  contains(t, output, ':7: golden: rtol 1 is more than the class "rounding" allows, 1e-05')
end)
