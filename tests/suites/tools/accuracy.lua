--- accuracy.lua: what `limax bench accuracy` says of rankings and errors, held against examples
--- worked out by hand, and its files against what must be in them.

local accuracy = require "limax.tools.bench.accuracy"
local axis = require "limax.draw.chart.axis"
local bench_ranking = require "limax.tools.bench.accuracy.ranking"
local engine = require "limax.engine"
local host = require "limax.host"
local process = require "support.process"
local ranking = require "limax.base.statistics.ranking"
local sample = require "limax.base.statistics.sample"
local source = require "limax.base.source"
local targets = require "limax.tools.bench.accuracy.targets"
local tune = require "limax.tools.bench.accuracy.tune"
local work_precision = require "limax.tools.bench.accuracy.work_precision"

local suite = require("limax.test").suite "accuracy"

local function silent() end

local function write(path, text) assert(host.file.write_atomic(path, text)) end

suite:test("Kendall's tau, against pairs counted one by one", function(t)
  local function tau(a, b) return ranking.kendall_tau(a, b, 4) end
  t:equal(tau({ 1, 2, 3, 4 }, { 10, 20, 30, 40 }), 1)
  t:equal(tau({ 1, 2, 3, 4 }, { 4, 3, 2, 1 }), -1)
  -- of the six pairs the pair (2, 3) alone is in the other order: (5 - 1) / 6
  t:near(tau({ 1, 2, 3, 4 }, { 1, 3, 2, 4 }), 4 / 6)
  -- b ties 2 and 3: five pairs are told apart in both, all in the same order: 5 / sqrt(6 x 5)
  t:near(tau({ 1, 2, 3, 4 }, { 1, 2, 2, 4 }), 5 / math.sqrt(30))
  -- one that failed ranks last, two that failed are equal
  t:equal(tau({ 1, 2, 3, 4 }, { nil, 2, 3, 4 }), 1)
  t:near(tau({ 1, 2, 3, 4 }, { nil, nil, 3, 4 }), 5 / math.sqrt(30))
  t:equal(tau({ 1, 1, 1, 1 }, { 1, 2, 3, 4 }), nil)
  -- every order of four: the mean over all of them is 0
  local sum = 0
  for a = 1, 4 do
    for b = 1, 4 do
      for c = 1, 4 do
        local d = 10 - a - b - c
        if a ~= b and b ~= c and a ~= c and d ~= a and d ~= b and d ~= c then
          sum = sum + tau({ 1, 2, 3, 4 }, { a, b, c, d })
        end
      end
    end
  end
  t:near(sum, 0, { atol = 1e-12 })
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
  -- only one is left standing: the places that stay empty count as the worst robot, 0
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

local TINY = { lattice = { 2, 2, 2 }, duration = 0.1, reference = 1e-5,
  steps = { 5e-3, 1e-3, 5e-4, 2.5e-4 }, effort = { seconds = 0, runs = 2 } }

suite:test("a tiny work-precision run: errors fall with the step, failures stay", function(t)
  local result = work_precision.run { device = engine.device("cpu", { threads = 1 }), size = TINY,
    scenes = { "free" }, say = silent }
  local errors = {}
  for _, row in ipairs(result.rows) do
    if row.integrator ~= "rk4" and row.precision == "double" then
      errors[row.integrator] = errors[row.integrator] or {}
      errors[row.integrator][row.time_step] = row
    end
  end
  local euler, leapfrog = errors.symplectic_euler, errors.leapfrog
  -- far above the bound of any body: kept as a failure, without an error
  t:equal({ euler[5e-3].status, euler[5e-3].error }, { "diverged" })
  -- first order halves it, second order quarters it
  t:near(euler[5e-4].error / euler[2.5e-4].error, 2, { rtol = 0.1 })
  t:near(leapfrog[5e-4].error / leapfrog[2.5e-4].error, 4, { rtol = 0.1 })
  t:ok(leapfrog[5e-4].seconds_per_second > 0 and leapfrog[5e-4].runs == 2)
  t:ok(leapfrog[5e-4].reference_error < 1e-2 * leapfrog[2.5e-4].error)
end)

-- ---- the whole bench, tiny ----------------------------------------------------------------------

-- with a trace, so that samples are not those of a scene that records nothing
local SMALL_BODIES = { "lattice=[2,2,2]", "simulation.duration=0.3", "simulation.settle=0.1",
  "record={\"center_of_mass\":50}", "population=6", "generations=2", "genome.sigma=4" }

local SIZES = {
  work_precision = TINY,
  rounding = { lattice = { 2, 2, 2 }, duration = 0.1, steps = { 5e-4, 1e-4 }, reference = 2e-5,
    way = 0.2, way_steps = { 2e-4 }, way_reference = 5e-5, way_bodies = 2 },
  conservation = { lattice = { 2, 2, 2 }, vibration = 1e4, spin = 1e4 },
  ranking = { cases = 1, robots = 6, generations = 2, reference = 1e-4, seconds = 0.002,
    set = SMALL_BODIES, settings = bench_ranking.settings({ "preview", "evolve" },
      { { "leapfrog", "compensated", 5e-3 }, { "xpbd", "compensated", 1e-3 } }) },
  evolutions = { case = 1, seeds = 1, robots = 6, generations = 2, reference = 1e-4,
    set = SMALL_BODIES, settings = { "paper", "evolve" } },
  robustness = { filter = "free fall", blow_ups = 64, seconds = 0.02, rounds = 1 },
}

local function count_of(text, pattern) return select(2, text:gsub(pattern, "")) end

suite:test("every section leaves figures, tables and one page", { limit = 180 }, function(t)
  local folder = t:folder() .. "/out"
  local result = accuracy.run { device = engine.device("cpu", { threads = 1 }), sizes = SIZES,
    out = folder, say = function() end }
  local rows = {}
  for _, row in ipairs(result.rows) do
    rows[row.section] = rows[row.section] or {}
    table.insert(rows[row.section], row)
  end

  -- the finest setting against itself loses nothing; a step that throws every body away loses all
  local by_setting = {}
  for _, row in ipairs(rows.ranking) do
    if row.population == "random" then by_setting[row.setting] = row end
  end
  local finest, thrown = by_setting.finest, by_setting["leapfrog, compensated, 0.005 s"]
  t:equal({ finest.tau, finest.overlap, finest.distance_error, finest.elite_regret },
    { 1, 1, 0, 0 })
  t:equal({ thrown.failed, thrown.overlap, thrown.tau }, { 6, 0 })
  t:ok(thrown.elite_regret > 0 and finest.relative_to_paper > 0)
  t:equal(thrown.relative_to_paper, nil)
  t:equal(by_setting.evolve.tier, "evolve")
  local xpbd = by_setting["XPBD, compensated, 0.001 s"]
  t:equal({ xpbd.status, xpbd.failed }, { "done", 0 })
  t:ok(xpbd.seconds_per_second > 0 and xpbd.tau and xpbd.distance_error > 0)
  for _, row in ipairs(rows.rounding) do
    if row.start == 1024 then t:ok(row.same_bits, row.precision .. ": the start changed bits") end
  end
  for _, row in ipairs(rows.conservation) do
    if row.precision == "double" and row.momentum_drift then
      t:ok(row.momentum_drift < 1e-11, row.integrator)
    end
  end
  for _, row in ipairs(rows.evolutions) do
    t:ok(row.best_at_finest > 0 and row.seconds > 0, row.setting)
  end

  for k, what in ipairs { "hard cases", "blow-ups", "absent effects", "self-collision" } do
    t:equal(rows.robustness[k].what, what)
  end
  t:equal({ rows.robustness[1].count, rows.robustness[1].failed, rows.robustness[1].devices },
    { 1, 0, "cpu" })
  t:equal({ rows.robustness[2].count, rows.robustness[2].failed }, { 64, 0 })
  t:ok(rows.robustness[3].value == 0 or rows.robustness[3].reason, rows.robustness[3].value)
  t:ok(rows.robustness[4].value > 0)

  -- the files hold what was measured
  local document = assert(host.json.decode(source.read(folder .. "/accuracy.json")))
  t:equal({ document.schema, #document.rows }, { "limax.bench/1", #result.rows })
  local lines = count_of(source.read(folder .. "/accuracy.csv"), "\n")
  t:equal(lines, #result.rows + 1)
  t:equal(source.read(folder .. "/accuracy.csv"):match "^[^\n]+",
    table.concat(result.columns, ","))
  local picture = source.read(folder .. "/work_precision.svg")
  t:ok(picture:find "^<svg" and picture:find "</svg>\n$")
  for _, words in ipairs { "leapfrog, double", "Euler, single", ">evolve<", ">failed<",
    "the reference&#39;s own error", "10⁻⁶" } do
    t:ok(picture:find(words:gsub("&#39;", "'"), 1, true), words .. " is not in the figure")
  end
  -- a curve for each integrator that bodies of this build have, and precision, in each of 4 scenes
  local curves = 0
  for _, integrator in ipairs { "symplectic_euler", "leapfrog" } do
    curves = curves + (engine.names.integrator.value[integrator] and 16 or 0)
  end
  t:ok(count_of(picture, "<polyline") >= curves, count_of(picture, "<polyline"))
  local page = source.read(folder .. "/accuracy.html")
  t:equal(count_of(page, "<svg"), 6)
  t:ok(not page:find "<script" and not page:find "https?://[^w]", "the page needs others")
  t:ok(page:find("Asked, measured, met", 1, true))
  t:equal(source.read(folder .. "/elite_regret.png"):sub(2, 4), "PNG")
end)

-- Judged rows by what they are called.
local function judged(results)
  local by_name = {}
  for _, each in ipairs(targets.judge(results).rows) do by_name[each.target] = each end
  return by_name
end

suite:test("asked against measured: met, missed and not measured", function(t)
  local function row(fields)
    fields.case, fields.population, fields.robots = "walk", "random", 48
    return fields
  end
  local results = { ranking = { rows = {
    row { setting = "chaos floor", elite_regret = 0.04, tau = 0.9 },
    row { setting = "evolve", tier = "evolve", elite_regret = 0.07, tau = 0.87,
      relative_to_paper = 0.2 },
    -- what a device cannot do is no number
    { case = "carry", population = "random", setting = "every setting", status = "refused" },
  } } }
  local by_name = judged(results)
  -- twice the floor is 8 %; the floor less 0.02 is 0.88. One scene of nine may miss, and not meet
  local regret = by_name["elite regret of evolve, worst population"]
  t:equal({ regret.measured, regret.limit, regret.note }, { 0.07, 0.08, "1 of 9 scenes" })
  t:equal(regret.met, nil)
  t:equal(regret.aim_met, false)
  local tau = by_name["tau of evolve, 48 random bodies, worst scene"]
  t:equal({ tau.met, tau.aim_limit, tau.note }, { false, 0.9, "chaos floor 0.900; 1 of 9 scenes" })
  t:equal(by_name["price of evolve in the paper's"].met, false)
  local unmeasured = by_name["energy, free spin of 1e6 steps"]
  t:equal({ unmeasured.measured, unmeasured.met }, {})
  t:near(sample.median { 3, 1, 2 }, 2)
  t:near(sample.median { 4, 1, 2, 3 }, 2.5)
  t:equal(sample.median {}, nil)
end)

suite:test("a number over fewer steps than asked is not judged, and others are as they are",
  function(t)
    local function kept(steps, drift)
      return { conservation = { rows = { { scene = "vibration", integrator = "leapfrog",
        precision = "compensated", steps = steps, energy_drift = drift } } } }
    end
    local name = "energy drift, vibrating, leapfrog compensated, 1e7 steps"
    local short = judged(kept(1e5, 1e-9))[name]
    t:equal({ short.measured, short.met, short.aim_met }, { 1e-9 })
    t:ok(short.note:find("measured over 100000 steps", 1, true), short.note)
    local missed = judged(kept(1e7, -3e-5))[name]
    t:equal({ missed.measured, missed.met, missed.aim_met }, { 3e-5, true, false })
    t:equal(judged(kept(1e7, 2e-4))[name].met, false)

    local function robust(...) return { robustness = { rows = { ... } } } end
    local bodies = "random bodies that diverge at auto because of the step"
    local function search(first, count, failed)
      return { what = "blow-ups", first = first, count = count, failed = failed }
    end
    t:equal(judged(robust(search(1, 64, 0)))[bodies].met, nil)
    -- the second search looks at half of the first's again
    local two = judged(robust(search(50001, 1e5, 0), search(1, 1e5, 0)))[bodies]
    t:equal({ two.met, two.aim_met, two.note }, { true, false, "of 150000" })
    t:equal(judged(robust(search(1, 1e5, 1)))[bodies].met, false)
    t:equal(judged(robust(search(1, 1e7, 0)))[bodies].aim_met, true)
    local hard = "hard cases that fail or differ, on every device measured"
    local matrix = { what = "hard cases", devices = "cpu", count = 108, failed = 0 }
    t:equal({ judged(robust(matrix))[hard].met, judged(robust(matrix))[hard].aim_met },
      { true, true })
    matrix.failed = 1
    t:equal(judged(robust(matrix))[hard].met, false)
    t:equal(judged(robust { what = "absent effects", value = 3 })[
      "instructions a step for effects that the scene lacks"].met, false)
  end)

suite:test("instructions of each function itself, from callgrind's text", function(t)
  local lines = { "fn=(1) limax::kick<float>(int)", "12 100", "+2 5", "cfn=(2) limax::law(int)",
    "calls=7 3", "* 900", "fn=(2)", "* 40", "-1 2", "fn=(1)", "14 1" }
  local at = 0
  local costs = require("limax.tools.bench.accuracy.absent_effects").own_costs(function()
    at = at + 1
    return lines[at]
  end)
  -- what a call costs is the called one's own
  t:equal(costs, { ["limax::kick<float>(int)"] = 106, ["limax::law(int)"] = 42 })
end)

suite:test("every row of the numbers to reach is judged", function(t)
  -- what is asked of limax, twelve rows, of which six hold two numbers
  t:equal(#targets.judge({}).rows, 18)
  for _, row in ipairs(targets.judge({}).rows) do
    t:equal({ row.measured, row.met }, {})
    t:ok(row.asked or row.aim, row.target)
  end
end)

suite:test("targets count what other calls left", { limit = 60 }, function(t)
  local folder = t:folder()
  process.completes(t, folder, { "bench", "blow-ups", "--cases", "64", "--first", "65",
    "--device", "cpu", "--json", "b.json" })
  process.completes(t, folder, { "bench", "stability", "--filter", "free fall", "--device", "cpu",
    "--json", "s.json" })
  local judge = { "bench", "accuracy", "--section", "targets", "--device", "cpu", "--with" }
  local function judged_with(...)
    local words = { unpack(judge) }
    for _, word in ipairs { ... } do words[#words + 1] = word end
    return words
  end
  local done = process.completes(t, folder,
    judged_with("b.json", "--with", "s.json", "--json", "t.json"))
  t:ok(done.stdout:find("too little to tell +64 bodies alone"), done.stdout)
  t:ok(done.stdout:find("too little to tell +1 cases alone"), done.stdout)
  -- and its own rows are counted again
  process.completes(t, folder, judged_with "t.json")
  write(folder .. "/bad.json", "{}")
  for _, bad in ipairs { { "bad.json", "not what limax bench" }, { "none.json", "no such file" } }
  do
    local refused = process.ends(folder, judged_with(bad[1]))
    t:equal(refused.status, 2)
    t:ok(refused.stderr:find(bad[2], 1, true), refused.stderr)
  end
end)

suite:test("axes: decades, their labels, and places between", function(t)
  local x = axis.new({ label = "s", low = 1e-5, high = 1e-1 }, {})
  t:near(x.place(1e-3), 0.5)
  t:near(x.place(1e-9), 0)
  local texts = {}
  for _, tick in ipairs(x.ticks) do texts[#texts + 1] = tick.text end
  t:equal(texts, { "10⁻⁵", "10⁻⁴", "10⁻³", "0.01", "0.1" })
  local y = axis.new({ label = "1", linear = true, low = 0, high = 1, reversed = true }, {})
  t:near(y.place(0.25), 0.75)
end)

suite:test("the page names every column and section", function(t)
  local page, columns = source.read(host.home .. "/scripts/ACCURACY.md"), {}
  for _, name in ipairs(accuracy.SECTIONS) do
    t:ok(page:find(("| `%s` |"):format(name), 1, true), name)
    columns[#columns + 1] = require("limax.tools.bench.accuracy." .. name).COLUMNS
  end
  columns[#columns + 1], columns[#columns + 2] = targets.COLUMNS, tune.COLUMNS
  for _, list in ipairs(columns) do
    for _, column in ipairs(list) do
      t:ok(page:find(("`%s`"):format(column), 1, true), column .. " is not on the page")
    end
  end
end)

return suite
