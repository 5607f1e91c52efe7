--- traps.lua: mistakes in an experiment that would otherwise change its meaning without a word.
--- Each row has a user's text and the reaction of `limax run`: it stops, or it warns and goes
--- on.

local reader = require "limax.run.reader"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "traps"

local SCRIPT = [[
local limax = require "limax"
%s
local experiment = limax.experiment {
  name = "try", lattice = { 2, 2, 2 }, population = 6, generations = 3, repetitions = 1,
  simulation = { duration = 0.5, settle = 0.1, accuracy = "preview" }, %s
}
%s
]]

-- Runs `limax run try.lua` with these fields, and expects its status and a part of its messages.
local function gives(t, status, text, fields, head, tail)
  local folder = t:folder()
  if not fields:find "^fitness" then fields = 'fitness = "distance", ' .. fields end
  assert(host.file.write_atomic(folder .. "/try.lua",
    SCRIPT:format(head or "", fields, tail or "return experiment")))
  local done = process.ends(folder, { "run", "try.lua" })
  t:ok(done.status == status, ("status %s: %s"):format(done.status, done.stderr))
  t:ok(done.stderr:find(text, 1, true), ("expected %q in: %s"):format(text, done.stderr))
  t:ok(not done.stderr:find("scripts/lib/", 1, true), done.stderr)
end

local function fitness(text) return ("fitness = function(robot) %s end"):format(text) end
local function supervisor(text) return ("supervisor = function(history) %s end"):format(text) end
local function selection(text)
  return ("selection = function(population, random) %s end"):format(text)
end

suite:test("robots are read-only", function(t)
  gives(t, 1, 'try.lua:5: a robot is read-only (assignment to "fitness")',
    fitness "robot.fitness = 7; return 1")
  gives(t, 1, "a robot is read-only", selection "population[1].fitness = 9; return 1, 2")
  -- tables that a script changes are its own copies
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/try.lua", SCRIPT:format("", fitness
    "robot.body.count.bone = 999; robot.body.size[1] = 999; return robot:distance(), { far = 1 }"
    .. ", " .. selection "population[1].measures.far = 999; return 1, 2", "return experiment")))
  t:equal(process.ends(folder, { "run", "try.lua" }).status, 0)
  for generation = 0, 2 do
    for _, row in ipairs(reader.read(folder .. "/runs/try-1"):rows(1, generation)) do
      t:ok(row.body.counts.bone ~= 999 and row.body.size[1] ~= 999)
      if row.status == "done" then t:equal(row.measures.far, 1) end
    end
  end
end)

suite:test("names that do not exist", function(t)
  gives(t, 0, 'a generation has no "bst"; did you mean "best"?',
    supervisor "return { mutation_rate = history[#history].bst }")
  gives(t, 1, 'try.lua:5: a population has no "rank"; did you mean "ranked"?',
    selection "return population.rank[1], 1")
  gives(t, 0, "", "", "", "for robots in limax.start(experiment):generations() do"
    .. " assert(not (robots.archive or robots.island or robots.state)) end return experiment")
end)

