--- accuracy_steps.lua: the tiers, rescored robots, and refused options.

local bench_ranking = require "limax.tools.bench.accuracy.ranking"
local engine = require "limax.engine"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local rescore = require "limax.evolution.rescore"
local source = require "limax.base.source"
local tiers = require "limax.settings.tiers"

local suite = require("limax.test").suite "accuracy_steps"

local function write(path, text) assert(host.file.write_atomic(path, text)) end

local WALKERS = [[
local limax = require "limax"
return limax.experiment {
  name = "small", lattice = { 2, 2, 2 }, population = 14, generations = 1, repetitions = 1,
  genome = { sigma = 4 }, simulation = { duration = 0.3, settle = 0.1, time_step = "auto" },
  fitness = "distance", supervisor = "fixed",
}
]]

suite:test("the chaos floor's step differs by one part in 1e4, or the least that samples allow",
  function(t)
    t:near(bench_ranking.perturbed(5e-6, 20), 0.05 / 10001, { rtol = 1e-15 })
    t:near(bench_ranking.perturbed(1e-4, 20), 0.05 / 501, { rtol = 1e-15 })
  end)

suite:test("rescored robots have the same bits under the same setting, others under another",
  function(t)
    local run = limax.start(limax.experiment { fitness = "distance", lattice = { 2, 2, 2 },
      population = 6, generations = 1, repetitions = 1, supervisor = "fixed",
      simulation = { duration = 0.3, settle = 0.1, accuracy = "preview" } },
      { device = engine.device("cpu", { threads = 1 }), say = function() end })
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

suite:test("--accuracy sets all fields of a tier", function(t)
  local folder = t:folder()
  write(folder .. "/small.lua", WALKERS)
  -- the output of a run, and the simulation of its configuration
  local function run(...)
    local done = process.completes(t, folder, { "run", "small.lua", "--device", "cpu",
      "--accuracy", "publish", "--out", ... })
    return done.stderr, host.json.decode(source.read(folder .. "/" .. (...) .. "/config.json"))
      .simulation
  end
  local stderr, simulation = run "a"
  t:ok(stderr:find("accuracy publish: leapfrog, compensated, 0.9 of each body's bound, at most "
    .. "5e-05 s\n", 1, true), stderr)
  t:equal({ simulation.accuracy, simulation.time_step_most }, { "publish", 5e-5 })
  -- --set overrides it, and then it is not a tier
  stderr = run("b", "--set", "simulation.precision=double")
  t:ok(not stderr:find("accuracy publish", 1, true), stderr)
end)

suite:test("options that do not fit are refused", function(t)
  local folder = t:folder()
  local function refused(words, text, status)
    local done = process.fails(t, folder, status, { "bench", unpack(words) }, text)
    t:equal(select(2, done.stderr:gsub("\n", "")), 1)
  end
  refused({ "effects", "--duration", "5" }, "--duration belongs to limax bench accuracy", 2)
end)

return suite
