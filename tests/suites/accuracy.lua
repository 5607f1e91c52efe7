--- accuracy.lua: what `limax bench accuracy` says of rankings, steps and tiers, held against
--- examples worked out by hand, and its files against what must be in them.

local accuracy = require "limax.bench.accuracy"
local axis = require "limax.chart.axis"
local bench_ranking = require "limax.bench.accuracy.ranking"
local defaults = require "limax.defaults"
local engine = require "limax.engine"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local ranking = require "limax.statistics.ranking"
local rescore = require "limax.rescore"
local sample = require "limax.statistics.sample"
local source = require "limax.source"
local targets = require "limax.bench.accuracy.targets"
local tiers = require "limax.tiers"
local tune = require "limax.bench.accuracy.tune"
local work_precision = require "limax.bench.accuracy.work_precision"

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
  local folder, said = t:folder() .. "/out", {}
  local result = accuracy.run { device = engine.device("cpu", { threads = 1 }), sizes = SIZES,
    out = folder, say = function(text) said[#said + 1] = text end }
  local text = table.concat(said, "\n")
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
  if os.execute "command -v rsvg-convert >/dev/null 2>&1" == 0 then
    t:equal(source.read(folder .. "/elite_regret.png"):sub(2, 4), "PNG")
  else
    t:ok(text:find("no PNG: rsvg-convert is not installed", 1, true), text)
  end
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
  local costs = require("limax.bench.accuracy.absent_effects").own_costs(function()
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

-- ---- steps and tiers ----------------------------------------------------------------------------

local WALKERS = [[
local limax = require "limax"
return limax.experiment {
  name = "small", lattice = { 2, 2, 2 }, population = 14, generations = 1, repetitions = 1,
  genome = { sigma = 4 }, simulation = { duration = 0.3, settle = 0.1, time_step = "auto" },
  fitness = "distance", supervisor = "fixed",
}
]]

suite:test("the chaos floor's step is one part in 1e4 longer or shorter, on whole samples",
  function(t)
    t:near(bench_ranking.perturbed(5e-6, 20), 0.05 / 10001, { rtol = 1e-15 })
    -- 500 steps to a sample interval: one more is the least
    t:near(bench_ranking.perturbed(1e-4, 20), 0.05 / 501, { rtol = 1e-15 })
  end)

suite:test("the step that fits is the longest below which all fit", function(t)
  local function rows(...)
    local list = {}
    for k, regret in ipairs { ... } do list[k] = { elite_regret = regret, failed = 0, name = k } end
    return list
  end
  t:equal(tune.choose(rows(0.3, 0.04, 0.01), 0, 0).name, 2)
  -- a longer step that fits by luck does not count
  t:equal(tune.choose(rows(0.01, 0.2, 0.01), 0, 0).name, 3)
  t:equal(tune.choose(rows(0.3, 0.3, 0.3), 0, 0), nil)
  -- where chaos alone loses 10 %, 20 % are as good as the reference
  local found, limit = tune.choose(rows(0.3, 0.19, 0.2), 0.1, 0)
  t:equal({ found.name, limit }, { 2, 0.2 })
  local failing = rows(0.01, 0.01)
  failing[1].failed = 1
  t:equal(tune.choose(failing, 0, 0).name, 2)
end)

suite:test("--tune prints a line that the script takes", { limit = 60 }, function(t)
  local folder = t:folder()
  write(folder .. "/small.lua", WALKERS)
  process.completes(t, folder, { "run", "small.lua", "--out", "r", "-q" })
  local done = process.completes(t, folder, { "bench", "accuracy", "--tune", "small.lua",
    "--champion", "r/r01/champions/g0000.json", "--threads", "1", "--device", "cpu", "--json",
    "t.json" })
  t:ok(done.stdout:find("13 bodies against an eighth of the step, in double", 1, true), done.stdout)
  local rows = host.json.decode(source.read(folder .. "/t.json")).rows
  t:equal(#rows, #tune.SHARES + 1)
  t:equal({ rows[2].share, rows[2].relative_price, rows[5].setting }, { 1, 1, "chaos floor" })
  -- twice 0.9 of the bound is beyond it
  t:equal({ rows[1].setting, rows[1].bound_fraction }, { "0.99 of the bound", 0.99 })
  -- a quarter of the step costs more than the step, and comes nearer
  t:ok(rows[4].relative_price > 1.5, rows[4].relative_price)
  t:ok(rows[4].time_step < 0.3 * rows[2].time_step)
  local line = done.stdout:match "\n  (simulation = %b{})\n"
  if line then
    local given = assert(loadstring("return {" .. line .. "}"))()
    t:ok(limax.experiment { fitness = "walk", simulation = given.simulation })
  else
    t:ok(done.stdout:find("no step of these keeps", 1, true), done.stdout)
  end
end)

suite:test("robots scored again: the same setting gives the same bits, another one its own",
  function(t)
    local run = limax.start(limax.experiment { fitness = "distance", lattice = { 2, 2, 2 },
      population = 6, generations = 1, repetitions = 1, supervisor = "fixed",
      simulation = { duration = 0.3, settle = 0.1, accuracy = "preview" } },
      { device = engine.device("cpu", { threads = 1 }), say = silent })
    local robots = run:generations()()
    robots:score()
    local again = rescore.population(robots, { accuracy = "preview" })
    for i, robot in ipairs(robots) do t:same_bits(again.fitness[i], robot.fitness) end
    local some = rescore.population(robots, { accuracy = "publish" }, { 2, 5 })
    t:equal({ some.robots, some.fitness[1], some.status[1] }, { 2 })
    t:near(some.time_step[2], 5e-5)
    t:ok(some.fitness[2] ~= robots[2].fitness)
    -- far above what any body bears
    local thrown = rescore.population(robots, { time_step = 0.02, integrator = "leapfrog" }, { 2 })
    t:equal({ thrown.failed, thrown.status[2], thrown.fitness[2] }, { 1, "diverged" })
    t:raises("rescore: unknown setting \"step\"", function()
      rescore.population(robots, { step = 1e-4 })
    end)
    t:raises("the population has 6", function()
      rescore.population(robots, { accuracy = "publish" }, { 7 })
    end)
  end)

suite:test("a tier is known by all of its parts", function(t)
  for _, name in ipairs(tiers.NAMES) do
    local config = limax.experiment { fitness = "walk", simulation = { accuracy = name } }.config
    t:equal(tiers.of(config.simulation), name)
    t:ok(tiers.describe(name):find(defaults.tiers[name].precision, 1, true), name)
  end
  local own = limax.experiment { fitness = "walk",
    simulation = { accuracy = "publish", precision = "double" } }.config
  t:equal(tiers.of(own.simulation), nil)
  t:equal(tiers.price(nil), "not measured here: limax bench accuracy")
  t:equal(tiers.price { elite_regret = 0.012, tau = 0.97, relative_to_paper = 0.05 },
    "elite regret 1.2 %, tau 0.970, 0.05 of the time of the paper's step")
  -- several populations: the worst regret, the least tau, the mean price
  local summary = tiers.summary { ranking = { rows = {
    { tier = "evolve", elite_regret = 0.01, tau = 0.9, relative_to_paper = 0.1,
      seconds_per_second = 1 },
    { tier = "evolve", elite_regret = 0.03, tau = 0.95, relative_to_paper = 0.3,
      seconds_per_second = 3 },
  } } }.evolve
  t:near({ summary.elite_regret, summary.tau, summary.relative_to_paper }, { 0.03, 0.9, 0.2 })
end)

-- Keeps a measurement for the CPU, as limax bench accuracy does.
local KEEP = [[
local engine, tiers = require "limax.engine", require "limax.tiers"
local device = engine.device("cpu", { threads = 1 })
print(tiers.keep(device, { publish = { elite_regret = 0.5, relative_to_paper = 0.25 } }))
print(tiers.measured(engine.device("cpu", { threads = 3 })).publish.elite_regret,
  tiers.measured(engine.device("cpu", { isa = "baseline" })))
]]

suite:test("--accuracy gives a tier whole, and says what it was measured to cost", { limit = 30 },
  function(t)
    local folder = t:folder()
    local cached = ("XDG_CACHE_HOME=%s"):format(process.quote(folder .. "/cache"))
    local function run(...)
      return process.completes(t, folder, { "run", "small.lua", "--device", "cpu", "--threads",
        "1", ... }, { before = cached }).stderr
    end
    write(folder .. "/small.lua", WALKERS)
    write(folder .. "/keep.lua", KEEP)
    local said = run("--accuracy", "publish", "--out", "a")
    t:ok(said:find("accuracy publish: leapfrog, compensated, 0.9 of each body's bound, at most "
      .. "5e-05 s; not measured here: limax bench accuracy\n", 1, true), said)
    local config = host.json.decode(source.read(folder .. "/a/config.json"))
    t:equal({ config.simulation.accuracy, config.simulation.time_step_most }, { "publish", 5e-5 })

    local done = process.completes(t, folder, { "keep.lua" }, { before = cached })
    t:ok(done.stdout:find("/cache/limax/accuracy.json\n0.5\tnil\n", 1, true), done.stdout)
    said = run("--accuracy", "publish", "--out", "b")
    t:ok(said:find("elite regret 50 %, 0.25 of the time of the paper's step\n", 1, true), said)
    -- --set has the last word, and then it is no tier
    said = run("--accuracy", "publish", "--set", "simulation.precision=double", "--out", "c")
    t:ok(not said:find("accuracy publish", 1, true), said)
    -- a damaged file is as good as none
    write(folder .. "/cache/limax/accuracy.json", "{")
    said = run("--accuracy", "publish", "--out", "d")
    t:ok(said:find("not measured here", 1, true), said)
    -- a run that goes on has the tier that it began with
    process.completes(t, folder, { "run", "--resume", "d", "--set", "generations=2", "--changed",
      "-q" }, { before = cached })
    config = host.json.decode(source.read(folder .. "/d/config.json"))
    t:equal(config.simulation.accuracy, "publish")
  end)

suite:test("looking twice: the shipped experiment saves time and runs small", { limit = 30 },
  function(t)
    local done = process.completes(t, t:folder(), {
      host.home .. "/scripts/experiments/multi_fidelity.lua", "2", "6", "0.1" })
    -- all six, then the four that are no elites; of those a share alone
    local all, twice = done.stdout:match "\n1 +%S+, +(%d+) runs in .-, +(%d+) runs in "
    t:ok(tonumber(all) == 10 and tonumber(twice) < 10 and tonumber(twice) >= 3, done.stdout)
  end)

suite:test("the page names every column and section", function(t)
  local page, columns = source.read(host.home .. "/scripts/ACCURACY.md"), {}
  for _, name in ipairs(accuracy.SECTIONS) do
    t:ok(page:find(("| `%s` |"):format(name), 1, true), name)
    columns[#columns + 1] = require("limax.bench.accuracy." .. name).COLUMNS
  end
  columns[#columns + 1], columns[#columns + 2] = targets.COLUMNS, tune.COLUMNS
  for _, list in ipairs(columns) do
    for _, column in ipairs(list) do
      t:ok(page:find(("`%s`"):format(column), 1, true), column .. " is not on the page")
    end
  end
end)

suite:test("what cannot be measured is refused", function(t)
  local folder = t:folder()
  write(folder .. "/small.lua", WALKERS)
  write(folder .. "/none.lua", "return 3")
  write(folder .. "/other.json", host.json.encode(limax.robot { voxels = "ecs\nece" }:table()))
  local function refused(words, text, status)
    local done = process.ends(folder, { "bench", unpack(words) })
    t:equal(done.status, status)
    t:ok(done.stderr:find(text, 1, true), done.stderr)
    t:equal(count_of(done.stderr, "\n"), 1)
  end
  refused({ "accuracy", "--section", "rankin" },
    '--section "rankin": unknown; did you mean "ranking"?', 2)
  refused({ "accuracy", "--section", "evolutions" }, "--section evolutions needs --full", 2)
  refused({ "accuracy", "--champion", "other.json" }, "--champion belongs to --tune FILE", 2)
  refused({ "effects", "--tune", "small.lua" }, "--tune belongs to limax bench accuracy", 2)
  refused({ "effects", "--out", "x" }, "--out belongs to limax bench accuracy", 2)
  refused({ "accuracy", "--tune", "none.lua" }, "--tune none.lua: it returns no experiment", 2)
  refused({ "accuracy", "--tune", "small.lua", "--champion", "other.json" },
    "--champion other.json: its lattice is 3x2x1, the experiment's is 2x2x2", 2)
  refused({ "accuracy", "--section", "conservation", "--out", "small.lua/x" }, "--out: ", 1)
end)

return suite