suite:test("what a script may not change", function(t)
  gives(t, 0, "a generation of the history is read-only", supervisor "history[#history].best = 9")
  -- a proposal made from the parameters of a generation is limited like any other
  gives(t, 0, "", supervisor [[
    local p = history[#history].parameters
    p.mutation_rate = 0.9
    assert(history[#history].parameters.mutation_rate < 0.9)
    return p]])
  -- the state is the last argument
  gives(t, 1, 'a random stream is read-only (assignment to "seen")',
    "survival = function(robots, state) state.seen = 1 return { 1 } end")
  gives(t, 1, "the supervisor of generation 0 changed the population's list of robots", supervisor
    "table.sort(history[#history].population, function(a, b) return a.id > b.id end)")
  gives(t, 1, "the selection of generation 0 changed population.ranked",
    selection "table.remove(population.ranked, 1) return 1, 2")
  gives(t, 1, 'try.lua:7: an experiment is read-only (assignment to "population")', "", "",
    "experiment.population = 8\nreturn experiment")
  gives(t, 1, "the loop of generation 0 changed population.ranked", "", "",
    "for robots in limax.start(experiment):generations() do robots:score().ranked[1] = 99 end")
  gives(t, 1, 'a list of robots is read-only (assignment to "state")',
    "genome = { mutation = function(robots) robots.state = {} end }")
end)

suite:test("results that say nothing", function(t)
  gives(t, 0, "all 6 scored robots of generation 0 have the fitness 1", fitness "return 1")
  gives(t, 0, "the supervisor proposed nothing in all 2 generations",
    supervisor "local proposal = { mutation_rate = 0.2 }")
  gives(t, 2, "try.lua returns several values", "", "", "return experiment, experiment")
  gives(t, 1, "breed: generation 0 was bred already", "", "",
    "for robots in limax.start(experiment):generations() do robots:breed():breed() end")
  gives(t, 2, "try.lua is a suite of tests: limax test try.lua", "",
    'require("limax.test").suite "x"', "")
end)

suite:test("fields in the wrong place or form", function(t)
  gives(t, 2, "mutation_rate: unknown field; it belongs in breeding = { mutation_rate = ... }",
    "mutation_rate = 0.1")
  gives(t, 0, "breeding.elite_fraction: the survival \"plus\" does not use it",
    'survival = "plus", breeding = { elite_fraction = 0.5 }')
  gives(t, 0, "6 of 6 robots of generation 0 have the descriptor 1 (muscle_share) beyond its range",
    'archive = { "grid", descriptors = { { "muscle_share", range = { 2, 3 } } } }')
  gives(t, 2, "a ready scene is called: scene = limax.scenes.water()", 'scene = "water"')
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/try.lua", SCRIPT:format("", 'fitness = "walk"',
    "return experiment")))
  for option, text in pairs { ["--seed=3"] = "did you mean --set seed=...?",
    ["--set=lattice=3,3,3"] = "a list is JSON: --set lattice=[3,3,3]" } do
    process.fails(t, folder, 2, { "run", "try.lua", option }, text)
  end
end)

