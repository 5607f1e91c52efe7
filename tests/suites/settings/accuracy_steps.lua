--- accuracy_steps.lua: the tiers and their measured cost, rescored robots, and refused options.

local bench_ranking = require "limax.tools.bench.accuracy.ranking"
local engine = require "limax.engine"
local evolution = require "support.evolution"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local rescore = require "limax.evolution.rescore"
local source = require "limax.base.source"
local tiers = require "limax.settings.tiers"

local suite = require("limax.test").suite "accuracy_steps"

suite:test("the chaos floor's step differs by one part in 1e4", function(t)
  t:near(bench_ranking.perturbed(5e-6, 20), 0.05 / 10001, { rtol = 1e-15 })
  t:near(bench_ranking.perturbed(1e-4, 20), 0.05 / 501, { rtol = 1e-15 })
end)

suite:test("rescored robots have the same bits under the same setting only", function(t)
  local run = limax.start(evolution.small { generations = 1 },
    { device = engine.device("cpu", { threads = 1 }), say = evolution.silent })
  local robots = run:generations()()
  robots:score()
  local again = rescore.population(robots, { accuracy = "preview" })
  for i, robot in ipairs(robots) do t:same_bits(again.fitness[i], robot.fitness) end
  local some = rescore.population(robots, { accuracy = "publish" }, { 2, 5 })
  t:equal({ some.robots, some.fitness[1], some.status[1] }, { 2 })
  t:near(some.time_step[2], 5e-5)
  t:ok(some.fitness[2] ~= robots[2].fitness)
  -- far above the stability bound of any body
  local thrown = rescore.population(robots, { time_step = 0.02, integrator = "leapfrog" }, { 2 })
  t:equal({ thrown.failed, thrown.status[2], thrown.fitness[2] }, { 1, "diverged" })
  t:raises("rescore: unknown setting \"step\"", function()
    rescore.population(robots, { step = 1e-4 })
  end)
end)

suite:test("a tier is recognised by all of its fields", function(t)
  for _, name in ipairs(tiers.NAMES) do
    local config = limax.experiment { fitness = "walk", simulation = { accuracy = name } }.config
    t:equal(tiers.of(config.simulation), name)
  end
  local own = limax.experiment { fitness = "walk",
    simulation = { accuracy = "publish", precision = "double" } }.config
  t:equal(tiers.of(own.simulation), nil)
end)

-- Stores a measurement for the CPU, like limax bench accuracy.
local KEEP = [[
local engine, tiers = require "limax.engine", require "limax.settings.tiers"
local device = engine.device("cpu", { threads = 1 })
print(tiers.keep(device, { publish = { elite_regret = 0.5, relative_to_paper = 0.25 } }))
print(tiers.measured(engine.device("cpu", { threads = 3 })).publish.elite_regret,
  tiers.measured(engine.device("cpu", { isa = "baseline" })))
]]

suite:test("--accuracy sets all fields of a tier, and prints its measured cost", function(t)
  local folder = t:folder()
  local cached = { before = "XDG_CACHE_HOME=" .. process.quote(folder .. "/cache") }
  evolution.script(folder .. "/small.lua",
    'genome = { sigma = 4 }, simulation = { duration = 0.3, settle = 0.1, time_step = "auto" }')
  process.write(folder .. "/keep.lua", KEEP)
  -- the output of a run, and the simulation of its configuration
  local function run(...)
    local done = process.completes(t, folder, { "run", "small.lua", "--device", "cpu",
      "--accuracy", "publish", "--out", ... }, cached)
    return done.stderr, host.json.decode(source.read(folder .. "/" .. (...) .. "/config.json"))
      .simulation
  end
  local stderr, simulation = run "a"
  t:ok(stderr:find("accuracy publish: leapfrog, compensated, 0.9 of each body's bound, at most "
    .. "5e-05 s; not measured here: limax bench accuracy\n", 1, true), stderr)
  t:equal({ simulation.accuracy, simulation.time_step_most }, { "publish", 5e-5 })

  local done = process.completes(t, folder, { "keep.lua" }, cached)
  t:ok(done.stdout:find("/cache/limax/accuracy.json\n0.5\tnil\n", 1, true), done.stdout)
  stderr = run "b"
  t:ok(stderr:find("elite regret 50 %, 0.25 of the time of the paper's step\n", 1, true), stderr)
  -- --set overrides it, and then it is not a tier
  stderr = run("c", "--set", "simulation.precision=double")
  t:ok(not stderr:find("accuracy publish", 1, true), stderr)
  -- a damaged file is ignored
  process.write(folder .. "/cache/limax/accuracy.json", "{")
  t:ok(run("d"):find("not measured here", 1, true))
end)
