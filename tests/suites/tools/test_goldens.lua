--- test_goldens.lua: goldens, from the first recording to a change with its reason.

local host = require "limax.host"
local source = require "limax.base.source"
local test = require "limax.test"
local trials = require "support.trial"

local limax, contains, trial = trials.limax, trials.contains, trials.file

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
  t:golden("one", { a = { 1, 2.5 }, b = value }, { rtol = rtol or 1e-3,
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