suite:test("valid but probably unintended settings", function(t)
  for text, fields in pairs {
    ["nothing that a body can push itself off from"] = "scene = { actuation = { frequency = 5 } }",
    ["scene names ground and no gravity"] = "scene = { actuation = true, ground = true }",
    ["scene names no friction"] = "scene = { actuation = true, ground = true, gravity = true }",
    ["begins 0.1 m inside scene.ground"] = "simulation = { duration = 0.5, position = { 0, 0,"
      .. ' -0.1 }, accuracy = "preview" }',
    ["inside scene.boxes[2]"] = "scene = limax.scenes.land { boxes = { { from = { 5, 0, 0 }, to ="
      .. " { 6, 1, 1 } }, { from = { -1, -1, -1 }, to = { 0.13, 1, 0.3 } } } }",
    ["inside scene.planes[1]"] = "scene = limax.scenes.land { planes = { { normal = { 1, 0, 0 },"
      .. " offset = 0.02 } } }",
    ["inside scene.block[1]"] =
      "scene = limax.scenes.land { block = { position = { 0.1, 0, 0 } } }",
    ["the block begins 0.05 m inside scene.ground"] =
      "scene = limax.scenes.land { block = { position = { 0.6, 0, -0.05 } } }",
    ["scene.block[2] begins 0.1 m inside scene.block[1]"] = "scene = limax.scenes.land "
      .. "{ block = { { position = { 0.9, 0, 0 } }, { position = { 0.9, 0, 0.2 } } } }",
    ["the force has a slope of 1e+04 N/m in the first"] = "scene = limax.scenes.land { wall = {"
      .. ' force = "f = vec(-k * (x.x - 0.1), 0, 0);", k = 1e4, bound = { stiffness = 20 } } }',
    ["bound.damping is 0 N s/m, and the force has a slope of 5 N s/m"] = "scene ="
      .. ' limax.scenes.land { brake = { force = "f = -5 * v;", bound = { stiffness = 1 } } }',
    ["descriptor 1 (height) used 1 of 10 cells: its range is 0 to 1000"] = 'archive = { "grid",'
      .. ' descriptors = { { "height", cells = 10, range = { 0, 1000 } } } }',
    ["mutation_rate = 20 is beyond the range of 0.001 to 0.5"] =
      supervisor "return { mutation_rate = 20 }",
    ["a full body is 20 x 20 x 20 m"] =
      'simulation = { duration = 0.5, edge = 10, accuracy = "preview" }',
    ["fewer than 8 samples in a period of the muscles"] =
      'fitness = "efficiency", record = { energy = 2 }',
    ["record.center_of_mass is 2 Hz, fewer than 8"] =
      fitness "return robot:path_length()" .. ", record = { center_of_mass = 2 }",
    ["bodies fall sideways; down is -z"] =
      "scene = limax.scenes.land { gravity = { acceleration = { 0, -9.81, 0 } } }",
    ["scene.anchors hold nothing"] = "scene = limax.scenes.land { anchors = { from = { 5, 0, 0 },"
      .. " to = { 6, 1, 1 } } }",
    ["scene.anchors hold bodies where they start"] = "scene = limax.scenes.land { anchors = true }",
    ["have the same body and fitness: does the encoding read the genes?"] = [[genome = { encoding =
      { genes = 2, express = function(robots)
        for _, i in ipairs(robots) do robots:voxels(i)[1] = robots.materials:index "e" end
      end } }]],
    ["genome.crossover: the crossover changed no gene in generation 1"] =
      "genome = { crossover = function() end }",
    ["genome.mutation: the mutation changed no gene in generation 1"] = [[genome = {
      crossover = "none", mutation = function(robots)
        for _, i in ipairs(robots) do robots:genes(i):table()[1] = 7 end
      end }]],
    ["muscles never reach their amplitude"] =
      "scene = limax.scenes.land { actuation = { frequency = 3, ramp = 100 } }",
    ["breeding.mutation_rate is 0.1, and supervision.ranges.mutation_rate is { 0.2, 0.3 }"] =
      "breeding = { mutation_rate = 0.1 }, supervision = { ranges = { mutation_rate ="
      .. " { 0.2, 0.3 } } }",
    ["mutation_rate = 0.2 takes no effect: the mutation \"none\" does not use it"] =
      'genome = { mutation = "none" }, ' .. supervisor "return { mutation_rate = 0.2 }",
    ["scores depend on the order of the robots"] = "state = function() return { n = 0 } end, "
      .. "fitness = function(_, state) state.n = state.n + 1 return state.n end",
    ["survival.reference: no robot of generation 0 is better in every objective"] = 'survival = {'
      .. ' "nsga2", objectives = { "distance", "-energy" }, reference = { 500, 200 } }',
    ["no robot of generation 0 moves scene.block: its position { 5, 0, 0 }"] =
      'fitness = "carry", scene = limax.scenes.land { block = { position = { 5, 0, 0 } } }',
    ["mutation_scale ends at generation 39, and the run at 2"] =
      'supervisor = { "schedule", mutation_scale = { { 0, 0.2 }, { 39, 0.02 } } }',
    ["scene.friction is 0: on smooth ground no muscle"] =
      "scene = limax.scenes.land { friction = { static = 0, kinetic = 0 } }",
    ["trials[1].scene.friction is 0: on smooth ground no muscle"] =
      "trials = { { scene = limax.scenes.land { friction = { static = 0, kinetic = 0 } } } }",
    ["trials[1].scene replaces that of the experiment, so it lacks its damping, friction, gravity,"
      .. " ground;"] = "trials = { { scene = { wind = { velocity = { 1, 0, 0 } },"
      .. " actuation = true } }, {} }",
    ["have the fitness 0: selection cannot tell them apart; does the scene let"] =
      'fitness = "height", scene = { gravity = true, drag = true }',
    ["trials[2].scene names no friction"] =
      "trials = { {}, { scene = { ground = true, gravity = true, actuation = true } } }",
    ["scene.terrain is beside the body: along x it reaches from 1 to 1.5 m"] = "scene ="
      .. " limax.scenes.land { ground = false, terrain = { spacing = 0.5, origin = { 1, 1, 0 },"
      .. " heights = { { 0, 0 }, { 0, 0 } } } }",
    ["scene.terrain lies below scene.ground: it reaches down to -0.2 m"] = "scene ="
      .. " limax.scenes.land { terrain = { spacing = 2, origin = { -1, -1, -0.1 }, heights ="
      .. " { { 0, 0 }, { -0.1, 1 } } } }",
    ["scene.target acts only on a controller that reads target or target_distance"] =
      "scene = limax.scenes.land { target = true }",
    ["trials[1].scene.target acts only on a controller"] = "trials = { { scene ="
      .. ' limax.scenes.land { target = true, control = { signal = "a = clock_sine;" } } }, {} }',
    ["scene.control.noise changes nothing: it acts on measured sensors"] =
      'scene = limax.scenes.land { control = { noise = 0.1, signal = "a = clock_sine;" } }',
    ["scene.control.delay changes nothing"] =
      'scene = limax.scenes.land { control = { delay = 0.1, signal = "a = clock_sine;" } }',
    ["no mutation changes genes of control: they are 0 in every robot"] =
      'breeding = { control_mutation_rate = 0 }, supervisor = "fixed", scene ='
      .. ' limax.scenes.land { control = { signal = "a = g[0];" } }',
    ["genome.control_spread is 0, and no mutation"] = 'genome = { mutation = "none" }, scene ='
      .. ' limax.scenes.land { control = { signal = "a = g[0];" } }',
    ['"fitness" and "distance" are the same number, because the fitness is "distance"'] =
      'survival = { "nsga2", objectives = { "fitness", "distance" } }',
    ["scene.boxes are out of reach: the nearest is 19.8 m from the body"] =
      "scene = limax.scenes.stairs { start = 20 }",
    ["survival.share is 1 of 6 robots: only 1 of them is new in each generation"] =
      'survival = { "plus", share = 1 }',
    ["bodies are noise"] = "lattice = { 4, 2, 2 }, genome = { sigma = 100 }",
  } do
    gives(t, 0, text, fields)
  end
end)

