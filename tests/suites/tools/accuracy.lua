--- accuracy.lua: `limax bench accuracy`: statistics of rankings against examples worked out by
--- hand, and a small run.

local accuracy = require "limax.tools.bench.accuracy"
local axis = require "limax.draw.chart.axis"
local bench_ranking = require "limax.tools.bench.accuracy.ranking"
local engine = require "limax.engine"
local host = require "limax.host"
local ranking = require "limax.base.statistics.ranking"
local source = require "limax.base.source"

local suite = require("limax.test").suite "accuracy"

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

suite:test("settings are ranked against the finest one", { limit = 180 }, function(t)
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
  local columns = {}
  for _, column in ipairs(result.columns) do columns[column] = true end
  for _, row in ipairs(result.rows) do
    for name in pairs(row) do t:ok(columns[name], name .. " has no column") end
  end
end)

suite:test("an axis of whole numbers has no ticks between them", function(t)
  for _, tick in ipairs(axis.new({ label = "bodies", whole = true }, { 13, 15 }).ticks) do
    t:equal(tick.value % 1, 0)
  end
end)

suite:test("the page names every column", function(t)
  local page = source.read(host.home .. "/scripts/ACCURACY.md")
  for _, column in ipairs(bench_ranking.COLUMNS) do
    t:ok(page:find(("`%s`"):format(column), 1, true), column .. " is not on the page")
  end
end)

return suite
