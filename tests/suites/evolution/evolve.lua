--- evolve.lua: the evolution loop on small robots: metrics, elites, the own loop, errors of
--- fitness, selection and supervisor, and what history keeps.

local limax = require "limax"
local engine = require "limax.engine"
local fault = require "limax.engine.fault"
local together = require "limax.evolution.together"
local evolution = require "support.evolution"

local suite = require("limax.test").suite "evolve"

local small, finished, silent = evolution.small, evolution.finished, evolution.silent

-- Here no robot is scored once more at half of its step (evolution/step_check.lua).
local frictionless = { gravity = true, ground = true }

suite:test("every generation has its metrics", function(t)
  local history = finished { generations = 4 }
  t:equal(#history, 4)
  for k, entry in ipairs(history) do
    t:equal({ entry.generation, entry.repetition }, { k - 1, 1 })
    t:ok(entry.worst <= entry.median and entry.median <= entry.best)
    t:ok(entry.worst <= entry.mean and entry.mean <= entry.best)
    t:equal(entry.quantiles.q50, entry.median)
    t:ok(entry.diversity.all.hamming >= 0 and entry.diversity.all.hamming <= 1)
    t:equal(entry.scored + entry.failed.invalid + entry.failed.diverged + entry.failed.fitness, 6)
    t:equal({ entry.best_standard, entry.evaluations, entry.parameters.mutation_rate },
      { entry.best, k == 1 and 6 or 4, 0.1 })
    -- the best is an elite
    t:ok(k == 1 or entry.best >= history[k - 1].best)
  end
end)

suite:test("elites are the best robots and keep their id, body and score", function(t)
  local history = finished { breeding = { elite_fraction = 0.34 } }
  for k = 2, #history do
    local before, now = history[k - 1].population, history[k].population
    for e = 1, 2 do
      local elite, old = now[e], before[before.ranked[e]]
      t:equal({ elite.origin, elite.id, elite.fitness, elite.body.hash, elite.parents },
        { "elite", old.id, old.fitness, old.body.hash, old.parents })
    end
    for i = 3, #now do
      t:equal({ now[i].origin, now[i].generation, now[i].id }, { "bred", k - 1, (k - 1) * 6 + i })
    end
  end
end)

suite:test("the own loop is the standard loop written out, to the bit", function(t)
  local expected = finished {}
  t:ok(finished({ seed = 2 })[1].best ~= expected[1].best)
  t:ok(finished({}, { repetition = 2 })[1].best ~= expected[1].best)
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
  -- a run that has ended has nothing left to do
  t:equal(#run:finish(), 3)
  for k = 1, 3 do t:same_bits(run.history[k].best, expected[k].best) end
  -- also where it changes only a rate
  run = limax.start(small {}, { say = silent })
  for population in run:generations() do population:breed { mutation_rate = 0.25 } end
  t:equal({ run.history[1].parameters.mutation_rate, run.history[2].parameters.mutation_rate },
    { 0.1, 0.25 })
end)

suite:test("a loop may write a status of its own, and a best score of -0 stays", function(t)
  local run = limax.start(small { fitness = function() return 0 * -1 end }, { say = silent })
  for population in run:generations() do
    population:score()
    population.rows[1].status = "apart"
  end
  t:equal(run.history[3].failed.fitness, 0)
  t:equal(1 / run.history[3].best, -math.huge)
end)

suite:test("options, indices and counts that do not fit are refused", function(t)
  t:raises('evolve.lua:%d+: start.repetiton: unknown field; did you mean "repetition"?',
    function() limax.start(small {}, { repetiton = 2 }) end)
  for message, choice in pairs {
    ["make 3 robots; the population is 6"] = { elites = { 1 }, parents = { { 1, 2 }, { 3, 4 } } },
    ["elites[1] is 7; expected an index from 1 to 6"] = { elites = { 7 } },
    ["is 0; expected an index from 1 to 6"] =
      { elites = { 1, 2 }, parents = { { 1, 2 }, { 0, 4 }, { 1, 1 }, { 1, 1 } } },
    ['evolve.lua:%d+: breed.elite: unknown field; did you mean "elites"?'] = { elite = { 1 } },
  } do
    t:raises(message, function()
      local run = limax.start(small {}, { say = silent })
      for population in run:generations() do population:breed(choice) end
    end)
  end
end)

suite:test("a fitness is called once for each robot that ended well", function(t)
  local calls = 0
  local history = finished { scene = frictionless, fitness = function(robot)
    calls = calls + 1
    t:equal(robot.status, "done")
    return robot:distance()
  end }
  local evaluations = 0
  for _, entry in ipairs(history) do evaluations = evaluations + entry.evaluations end
  t:equal(calls, evaluations)
  -- another one in the own loop scores the elites again
  calls = 0
  local run = limax.start(small { generations = 2 }, { say = silent })
  for population in run:generations() do
    population:score(function()
      calls = calls + 1
      return 1
    end)
  end
  t:equal(calls, 12)
end)

suite:test("a fitness that is wrong in the first generation stops the run", function(t)
  t:raises("robot 1 of the first generation: the fitness failed: .*no robot", function()
    finished { fitness = function() error "no robot" end }
  end)
  for message, results in pairs {
    ["the fitness returned nil, expected a number"] = {},
    ["second result is 3, expected a table of cases"] = { 1, 3 },
    ['measure "way" is "far", expected a number'] = { 1, { way = "far" } },
    ['measure "my way": a name has only letters, digits and _'] = { 1, { ["my way"] = 1 } },
    ["case 3 is beyond its 1 cases: a list has no gaps"] = { 1, { 1, [3] = 2 } },
  } do
    t:raises(message, function()
      finished { fitness = function() return unpack(results) end }
    end)
  end
end)

suite:test("measures of a fitness are kept with the robot and summarised", function(t)
  local history = finished { fitness = function(robot)
    return robot:distance(), { robot.body.mass, mass = robot.body.mass, id = robot.id }
  end }
  for _, entry in ipairs(history) do
    local sum, least, count = 0, math.huge, 0
    for _, robot in ipairs(entry.population) do
      if robot.fitness then
        t:equal(robot.cases, { robot.body.mass })
        t:equal(robot.measures, { mass = robot.body.mass, id = robot.id })
        sum, least, count = sum + robot.measures.mass, math.min(least, robot.body.mass), count + 1
      end
    end
    t:near(entry.measures.mass.mean, sum / count)
    t:equal(entry.measures.mass.least, least)
    t:equal(entry.measures.id.champion, entry.champion.id)
  end
  t:equal(finished({ fitness = "distance" })[1].measures, nil)
end)

suite:test("later, and for NaN always, only that robot fails, reported once", function(t)
  local warnings = {}
  local function run(fields)
    warnings = {}
    fields.simulation = { duration = 0.5, settle = 0.1, accuracy = "preview" }
    return finished(fields, { say = function(text) warnings[#warnings + 1] = text end })
  end
  local history = run { population = 20, generations = 4, fitness = function(robot)
    if robot.id == 3 then return 0 / 0 end
    if robot.generation > 0 and robot.id % 20 > 17 then error("odd", 0) end
    return robot.id
  end }
  t:equal({ history[1].failed.fitness, history[3].failed.fitness }, { 1, 2 })
  local failed = history[1].population[3]
  t:equal({ failed.status, failed.reason, failed.fitness }, { "failed", "fitness", nil })
  -- a robot that failed is never an elite
  for _, i in ipairs(history[1].population.ranked) do t:ok(i ~= 3) end
  t:equal(#warnings, 2)
  t:ok(warnings[1]:find "returned %-?nan", warnings[1])
  t:ok(warnings[2]:find("^robot 38 of generation 1 gets no score: the fitness failed: "
    .. "in the function at .-evolve.lua:%d+: odd$"), warnings[2])
end)

suite:test("too many failures in the fitness, or no score at all, stop the run", function(t)
  t:raises("more than a tenth of generation 0 .* failed in the fitness", function()
    finished { fitness = function(robot) return robot.id > 1 and 1 or math.huge end }
  end)
  local only_bone = engine.materials("paper"):table()
  only_bone.materials = { only_bone.materials[1], only_bone.materials[5] }
  t:raises("generation 0: none of the 6 robots can be scored .* invalid: no muscle", function()
    finished { materials = only_bone, seed = 3 }
  end)
end)

suite:test("a selection that returns no index stops the run", function(t)
  for _, index in ipairs { 0, 7, 1.5, "one" } do
    t:raises("selection's choice %(.*evolve.lua:%d+%) for robot 3 of generation 1 is", function()
      finished { selection = function() return 1, index end }
    end)
  end
end)

suite:test("changed materials: elites are simulated again, best_standard is comparable", function(t)
  local history = finished { generations = 4, supervision = { materials = true },
    supervisor = function(history)
      if #history ~= 2 then return nil end
      return { materials = { ["soft tissue"] = { stiffness = 1200 }, e = { amplitude = 0.28 } } }
    end }
  t:equal({ history[2].evaluations, history[3].evaluations, history[4].evaluations }, { 4, 6, 4 })
  t:equal(history[2].best_standard, history[2].best)
  local materials = engine.materials(history[3].materials)
  t:equal(materials:get(materials:index "soft tissue").stiffness, 1200)
  t:equal(materials:get(materials:index "e").amplitude, 0.28)
  -- the champion under the first materials
  local champion = history[3].population[history[3].champion.index]
  local again = champion:simulate { materials = history[1].materials }
  t:same_bits(again:distance(), history[3].best_standard)
  t:same_bits(champion:simulate():distance(), history[3].best)
end)

suite:test("a repetition waits where the memory is enough for one at a time", function(t)
  local begin, advance, going, waited = engine.begin_together, engine.advance_together, nil, 0
  -- a device with memory for the simulations of one generation
  function engine.begin_together(simulations, seconds)
    if going and going ~= simulations[1] then
      waited = waited + 1
      fault.throw { kind = "memory", text = "CUDA: out of memory" }
    end
    going = simulations[1]
    return begin(simulations, seconds)
  end
  function engine.advance_together(simulations, seconds)
    local progress = advance(simulations, seconds)
    if progress[1].finished then going = nil end
    return progress
  end
  local experiment, bests = small { generations = 3, repetitions = 3, scene = frictionless }, {}
  together.run { repetitions = { 1, 2, 3 }, at_once = 3, on_progress = silent,
    begin = function(repetition)
      return limax.start(experiment, { repetition = repetition, say = silent,
        on_generation = function(entry)
          bests[repetition] = bests[repetition] or {}
          table.insert(bests[repetition], entry.best)
        end })
    end }
  engine.begin_together, engine.advance_together = begin, advance
  t:ok(waited > 0 and waited < 10, waited)
  for repetition = 1, 3 do
    local history = limax.start(experiment, { repetition = repetition, say = silent }):finish()
    for k, entry in ipairs(history) do t:same_bits(bests[repetition][k], entry.best) end
  end
end)

suite:test("history keeps bodies and measures, and drops genomes and traces", function(t)
  local history = finished { generations = 6 }
  local old, new = history[1].population[1], history[6].population[1]
  t:ok(#old.body.voxel == 2 and old.body.mass > 0 and old:distance() >= 0)
  t:raises("its genome is gone: a run without a folder", function() return old.genome end)
  local run = limax.start(evolution.small { generations = 6 }, { out = t:folder() .. "/kept",
    say = silent })
  local kept = run:finish()[1].population[1]
  t:equal(limax.robot(kept):replay().fitness, kept.fitness)
  t:raises("trace", function() old:trace "center_of_mass" end)
  t:ok(new.genome:size() > 0 and history[4].population[1].genome:size() > 0)
  -- an old generation is rebuilt from its text
  t:equal(history[1].population.ranked[1], history[1].champion.index)
  t:equal(history[1].population[history[1].champion.index].fitness, history[1].best)
end)

suite:test("memory does not grow with the generations of a run with a folder",
  function(t)
    local held, outside = {}, {}
    local function measure(entry)
      if entry.generation % 90 ~= 30 then return end
      jit.flush() -- compiled code does not count
      collectgarbage()
      collectgarbage()
      held[#held + 1], outside[#outside + 1] = 1024 * collectgarbage "count", engine.bytes_held()
    end
    finished({ population = 2, generations = 211, genome = { require_muscle = false },
      simulation = { duration = 0.1, settle = 0 } },
      { out = t:folder() .. "/r", on_generation = measure })
    local bytes = (held[3] - held[1]) / 180
    t:ok(bytes < 10000, ("%.0f bytes for each generation"):format(bytes))
    t:ok(outside[3] <= 1.05 * outside[1], ("%d bytes, then %d"):format(outside[1], outside[3]))
  end)