suite:test("messages that name the range and the remedy", function(t)
  gives(t, 2, 'supervisor "schedule": mutation_scale[2] is { 20, 2 }: expected a value from 0.001'
    .. " to 1, the range of every proposal",
    'supervisor = { "schedule", mutation_scale = { { 0, 1 }, { 20, 2 } } }')
  gives(t, 2, "mutation_rate[1] is { 0, 0.3 }: expected a value from 0.001 to 0.2",
    'supervisor = { "schedule", mutation_rate = { { 0, 0.3 } } }, supervision = { ranges = {'
    .. " mutation_rate = { 0.001, 0.2 } } }")
end)

suite:test("settings that take effect give no note", function(t)
  local function quiet(fields)
    fields.fitness = "walk"
    t:equal(table.concat(limax.experiment(fields).notes), "")
  end
  local function controlled(signal, fields)
    fields.signal = signal
    return limax.scenes.land { control = fields, target = signal:find "target" and true or nil }
  end
  quiet { scene = limax.scenes.rough() }
  quiet { survival = { "nsga2", objectives = { "fitness", "distance" } } }
  quiet { scene = controlled("a = target_distance;", { noise = 0.1, delay = 0.1 }) }
  quiet { scene = controlled("a = g[0] * strain.x;", { noise = 0.1 }) }
  local idle = { control_mutation_scale = 0 }
  quiet { scene = controlled("a = g[0];", {}), breeding = idle } -- "rules" changes it
  quiet { scene = controlled("a = g[0];", {}), breeding = idle, supervisor = "fixed",
    genome = { control_spread = 0.1 } }
  quiet { scene = controlled("a = g[0];", {}), breeding = idle, supervisor = "fixed",
    genome = { mutation = function(robots) robots:control(robots[1])[1] = 1 end } }
end)

suite:test("genes of control in a scene without control", function(t)
  gives(t, 0, "! simulate: the scene has no control, so the robot's genes of control do nothing",
    "", "", 'limax.robot { voxels = "ecs", control = { 1 } }:simulate { duration = 0.1 }'
    .. " return experiment")
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/try.lua", [[require("limax").robot { voxels = "ecs",
    control = { 1 } }:simulate { duration = 0.1, scene = { gravity = true, ground = true,
    friction = true, control = { signal = "a = g[0];" } } }]]))
  t:equal(process.ends(folder, { "try.lua" }).stderr, "")
