--- evolve.lua: the evolution loop on small robots: what each generation holds, the own loop, the
--- rules for fitness, selection and supervisor, elites, the ledger, and what history keeps.

local ffi = require "ffi"
local limax = require "limax"
local engine = require "limax.engine"
local host = require "limax.host"
local ledger = require "limax.ledger"
local metrics = require "limax.metrics"
local run_folder = require "limax.run_folder"
local source = require "limax.source"

local suite = require("limax.test").suite "evolve"

-- A small experiment with fields changed: a generation takes a few hundredths of a second.
local function small(fields)
  local given = { fitness = "distance", lattice = { 2, 2, 2 }, population = 6, generations = 3,
    repetitions = 1, simulation = { duration = 0.4, settle = 0.1, accuracy = "preview" },
    supervisor = "fixed" }
  for name, value in pairs(fields or {}) do given[name] = value end
  return limax.experiment(given)
end

local function silent() end

local function finished(fields, options)
  options = options or {}
  options.say = options.say or silent
  local run = limax.start(small(fields), options)
  return run:finish(), run
end

suite:test("every generation has its numbers", function(t)
  local history = finished { generations = 4 }
  t:equal(#history, 4)
  for k, entry in ipairs(history) do
    t:equal({ entry.generation, entry.repetition }, { k - 1, 1 })
    t:ok(entry.worst <= entry.median and entry.median <= entry.best)
    t:ok(entry.worst <= entry.mean and entry.mean <= entry.best)
    t:equal(entry.quantiles.q50, entry.median)
    t:ok(entry.diversity.all.hamming >= 0 and entry.diversity.all.hamming <= 1)
    t:equal(entry.scored + entry.failed.invalid + entry.failed.diverged + entry.failed.fitness, 6)
    t:equal(entry.best_standard, entry.best)
    t:equal(entry.evaluations, k == 1 and 6 or 4)
    t:equal(entry.parameters.mutation_rate, 0.1)
    -- elites are kept, so the best never falls
    t:ok(k == 1 or entry.best >= history[k - 1].best)
  end
end)

suite:test("elites are the best robots and keep their id, body and score", function(t)
  local history = finished { breeding = { elite_fraction = 0.34 } }
  for k = 2, #history do
    local before, now = history[k - 1].population, history[k].population
    for e = 1, 2 do
      local elite, old = now[e], before[before.ranked[e]]
      t:equal(elite.origin, "elite")
      t:equal({ elite.id, elite.fitness, elite.body.hash }, { old.id, old.fitness, old.body.hash })
      t:equal(elite.parents, old.parents)
    end
    for i = 3, #now do
      t:equal(now[i].origin, "bred")
      t:equal(now[i].generation, k - 1)
      t:equal(now[i].id, (k - 1) * 6 + i)
    end
  end
end)

suite:test("equal seeds give equal bits, others do not; repetitions differ", function(t)
  local first, second = finished {}, finished {}
  for k = 1, #first do t:same_bits(first[k].best, second[k].best) end
  t:ok(finished({ seed = 2 })[1].best ~= first[1].best)
  t:ok(finished({}, { repetition = 2 })[1].best ~= first[1].best)
end)

suite:test("the own loop is the standard loop written out", function(t)
  local expected = finished {}
  local experiment = small {}
  local run = limax.start(experiment, { say = silent })
  local seen = 0
  for population in run:generations() do
    population:simulate()
    population:score(function(robot) return robot:distance() end)
    local elites, pairs_of_parents = {}, {}
    for k = 1, 2 do elites[k] = population.ranked[k] end
    for k = 1, 4 do
      local random = engine.random(1, 1, "selection", population.generation + 1, 2 + k)
      pairs_of_parents[k] = { experiment.selection(population, random) }
    end
    population:breed { parents = pairs_of_parents, elites = elites }
    seen = seen + 1
  end
  t:equal(seen, 3)
  for k = 1, 3 do t:same_bits(run.history[k].best, expected[k].best) end
end)

suite:test("what an own loop leaves out is done by the experiment", function(t)
  local expected = finished {}
  local run = limax.start(small {}, { say = silent })
  for _ in run:generations() do end
  -- a run that has ended stays so
  t:equal(#run:finish(), 3)
  for k = 1, 3 do t:same_bits(run.history[k].best, expected[k].best) end
end)

suite:test("the own loop may change a rate, and history shows it", function(t)
  local run = limax.start(small {}, { say = silent })
  for population in run:generations() do population:breed { mutation_rate = 0.25 } end
  t:equal(run.history[1].parameters.mutation_rate, 0.1)
  t:equal(run.history[2].parameters.mutation_rate, 0.25)
end)

suite:test("breed refuses what does not fit", function(t)
  local function breeding(choice)
    local run = limax.start(small {}, { say = silent })
    for population in run:generations() do population:breed(choice) end
  end
  t:raises("make 3 robots; the population is 6", function()
    breeding { elites = { 1 }, parents = { { 1, 2 }, { 3, 4 } } }
  end)
  t:raises("elites[1] is 7; expected an index from 1 to 6", function()
    breeding { elites = { 7 } }
  end)
  t:raises("is 0; expected an index from 1 to 6", function()
    breeding { elites = { 1, 2 }, parents = { { 1, 2 }, { 0, 4 }, { 1, 1 }, { 1, 1 } } }
  end)
  t:raises('unknown field "elite"', function() breeding { elite = { 1 } } end)
end)

suite:test("another fitness in the own loop scores the elites again", function(t)
  local run = limax.start(small { generations = 2 }, { say = silent })
  local calls = {}
  for population in run:generations() do
    calls[population.generation] = 0
    population:score(function()
      calls[population.generation] = calls[population.generation] + 1
      return 1
    end)
  end
  t:equal(calls[0], 6)
  t:equal(calls[1], 6)
end)

suite:test("the fitness is called once for each robot that ended well", function(t)
  local calls = 0
  local history = finished { fitness = function(robot)
    calls = calls + 1
    t:equal(robot.status, "done")
    return robot:distance(), { robot.body.mass, 1 }
  end }
  local evaluations = 0
  for _, entry in ipairs(history) do evaluations = evaluations + entry.evaluations end
  t:equal(calls, evaluations)
  local robot = history[3].population[1]
  t:equal(robot.cases, { robot.body.mass, 1 })
end)

suite:test("a fitness that is wrong in the first generation stops the run", function(t)
  t:raises("robot 1 of the first generation: the fitness failed: .*nobody", function()
    finished { fitness = function() error "nobody" end }
  end)
  t:raises("the fitness returned nil, expected a number", function()
    finished { fitness = function() end }
  end)
  t:raises('the fitness returned "far", expected a number', function()
    finished { fitness = function() return "far" end }
  end)
  t:raises("cases are 3, expected a list of numbers", function()
    finished { fitness = function() return 1, 3 end }
  end)
end)

suite:test("later, and for NaN always, only that robot fails, said once", function(t)
  local said = {}
  local history = finished({ population = 20, fitness = function(robot)
    if robot.id == 3 then return 0 / 0 end
    if robot.id == 47 then error("odd", 0) end
    if robot.id == 48 then error("odd", 0) end
    return robot.id
  end }, { say = function(text) said[#said + 1] = text end })
  t:equal(history[1].failed.fitness, 1)
  t:equal(history[1].population[3].status, "failed")
  t:equal(history[1].population[3].reason, "fitness")
  t:equal(history[1].population[3].fitness, nil)
  t:equal(history[3].failed.fitness, 2)
  t:equal(#said, 2)
  t:ok(said[1]:find "returned %-?nan" and said[2]:find "odd", table.concat(said, "; "))
  -- a robot that failed is never an elite
  for _, i in ipairs(history[1].population.ranked) do t:ok(i ~= 3) end
end)

suite:test("more than a tenth of a generation failing stops the run", function(t)
  t:raises("more than a tenth of generation 0 .* failed in the fitness", function()
    finished { fitness = function(robot) return robot.id > 1 and 1 or math.huge end }
  end)
end)

suite:test("a generation without a single score stops the run and says why", function(t)
  local table_of = engine.materials("paper"):table()
  -- bone alone: no muscle anywhere
  table_of.materials = { table_of.materials[1], table_of.materials[5] }
  t:raises("generation 0: none of the 6 robots can be scored .* invalid: no muscle", function()
    finished { materials = table_of, seed = 3 }
  end)
end)

suite:test("a selection that names nobody stops the run", function(t)
  for _, index in ipairs { 0, 7, 1.5, "one" } do
    t:raises("the selection's choice for robot 3 of generation 1 is", function()
      finished { selection = function() return 1, index end }
    end)
  end
end)

suite:test("selection sees ranked robots and its own random numbers", function(t)
  local seen = {}
  finished { generations = 2, selection = function(population, random)
    local ranked = population.ranked
    t:equal(#population, 6)
    for k = 2, #ranked do
      t:ok(population[ranked[k]].fitness <= population[ranked[k - 1]].fitness)
    end
    seen[#seen + 1] = random:uniform()
    return ranked[random:integer(#ranked)], ranked[1]
  end }
  t:equal(#seen, 4)
  t:ok(seen[1] ~= seen[2])
  t:same_bits(seen[1], engine.random(1, 1, "selection", 1, 3):uniform())
end)

suite:test("a supervisor's proposal is bound by ranges and largest changes", function(t)
  local history = finished { generations = 2, supervisor = function(history)
    t:equal(#history, 1)
    return { mutation_rate = 0.4, crossover_rate = 0.5, elite_fraction = 2, population = 9,
      mutation_scale = "big", materials = { bone = { stiffness = 1 } } }, "because"
  end }
  local record, fate = history[2].ledger, {}
  t:equal(record.reason, "because")
  for _, entry in ipairs(record.entries) do fate[entry.field] = entry end
  t:equal({ fate.mutation_rate.outcome, fate.mutation_rate.applied }, { "rate-limited", 0.2 })
  t:equal({ fate.crossover_rate.outcome, fate.crossover_rate.applied }, { "accepted", 0.5 })
  t:equal(fate.elite_fraction.outcome, "rate-limited")
  t:near(fate.elite_fraction.applied, 0.4)
  t:equal(fate.population.outcome, "rejected")
  t:equal(fate.mutation_scale.outcome, "rejected")
  t:equal(fate["materials.bone.stiffness"].outcome, "rejected")
  t:equal(history[2].parameters.mutation_rate, 0.2)
end)

suite:test("a supervisor that fails costs its change, never the run", function(t)
  local said = {}
  local history = finished({ supervisor = function() error("no idea", 0) end },
    { say = function(text) said[#said + 1] = text end })
  t:equal(#history, 3)
  t:ok(history[2].ledger.reason:find "the supervisor failed: no idea")
  for _, value in ipairs { 3, "x", true } do
    history = finished { supervisor = function() return value end }
    t:ok(history[2].ledger.reason:find "the supervisor returned")
    t:equal(history[2].parameters, history[1].parameters)
  end
end)

suite:test("changed materials: elites run again, best_standard stays comparable", function(t)
  local history = finished { generations = 4, supervision = { materials = true },
    supervisor = function(history)
      if #history ~= 2 then return nil end
      return { materials = { ["soft tissue"] = { stiffness = 1200 }, e = { amplitude = 0.28 } } }
    end }
  t:equal(history[2].evaluations, 4)
  t:equal(history[3].evaluations, 6)
  t:equal(history[4].evaluations, 4)
  t:equal(history[2].best_standard, history[2].best)
  local materials = engine.materials(history[3].materials)
  t:equal(materials:get(materials:index "soft tissue").stiffness, 1200)
  t:equal(materials:get(materials:index "e").amplitude, 0.28)
  -- the champion alone under the first materials
  local champion = history[3].population[history[3].champion.index]
  local again = champion:simulate { materials = history[1].materials }
  t:same_bits(again:distance(), history[3].best_standard)
  t:same_bits(champion:simulate():distance(), history[3].best)
end)

suite:test("a run folder of an own loop holds what history holds", function(t)
  local folder = t:folder() .. "/r"
  local history = finished({}, { out = folder })
  local opened = run_folder.open(folder)
  local lines = opened:lines "metrics"
  t:equal(#lines, 3)
  for k, line in ipairs(lines) do
    t:equal(line.schema, "limax.metrics/1")
    for _, name in ipairs { "repetition", "generation", "best", "best_standard", "mean", "median",
      "worst", "diversity", "failed", "parameters" } do
      t:equal(line[name], history[k][name])
    end
  end
  local generations = opened:generations(1, 3)
  opened:close()
  t:equal(generations[3].ledger, history[3].ledger)
  local genome = history[3].population[2].genome
  local bytes = ffi.cast("const float *", generations[3].genomes) + genome:size()
  for gene = 1, genome:size() do t:same_bits(tonumber(bytes[gene - 1]), genome[gene]) end
  -- each file names its schema
  for _, name in ipairs { "config.json", "environment.json", "checkpoint", "STATUS",
    "r01/champions/g0002.json" } do
    t:ok(host.json.decode(source.read(folder .. "/" .. name)).schema:find "^limax%.%w+/1$", name)
  end
end)

suite:test("history keeps bodies and measures, lets go of genomes and traces", function(t)
  local history = finished { generations = 6 }
  local old, new = history[1].population[1], history[6].population[1]
  t:equal(#old.body.voxel, 2)
  t:ok(old.body.mass > 0 and old.body.letters and old:distance() >= 0)
  t:raises("genomes are kept for the last three generations", function() return old.genome end)
  t:raises("trace", function() old:trace "center_of_mass" end)
  t:ok(new.genome:size() > 0)
  t:ok(history[4].population[1].genome:size() > 0)
  t:equal(history[1].population.ranked[1], history[1].champion.index)
  -- an old generation is rebuilt as it was
  t:equal(history[1].population[history[1].champion.index].fitness, history[1].best)
end)

suite:test("memory outside Lua does not grow with the generations", function(t)
  local held = {}
  finished({ generations = 12 }, { on_generation = function(entry)
    collectgarbage()
    collectgarbage()
    held[entry.generation] = engine.bytes_held()
  end })
  t:ok(held[11] <= 1.05 * held[5], ("%d bytes, then %d"):format(held[5], held[11]))
end)

suite:test("ledger: each rule on its own", function(t)
  local limits = ledger.limits(30)
  local materials = engine.materials "paper"
  local list, first = {}, {}
  for i = 1, materials.count do
    list[i] = materials:get(i)
    first[list[i].name] = list[i]
  end
  local function judge(proposal, changes)
    local request = { proposal = proposal, supervisor = "test", limits = limits, materials = list,
      first = first, parameters = { mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4,
        elite_fraction = 0.3 }, allowed = { hyperparameters = true, materials = true },
      cost = function() return 1 end, first_step = 1 }
    for name, value in pairs(changes or {}) do request[name] = value end
    local parameters, fields, record = ledger.judge(request)
    local fate = {}
    for _, entry in ipairs(record.entries) do fate[entry.field] = entry end
    return fate, parameters, fields
  end
  local fate, parameters = judge { mutation_rate = 0.0001 }
  t:equal({ fate.mutation_rate.outcome, parameters.mutation_rate }, { "rate-limited", 0.05 })
  fate = judge { elite_fraction = 0.6, crossover_rate = -1 }
  t:near(fate.elite_fraction.applied, 0.4)
  t:near(fate.crossover_rate.applied, 0.2)
  fate = judge({ crossover_rate = 1.1 }, { parameters = { mutation_rate = 0.1, mutation_scale = 0.1,
    crossover_rate = 0.9, elite_fraction = 0.3 } })
  t:equal({ fate.crossover_rate.outcome, fate.crossover_rate.applied }, { "clamped", 1 })
  fate = judge { mutation_rate = 0 / 0, mutation_scale = math.huge }
  t:equal({ fate.mutation_rate.outcome, fate.mutation_scale.outcome }, { "rejected", "rejected" })
  fate = judge { mutation_raet = 0.1 }
  t:ok(fate.mutation_raet.reason:find 'did you mean "mutation_rate"')
  fate = judge { materials = { b = { stiffness = 1.1e4, mass_per_site = 2, amplitude = 0.1 },
    wood = {} } }
  t:equal(fate["materials.bone.stiffness"].applied, 1.1e4)
  t:equal(fate["materials.bone.mass_per_site"].outcome, "rejected")
  t:equal(fate["materials.bone.amplitude"].outcome, "rejected")
  t:equal(fate["materials.wood"].outcome, "rejected")
  fate = judge { materials = { e = { amplitude = 0.4, phase = 0 } } }
  t:near(fate["materials.expanding muscle.amplitude"].applied, 0.3)
  t:near(fate["materials.expanding muscle.phase"].applied, math.pi - 0.5)
  -- a set that would more than halve the step of a full body is clamped to one that halves it
  local cost = function(fields) return 1e4 / fields.bone.stiffness end
  fate = judge({ materials = { b = { stiffness = 1.2e4 } } }, { cost = cost, first_step = 1.8 })
  t:equal(fate["materials.bone.stiffness"].outcome, "clamped")
  t:ok(fate["materials.bone.stiffness"].reason:find "cost")
  t:near(fate["materials.bone.stiffness"].applied, 1e4 / 0.9, { rtol = 1e-4 })
end)

suite:test("a range of the experiment narrows what a proposal reaches", function(t)
  local history = finished { generations = 2,
    supervision = { ranges = { mutation_rate = { 0.08, 0.12 } } },
    supervisor = function() return { mutation_rate = 0.2 } end }
  t:equal(history[2].parameters.mutation_rate, 0.12)
end)

suite:test("quantiles are linear between neighbours", function(t)
  t:near(metrics.quantile({ 1, 2, 3, 4 }, 0.5), 2.5)
  t:near(metrics.quantile({ 1, 2, 3, 4 }, 0.1), 1.3)
  t:equal(metrics.quantile({ 7 }, 0.9), 7)
end)

return suite
