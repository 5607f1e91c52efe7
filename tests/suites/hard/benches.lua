--- benches.lua: `limax bench stability` prints what the hard cases gave, and `limax bench blow-ups`
--- means the same robot by the same number.

local blow_ups = require "limax.tools.bench.blow_ups"
local engine = require "limax.engine"
local hard_cases = require "limax.tools.bench.hard_cases"
local host = require "limax.host"
local process = require "limax.tools.test.process"
local source = require "limax.base.source"
local stability = require "limax.tools.bench.stability"

local suite = require("limax.test").suite "benches of hard cases"

suite:test("names are unique, and the aim of 70 cases is met", function(t)
  local seen, count, rows = {}, 0, {}
  for _, case in ipairs(hard_cases.all()) do
    local name = ("%s: %s"):format(case.kind, case.name)
    t:ok(not seen[name], name)
    seen[name], count = true, count + 1
    if case.row then rows[case.row] = true end
  end
  t:ok(count >= 70, count .. " cases")
  for row = 1, 57 do t:ok(rows[row], ("row %d has no case"):format(row)) end
end)

suite:test("stability: a table, CSV and JSON", { limit = 60 }, function(t)
  local folder = t:folder()
  local done = process.limax({ "bench", "stability", "--filter", "free fall", "--json",
    "rows.json", "--csv", "rows.csv", "--device", "cpu" }, { folder = folder })
  t:ok(done.status == 0, done.stderr)
  t:ok(done.stdout:find("1. free fall", 1, true), done.stdout)
  t:ok(done.stdout:find("1 cases in", 1, true), done.stdout)
  local result = assert(host.json.decode(source.read(folder .. "/rows.json"), "rows.json"))
  t:equal(result.bench, "stability")
  local cells = {}
  for _, row in ipairs(result.rows) do
    t:equal(row.status, "holds")
    cells[row.integrator .. " " .. row.precision] = true
  end
  for _, precision in ipairs(engine.names.precision.names) do
    t:ok(cells["leapfrog " .. precision] and cells["symplectic_euler " .. precision], precision)
  end
  local _, lines = source.read(folder .. "/rows.csv"):gsub("\n", "")
  t:equal(lines, #result.rows + 1)
end)

for _, fraction in ipairs { 0.99, 0.5, 0.1 } do
  suite:test(("every case holds at %g of the bound"):format(fraction),
    { limit = 3600, tags = { "full" } }, function(t)
      local said = {}
      local result = stability.run { device = engine.device "cpu", fraction = fraction,
        say = function(text) said[#said + 1] = text end }
      t:ok(not result.failed, table.concat(said, "\n"))
    end)
end

suite:test("a case that fails is a failure, with what fails, and so is a differing verdict",
  function(t)
    local said = {}
    local cases = hard_cases.of "flight"
    local first = cases[1].run
    cases[1].run = function(c) c:near("height", 1, 2, { atol = 0.5 }) end
    local second = cases[2].run
    cases[2].run = function(c) c.reported = c.precision == "double" and "speed" or nil end
    local result = stability.run { device = engine.device "cpu", filter = "flight: free f",
      say = function(text) said[#said + 1] = text end }
    cases[1].run, cases[2].run = first, second
    t:equal({ result.failed, result.cases.failed, result.cases.differ }, { true, 1, 1 })
    t:ok(table.concat(said, "\n"):find("height is 1; expected 2", 1, true))
  end)

suite:test("general checks see a robot that diverges and energy from nowhere", function(t)
  local stage = require "limax.tools.bench.hard_cases.stage"
  local c = stage.context { device = engine.device "cpu", integrator = "leapfrog",
    precision = "double" }
  t:raises("robot 1 diverged %(speed%)", function()
    c:run { lattice = { 1, 1, 1 }, velocity = { 2000, 0, 0 } }
  end)
  t:raises("should have been reported", function()
    c:run { lattice = { 1, 1, 1 }, diverges = "speed" }
  end)
  -- a step beyond the bound, and before it bursts
  t:raises("energy of a passive scene rises", function()
    c:run { lattice = { 3, 3, 3 }, bound_fraction = 3, duration = 0.03, max_speed = 1e30,
      max_stretch = 1e15, record = { energy = 100 }, center = false, place = function(_, velocities)
        for i = 1, #velocities do velocities[i] = { math.sin(9 * i), 0, math.cos(7 * i) } end
      end }
  end)
end)

suite:test("blow-ups: the same number is the same robot, alone or in its batch",
  { devices = "all", limit = 120 }, function(t)
    local function said_of(first, cases)
      local said = {}
      local result = blow_ups.search { device = t.device, first = first, cases = cases,
        say = function(text) said[#said + 1] = text end }
      t:ok(said[#said]:find(("%d cases from %d"):format(cases, first), 1, true), said[#said])
      return result
    end
    t:equal(said_of(60, 10).cases, { first = 60, count = 10, diverged = 0, step = 0 })
    local one, again = blow_ups.describe(70), blow_ups.describe(70)
    t:same_bits(one, again)
    t:equal(one.simulation, blow_ups.describe(65).simulation)
    local other = blow_ups.describe(71)
    t:ok(host.json.encode(one.robot.weights) ~= host.json.encode(other.robot.weights))
  end)

for _, slice in ipairs { { 256, {} }, { 10000, { "full" } } } do
  suite:test(("blow-ups: the step is to blame for none of %d random robots"):format(slice[1]),
    { devices = "all", tags = slice[2] }, function(t)
      local result = blow_ups.search { device = t.device, first = 1, cases = slice[1],
        say = function(text) t:note(text) end }
      t:equal(result.cases.count, slice[1])
      t:equal(result.cases.step, 0)
    end)
end

suite:test("blow-ups: options that belong to another bench are refused", function(t)
  local folder = t:folder()
  local done = process.limax({ "bench", "stability", "--cases", "5" }, { folder = folder })
  t:equal(done.status, 2)
  t:ok(done.stderr:find("--cases belongs to limax bench blow-ups", 1, true), done.stderr)
  done = process.limax({ "bench", "blow-ups", "--case", "3", "--device", "cpu" },
    { folder = folder })
  t:ok(done.status == 0, done.stderr)
  t:ok(done.stdout:find('"scene": {', 1, true) and done.stdout:find("1 cases from 3", 1, true))
end)