end)

suite:test("a robot by hand in a scene where its muscles cannot move it", function(t)
  local folder = t:folder()
  local function notes(voxels, scene)
    assert(host.file.write_atomic(folder .. "/try.lua", ('local limax = require "limax" for _ = 1,'
      .. ' 2 do limax.robot { voxels = %q }:simulate { duration = 0.1, scene = %s } end'):format(
      voxels, scene)))
    return process.ends(folder, { "try.lua" }).stderr
  end
  local floating = "{ actuation = { frequency = 10 } }"
  t:equal(select(2, notes("ecs", floating):gsub("scene names nothing that a body can push", "")), 1)
  t:equal(notes("bb", floating), "")
  t:ok(notes("b", "{ gravity = { acceleration = { 0, 0, -9e3 } } }"):find "bodies collapse")
  t:equal(notes("ecs", "limax.scenes.land { actuation = { frequency = 10 } }"), "")
end)

suite:test("the range of a descriptor is that of all scored robots", function(t)
  local fields = [[population = 8, fitness = function(robot) return -robot:height() end,
    archive = { "grid", descriptors = { { "height", cells = 10, range = { 0, 1000 } } } }]]
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/try.lua", SCRIPT:format("", fields,
    "return experiment")))
  local function range_of(...)
    local stderr = process.ends(folder, { "run", ... }).stderr
    local least, most = stderr:match "robots had ([%d.e-]+) to ([%d.e-]+)"
    t:ok(least and least ~= most, stderr)
    return least .. most
  end
  local whole = range_of "try.lua"
  t:equal(range_of("--resume", "runs/try-1", "--from", "1"), whole)
end)

suite:test("{ name } is the name", function(t)
  local function config(fields) return limax.experiment(fields).config end
  for name, value in pairs { fitness = "distance", selection = "tournament", survival = "plus",
    supervisor = "rules" } do
    t:equal(config { fitness = "walk", [name] = { value } },
      config { fitness = "walk", [name] = value })
  end
  -- the state is not taken for its options
  local function state() return { axis = "y" } end
  local own = limax.experiment { fitness = limax.fitness.height, state = state }
  local named = limax.experiment { fitness = "height", state = state }
  t:equal(own.config.fitness, "height")
  t:equal({ own.config.record, own.fitness.record }, { named.config.record, named.fitness.record })
end)

suite:test("random numbers of a robot go on", function(t)
  gives(t, 1, "DRAWN true", [[genome = { mutation = function(robots)
    local i = robots[1]
    error("DRAWN " .. tostring(robots:random(i):uniform() ~= robots:random(i):uniform()))
  end }]])
end)

suite:test("a run that its evaluations end, and what is no run nor robot in it", function(t)
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/try.lua",
    SCRIPT:format("", 'fitness = "distance", evaluations = 6', "return experiment")))
  local done = process.ends(folder, { "run", "try.lua" })
  t:ok(done.stdout:find("; evaluations = 6 allow 1 of 3 generations", 1, true), done.stdout)
  done = process.ends(folder, { "convert", "runs/try-1/r01/robots/g0000.npy", "x.json" })
  t:ok(done.stderr:find("limax convert runs/try-1 FILE --generation 0", 1, true), done.stderr)
  done = process.ends(folder, { "report", "runs/try-1/r01" })
  t:ok(done.stderr:find("it is a repetition of the run runs/try-1: name that", 1, true),
    done.stderr)
end)

suite:test("going through the time in which a body settles", function(t)
  local folder = t:folder()
  local function went(call)
    assert(host.file.write_atomic(folder .. "/try.lua",
      'require("limax").robot { voxels = "ee" }:begin { duration = 0.5 }' .. call))
    return process.ends(folder, { "try.lua" }).stderr
  end
  local stderr = went ":go(0.5)"
  t:ok(stderr:find("! go: the body settles for 0.5 s, and go(0.5) ends at t = 0 s", 1, true),
    stderr)
  t:equal(went ":go(0.1):go(0.4)" .. went ":go(0.6)", "")
end)

