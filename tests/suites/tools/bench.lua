--- bench.lua: `limax bench`: the rows of each bench, as a table, CSV and JSON; statistics of
--- rankings against examples worked out by hand.

local accuracy = require "limax.tools.bench.accuracy"
local bench_ranking = require "limax.tools.bench.accuracy.ranking"
local context = require "limax.tools.bench.hard_cases.context"
local engine = require "limax.engine"
local host = require "limax.host"
local process = require "support.process"
local ranking = require "limax.base.statistics.ranking"
local source = require "limax.base.source"

local suite = require("limax.test").suite "limax bench"

-- Runs a bench: its rows, its CSV and its output agree.
local function bench(t, words)
  local folder = t:folder()
  local all = { "bench", unpack(words) }
  for _, word in ipairs { "--json", "rows.json", "--csv", "rows.csv" } do all[#all + 1] = word end
  local done = process.completes(t, folder, all)
  local result = assert(host.json.decode(source.read(folder .. "/rows.json"), "rows.json"))
  t:equal({ result.schema, result.bench }, { "limax.bench/1", words[1] })
  local lines = {}
  for line in source.read(folder .. "/rows.csv"):gmatch "[^\n]+" do lines[#lines + 1] = line end
  t:equal({ lines[1], #lines - 1 }, { table.concat(result.columns, ","), #result.rows })
  local columns = {}
  for _, column in ipairs(result.columns) do columns[column] = true end
  for _, row in ipairs(result.rows) do
    for name in pairs(row) do t:ok(columns[name], name .. " is in a row and has no column") end
  end
  return result.rows, done.stdout
end

local function row_of(t, rows, fields)
  for _, row in ipairs(rows) do
    local fits = true
    for name, value in pairs(fields) do fits = fits and row[name] == value end
    if fits then return row end
  end
  t:ok(false, "no row has " .. host.json.encode(fields))
end

suite:test("throughput of the CPU", function(t)
  local rows, output = bench(t, { "throughput", "--device", "cpu", "--threads", "2",
    "--seconds", "0.01" })
  t:ok(output:find("checked: every precision", 1, true), output)
  for _, precision in ipairs { "single", "compensated", "double" } do
    local row = row_of(t, rows, { precision = precision, integrator = "leapfrog", threads = 1,
      robots = 1, effects = "all" })
    t:ok(row.springs_per_second > 1e5, precision)
  end
end)

suite:test("effects: each one, all but each, and all", function(t)
  local rows = bench(t, { "effects", "--device", "cpu", "--seconds", "0.01" })
  -- springs are in all, control is in none but its own
  t:equal(#rows, 5 + 2 * (#engine.effects() - 4))
  t:near(rows[1].relative_to_springs, 1)
  t:equal(rows[#rows].effects, "all")
  t:near(rows[#rows].relative_to_all, 1)
  -- friction needs the ground
  local both = row_of(t, rows, { effects = "ground, friction" })
  t:near(both.relative_to_springs, both.seconds_per_step / rows[1].seconds_per_step)
  row_of(t, rows, { effects = "all but ground, friction, patches" })
end)

suite:test("hard cases: invariants detect divergence and energy from nowhere", function(t)
  local c = context.new { device = engine.device "cpu", integrator = "leapfrog",
    precision = "double" }
  t:raises("robot 1 diverged (speed)", function()
    c:run { lattice = { 1, 1, 1 }, velocity = { 2000, 0, 0 } }
  end)
  t:raises("should have diverged", function()
    c:run { lattice = { 1, 1, 1 }, diverges = { "speed" } }
  end)
  -- a step beyond the bound
  t:raises("energy of a passive scene rises", function()
    c:run { lattice = { 3, 3, 3 }, time_step = 2e-3, duration = 0.03, max_speed = 1e30,
      max_stretch = 1e15, center = false, place = function(_, velocities)
        for i = 1, #velocities do velocities[i] = { math.sin(9 * i), 0, math.cos(7 * i) } end
      end }
  end)
end)

suite:test("work_precision: the error in the air falls with the square of the step", function(t)
  local result = require("limax.tools.bench.work_precision").run {
    device = engine.device "cpu", say = function() end }
  local errors = {}
  for _, row in ipairs(result.rows) do
    t:ok(row.status == "done" and row.error and row.seconds_per_second > 0 or row.reason
      or row.status == "diverged", row.scene)
    if row.scene == "muscles in the air" and row.integrator == "leapfrog"
      and row.precision == "double" and not row.tier then
      errors[row.time_step] = row.error
    end
  end
  t:near(errors[2e-4] / errors[1e-4], 4, { rtol = 0.1 })
end)

-- ---- accuracy -----------------------------------------------------------------------------------

suite:test("Kendall's tau, against pairs counted one by one", function(t)
  local function tau(a, b) return ranking.kendall_tau(a, b, 4) end
  t:equal(tau({ 1, 2, 3, 4 }, { 10, 20, 30, 40 }), 1)
  t:equal(tau({ 1, 2, 3, 4 }, { 4, 3, 2, 1 }), -1)
  -- of the six pairs only (2, 3) is in the other order: (5 - 1) / 6
  t:near(tau({ 1, 2, 3, 4 }, { 1, 3, 2, 4 }), 4 / 6)
  -- b ties 2 and 3: five pairs are untied in both, all in the same order: 5 / sqrt(6 x 5)
  t:near(tau({ 1, 2, 3, 4 }, { 1, 2, 2, 4 }), 5 / math.sqrt(30))
  -- one that failed ranks last, two that failed are equal
  t:equal(tau({ 1, 2, 3, 4 }, { nil, 2, 3, 4 }), 1)
  t:near(tau({ 1, 2, 3, 4 }, { nil, nil, 3, 4 }), 5 / math.sqrt(30))
  t:equal(tau({ 1, 1, 1, 1 }, { 1, 2, 3, 4 }), nil)
end)

suite:test("elites, overlap and elite regret, by hand", function(t)
  local reference = { 5, 1, 4, 2, 3, 0, 0, 0, 0, 0 }
  t:equal(ranking.elites(reference, 10, 0.3), { 1, 3, 5 })
  t:equal(ranking.elites({ 1, 1, nil, 2 }, 4, 0.5), { 4, 1 })
  t:equal(ranking.elites({ 1, 2 }, 2, 0.1), { 2 })
  t:equal(ranking.elites({}, 3, 0.3), {})
  -- the cheap scores take robots 1, 3 and 4 for 1, 3 and 5: 12 becomes 11
  local cheap = { 9, 0, 8, 7, 6, 0, 0, 0, 0, 0 }
  t:near(ranking.overlap(reference, cheap, 10, 0.3), 2 / 3)
  t:near(ranking.elite_regret(reference, cheap, 10, 0.3), 1 / 12)
  t:equal(ranking.elite_regret(reference, reference, 10, 0.3), 0)
  -- only one did not fail: the missing elites count as the worst robot, 0
  t:near(ranking.elite_regret(reference, { nil, nil, 3 }, 10, 0.3), 8 / 12)
  -- one that fails under the reference counts as its worst, 1
  t:near(ranking.elite_regret({ 4, nil, 1, 2 }, { 3, 4, 1, 2 }, 4, 0.25), 3 / 4)
  -- scores below zero: 1 of 2 is lost
  t:near(ranking.elite_regret({ -2, -3 }, { 1, 2 }, 2, 0.5), 0.5)
  t:equal(ranking.elite_regret({ 0, 0 }, { 1, 2 }, 2, 0.5), nil)
  local mean, relative = ranking.mean_error({ 1, 2, nil, 3 }, { 1.5, 2, 9, 2 }, 4)
  t:near(mean, 0.5)
  t:near(relative, 1.5 / 6)
end)

-- with a trace, so that samples are not those of a scene that records nothing
local SMALL_BODIES = { "lattice=[2,2,2]", "simulation.duration=0.3", "simulation.settle=0.1",
  "record={\"center_of_mass\":50}", "population=6", "generations=2", "genome.sigma=4" }

local SIZE = { cases = 1, robots = 6, generations = 2, reference = 1e-4, seconds = 0.002,
  set = SMALL_BODIES, settings = bench_ranking.settings({ "preview", "evolve" },
    { { "leapfrog", "compensated", 5e-3 }, { "symplectic_euler", "compensated", 5e-4 } }) }

suite:test("settings are ranked against the finest one", function(t)
  local result = accuracy.run { device = engine.device("cpu", { threads = 1 }), size = SIZE,
    say = function() end }
  -- the finest setting against itself loses nothing; at too long a step every body fails
  local by_setting = {}
  for _, row in ipairs(result.rows) do
    if row.population == "random" then by_setting[row.setting] = row end
  end
  local finest, failed = by_setting.finest, by_setting["leapfrog, compensated, 0.005 s"]
  t:equal({ finest.tau, finest.overlap, finest.distance_error, finest.elite_regret },
    { 1, 1, 0, 0 })
  t:equal({ failed.failed, failed.overlap, failed.tau }, { 6, 0 })
  t:ok(failed.elite_regret > 0 and finest.relative_to_paper > 0)
  t:equal(failed.relative_to_paper, nil)
  t:equal(by_setting.evolve.tier, "evolve")
  local euler = by_setting["symplectic Euler, compensated, 0.0005 s"]
  t:equal({ euler.status, euler.failed }, { "done", 0 })
  t:ok(euler.seconds_per_second > 0 and euler.tau and euler.distance_error > 0)
end)