suite:test("a fitness that depends on more than the robot", function(t)
  gives(t, 1, "os.clock would make runs irreproducible", fitness "return os.clock()")
  gives(t, 1, "os.time would make runs irreproducible", fitness "return os.time()")
  gives(t, 0, "", fitness "return os.time { year = 2026, month = 1, day = 1 } * robot:distance()")
  gives(t, 1, 'a robot\'s body is read-only (assignment to "mass")',
    fitness "robot.body.mass = 1 return 1")
end)

suite:test("a function counts with the numbers and functions that it reads", function(t)
  local function scaled(by) return function(robot) return by * robot:distance() end end
  local function called(call) return function(robot) return call(robot) end end
  local function hash(call) return source.of_function(call).sha256 end
  t:equal(hash(scaled(1)), hash(scaled(1)))
  t:ok(hash(scaled(1)) ~= hash(scaled(10)))
  t:ok(hash(called(scaled(1))) ~= hash(called(scaled(10))))
  local function weighted(by) return function(robot) return by.far[1] * robot:distance() end end
  t:equal(hash(weighted { far = { 1 } }), hash(weighted { far = { 1 } }))
  t:ok(hash(weighted { far = { 1 } }) ~= hash(weighted { far = { 2 } }))
end)

suite:test("an encoding that writes no weights makes muscles that move", function(t)
  gives(t, 0, "", [[fitness = function(robot)
      assert(robot:energy().muscle_work > 0)
      return robot:distance()
    end, record = { energy = 50 }, genome = { encoding = { genes = 8, express = function(robots)
      for _, i in ipairs(robots) do
        for v = 1, 8 do robots:voxels(i)[v] = robots.materials:index "e" end
      end
    end } }]])
end)

suite:test("names and forms that are nearly right", function(t)
  gives(t, 0, "record.energy is 2 Hz, fewer than 8", "", "",
    'limax.robot { voxels = "ecs" }:simulate { duration = 1, record = { energy = 2 } }:energy()'
    .. " return experiment")
  gives(t, 2, 'scene.block: the fitness "carry" needs one', 'fitness = "carry"')
  gives(t, 1, "is not a number: calculate with its numbers", fitness
    'local path = robot:trace "center_of_mass" return path[2] - path[1]'
    .. ", record = { center_of_mass = 50 }")
  gives(t, 1, "axs: unknown field", fitness "return limax.fitness.distance(robot, { axs = 'x' })")
  gives(t, 1, "modes: standing: expected true or false", "",
    'limax.robot { voxels = "ecs" }:modes(2, { standing = "false" })')
  gives(t, 1, "duraton: unknown field; replay repeats what was", "",
    'limax.robot { voxels = "ecs" }:replay { duraton = 2 }')
  gives(t, 2, "experiment.config was changed after limax.experiment resolved it", "", "",
    "experiment.config.simulation.duration = 2 return experiment")
  gives(t, 1, "robot.trials[0]: trials count from 1", fitness "return robot.trials[0]:distance()")
  gives(t, 2, "scene: gravity: the name is taken by an effect of limax",
    'scene = { gravity = { force = "f = vec(0, 0, -m);" } }')
  gives(t, 1, "diverged: speed beyond simulation.max_speed, 0.01", "simulation = { duration = 0.5,"
    .. ' max_speed = 0.01, accuracy = "preview" }')
  gives(t, 1, "diverged (speed beyond simulation.max_speed, 0.01)", "",
    'limax.robot { voxels = "ecs" }:simulate { duration = 0.1, max_speed = 0.01 }:distance()')
  gives(t, 1, 'limax.defaults is read-only (assignment to "population")',
    "", "limax.defaults.population = 500")
  gives(t, 0, "every effect in it is false, so nothing acts", "",
    'limax.robot { voxels = "ecs" }:simulate { duration = 0.1, scene = { friction = false } }')
  gives(t, 1, "buoyancy sets the gravity of the scene: drop gravity, or buoyancy", "",
    "limax.scenes.water { buoyancy = 1, gravity = true }")
  gives(t, 1, "scenes.slope.direction: expected a number", "",
    "limax.scenes.slope { angle = 0.2, direction = 90 }")
  gives(t, 2, "fitness = function(robot) return -limax.fitness.walk(robot) end",
    'fitness = { "-walk" }')
  gives(t, 2, "genome.sigma=null", 'genome = { encoding = "direct", sigma = 0.3 }')
  gives(t, 1, 'an effect of your own has a text: { force = "..." }',
    'scene = limax.scenes.land { magnet = { forces = "f = x;" } }')
  gives(t, 1, "frequency: unknown field; it belongs in actuation = { frequency = ... }", "",
    "limax.scenes.land { frequency = 3 }")
  gives(t, 1, "is 7; expected an index from 1 to 6 (the id of a robot is not an index)",
    "survival = function() return { 7 } end")
  gives(t, 1, "elites = {} leaves out those of the survival", "", "",
    "for robots in limax.start(experiment):generations() do local pairs_of = {} for i = 1, 6 do"
    .. " pairs_of[i] = { 1, 1 } end robots:breed { parents = pairs_of } end")
  for _, text in ipairs { "robots:genes(i):copy()", "robots:parents(i)" } do
    gives(t, 1, "a mutation writes to robots:genes(i)", ("genome = { mutation = function(robots)"
      .. " for _, i in ipairs(robots) do local genes = %s genes[1] = 0 end end }"):format(text))
  end
  gives(t, 1, "try.lua:6: voxels[3]: expected a whole number from 0 to 4, got 7",
    [[genome = { encoding = { genes = 1,
    express = function(robots) for _, i in ipairs(robots) do robots:voxels(i)[3] = 7 end end } }]])
  gives(t, 1, "expected a whole number from 0 to 4, got 3.37", [[genome = { encoding = {
    genes = 1, express = function(robots) robots:voxels(robots[1])[3] = 3.37 end } }]])
  gives(t, 1, "a comma may be missing before it", 'fitness = "walk" seed = 1')
  gives(t, 1, "an `end` is missing before it", "", "if 1 then return 1 return 2")
  gives(t, 1, "it belongs in scene = { actuation = { frequency = ... } }", "",
    'limax.robot { voxels = "e" }:simulate { frequency = 5 }')
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/try.lua", SCRIPT:format("", 'fitness = "walk"',
    "return experiment")))
  process.fails(t, folder, 2, { "run", "try.lua", "--device", "gpu" }, 'did you mean "cuda"?')
  limax.robot({ voxels = "e" }):save(folder .. "/rob.json")
  process.fails(t, folder, 2, { "run", "rob.json" }, "rob.json is a robot file, not a script")
  process.fails(t, folder, 1, { "modes", "try.lua" }, "try.lua is not a robot file, which is JSON")
end)

suite:test("a robot that diverges under a force names the bound", function(t)
  gives(t, 1, "scene.far.bound: robot", [[scene = { gravity = true, far = { force =
    "f = t > 0.3 ? -1e6 * (x - vec(0, 0, -1)) : vec(0, 0, 0);", bound = { stiffness = 1 } },
    actuation = true }, genome = { require_muscle = false }]])
end)

suite:test("masses that anchors hold need no bound", function(t)
  local function simulated(force)
    local folder = t:folder()
    assert(host.file.write_atomic(folder .. "/try.lua", ([[require("limax").robot {
      voxels = "ee\nee\n\nee\nee" }:simulate { duration = 0.1, scene = { gravity = true,
      anchors = { to = { 1, 1, 0 } }, wall = { force = "%s", bound = { stiffness = 20 } } } }]])
      :format(force)))
    return process.ends(folder, { "try.lua" }).stderr
  end
  t:equal(simulated "f = x.z < 0.05 ? vec(-1e5 * x.x, 0, 0) : vec(0, 0, 0);", "")
  t:ok(simulated("f = x.z < 0.15 ? vec(-1e5 * x.x, 0, 0) : vec(0, 0, 0);"):find("1e+05", 1, true))
end)

suite:test("a body that anchors hold whole is written and read", function(t)
  local folder = t:folder()
  local held = limax.robot { voxels = "e" }:simulate { duration = 0.1, record = {},
    scene = { gravity = true, anchors = { from = { 0, 0, 0 }, to = { 2, 2, 2 } } } }
  held:save(folder .. "/held.json")
  t:equal(limax.robot(folder .. "/held.json").body.voxels, 1)
end)
