--- robots.lua: robots by hand (letters, weights, lattice) and of genomes, robot files without loss.

local evolution = require "support.evolution"
local limax = require "limax"
local host = require "limax.host"
local process = require "support.process"
local robot_file = require "limax.robot.robot_file"
local source = require "limax.base.source"
local engine = limax.engine

local MATERIALS = engine.materials "paper"

local letters = require("limax.test").suite "letters"

letters:test("run along x, lines along y, layers along z; spaces around are ignored", function(t)
  local robot = limax.robot { voxels = "\n  ecs \n  ece\n\n \n  sbs\n  ce.\n" }
  t:equal(robot.body.size, { 3, 2, 2 })
  local voxel = robot.body.voxel
  t:equal({ voxel[1][1][1], voxel[2][1][1], voxel[3][1][1] }, { "e", "c", "s" })
  t:equal({ voxel[1][2][1], voxel[2][2][1], voxel[3][2][1] }, { "e", "c", "e" })
  t:equal({ voxel[1][1][2], voxel[2][1][2], voxel[3][2][2] }, { "s", "b", "." })
  -- likewise in the engine
  t:equal(robot.population:voxels(1):table()[2][1][2] + 1, MATERIALS:index "b")
  t:equal(robot.body.letters, "ecs\nece\n\nsbs\nce.")
  t:equal(robot.body.count, { empty = 1, ["expanding muscle"] = 4, ["contracting muscle"] = 3,
    ["soft tissue"] = 3, bone = 1 })
  t:near(robot.body.mass, 3.5)
end)

letters:test("a larger lattice is padded with empty voxels", function(t)
  local robot = limax.robot { voxels = "ec", lattice = { 3, 2, 2 } }
  t:equal(robot.body.letters, "ec.\n...\n\n...\n...")
  t:equal(robot.body.size, { 2, 1, 1 })
  t:raises("the letters need 2 x 1 x 1 voxels, it has 1 x 1 x 1",
    function() limax.robot { voxels = "ec", lattice = { 1, 1, 1 } } end)
end)

letters:test("weights are numbers, functions or tables", function(t)
  local table_of = { { { 0.25 } }, { { 0.5 } } }
  local function phase(x, y, z) return (x + 10 * y + 100 * z) / 1000 end
  local robot = limax.robot { voxels = "ec",
    weights = { stiffness = 0.5, amplitude = table_of, phase = phase } }
  local weights = robot.population:weights(1):table()
  t:near(weights, { { { { 0.5 } }, { { 0.5 } } }, table_of, { { { 0.111 } }, { { 0.112 } } } },
    { rtol = 1e-7 })
  local all = limax.robot { voxels = "ec", weights = 0.75 }
  t:equal(all.population:weights(1):table()[3][2][1][1], 0.75)
end)

letters:test("a robot has its own copy of the materials", function(t)
  local materials = engine.materials "paper"
  local robot = limax.robot { voxels = "e", materials = materials }
  local before = robot.materials:get(2).stiffness
  materials:set(2, "stiffness", 2 * before)
  t:equal(robot.materials:get(2).stiffness, before)
end)

letters:test("each mistake raises its message at the script's line", function(t)
  local mistakes = {
    { { voxels = "ecx" }, 'layer 1, line 1: unknown letter "x"; the letters are . (empty), e' },
    { { voxels = "ec\nec\n\nec" }, "layer 2 has 1 lines where layer 1 has 2" },
    { { voxels = "..\n.." }, "the body is empty" },
    { { voxels = "e", weights = { phase = 2 } }, "expected a number from 0 to 1, got 2" },
    { { voxels = "ec", weights = { stiffness = { 0.5, 1 } } },
      "weights.stiffness[1]: expected numbers as [x][y][z], got 0.5" },
    { { voxels = "e", materials = "papr" }, 'did you mean "paper"?' },
    { 5, "limax.robot: expected a table" },
  }
  for _, mistake in ipairs(mistakes) do
    local message = t:raises(mistake[2], function() limax.robot(mistake[1]) end)
    t:ok(message:match "^[^\n]*robots.lua:%d+: ", message)
  end
end)

letters:test("a second simulate keeps the settings of the first", function(t)
  local first = limax.robot { voxels = "ecs\nece" }:simulate { duration = 0.4, settle = 0.1,
    scene = limax.scenes.land { friction = false }, record = { center_of_mass = 20 } }
  local again = first:simulate()
  t:same_bits(again.record.outcome, first.record.outcome)
  local longer = first:simulate { duration = 0.8 }
  t:equal(longer:duration(), 0.8)
  t:equal(longer.context.scene.friction, nil)
  local finer = first:simulate { accuracy = "reference" }
  t:equal(finer.context.options.precision, "double")
  t:ok(finer.record.outcome.time_step < first.record.outcome.time_step)
end)

local files = require("limax.test").suite "robot files"

-- Robots of genomes, whose weights use all bits.
local function expressed()
  local encoding = engine.encoding { lattice = { 3, 2, 4 }, seed = 11 }
  local population = engine.population { count = 5, encoding = encoding }
  population:initialize()
  population:express(MATERIALS)
  return population
end

files:test("keep every bit of a robot", function(t)
  local population, folder, changed = expressed(), t:folder(), MATERIALS:copy()
  changed:set(changed:index "b", "stiffness", 1 / 3 * 1e4)
  for i = 1, population.count do
    local path = ("%s/%d.json"):format(folder, i)
    robot_file.write(path, robot_file.describe(population, i, changed, 0.07))
    local robot = limax.robot(path)
    t:same_bits(robot.population:weights(1):table(), population:weights(i):table())
    t:equal(robot.population:voxels(1):table(), population:voxels(i):table())
    t:equal(robot.body.hash, population:body(i).hash)
    t:same_bits({ robot.materials:table(), robot.description.edge }, { changed:table(), 0.07 })
    t:equal(robot.description.lattice, { 3, 2, 4 })
    -- and the same text again
    robot:save(folder .. "/again.json")
    t:equal(source.read(folder .. "/again.json"), source.read(path))
  end
end)

files:test("a scored robot and a champion's file replay to the same score", function(t)
  local experiment = evolution.small { fitness = { "distance", axis = "x" }, generations = 2 }
  local path = t:folder() .. "/champion.json"
  local folder, champion = t:folder() .. "/r", nil
  local function check(file, robot)
    local replayed, score = limax.robot(file):replay()
    t:same_bits({ replayed.fitness, score }, { robot.fitness, robot.fitness })
    t:same_bits(replayed.record.outcome, robot.record.outcome)
  end
  for population in limax.start(experiment, { out = folder }):generations() do
    population:simulate():score()
    for _, index in ipairs(population.ranked) do
      population[index]:save(path)
      check(path, population[index])
    end
    champion = population[population.ranked[1]]
    population:breed()
  end
  check(folder .. "/r01/champions/g0001.json", champion)
end)

files:test("replay notes a score that is not the one in the file", function(t)
  local folder = t:folder()
  limax.start(evolution.small { fitness = "distance", generations = 1 },
    { out = folder .. "/r" }):finish()
  local file = folder .. "/r/r01/champions/g0000.json"
  process.write(folder .. "/again.lua", ('require("limax").robot(%q):replay()'):format(file))
  t:equal(process.ends(folder, { "again.lua" }).stderr, "")
  local text = process.read(file)
  process.write(file, (text:gsub('"fitness": "distance"', '"fitness": "walk"')))
  local stderr = process.ends(folder, { "again.lua" }).stderr
  local now, before = stderr:match "lua:1: replay: the score is (%S+), and the file's is (%S+):"
  t:ok(now and now ~= before, stderr)
end)

files:test("a fitness that is a function is passed to replay", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/own.lua",
    "generations = 1, fitness = function(robot) return 3 * robot:distance() end")
  process.completes(t, folder, { "run", "own.lua", "-q", "--out", "run" })
  local champion = limax.robot(folder .. "/run/r01/champions/g0000.json")
  local text = 'dofile("RUN/scripts/own.lua").fitness.call'
  t:raises("the function at own.lua:5", function() champion:replay() end)
  t:raises(text, function() champion:replay() end)
  local law = assert(loadstring("return " .. text:gsub("RUN", folder .. "/run")))()
  local replayed, score = champion:replay { fitness = law }
  t:same_bits(replayed.fitness, score)
  local function stateful(robot, state) return state.factor * robot:distance() end
  t:raises("its fitness takes a state; pass it", function()
    champion:replay { fitness = stateful }
  end)
  local path = folder .. "/state.json"
  assert(host.file.write_atomic(path, '{ "factor": 3 }'))
  t:same_bits(champion:replay({ fitness = stateful, state = path }).fitness, score)
  t:raises("no scene of its own", function() limax.robot({ voxels = "e" }):replay() end)
end)

-- A robot's description with a change made to it.
local function damaged(change)
  local description = robot_file.describe(expressed(), 1, MATERIALS, 0.1)
  change(description)
  return host.json.encode(description)
end

files:test("a damaged file raises with file, field, value and range", function(t)
  local path = t:folder() .. "/damaged.json"
  local cases = {
    { '{ "schema": "limax.robot/1", }', "damaged.json" },
    { "5", "expected a table" },
    { damaged(function(d) d.schema = "limax.robot/9" end), 'expected "limax.robot/1"' },
    { damaged(function(d) d.lattice[1] = 0 end), "robot.lattice[1]: expected a whole number" },
    { damaged(function(d) d.lattice[1] = 4 end), "robot.weights" },
    { damaged(function(d) d.voxels[1][1] = "ex." end), 'unknown letter "x"' },
    { damaged(function(d) d.voxels[4] = nil end), "the lattice is 3 x 2 x 4 voxels" },
    { damaged(function(d) d.weights.phase[2][1][3] = 1.5 end), "weights.phase[2][1][3]: expected" },
    { damaged(function(d) d.materials.materials[2].stiffness = -1 end), "stiffness" },
    { damaged(function(d) d.fittness = "walk" end), 'did you mean "fitness"?' },
  }
  for k, case in ipairs(cases) do
    t:ok(host.file.write_atomic(path, case[1]))
    local message = t:raises(case[2], function() limax.robot(path) end)
    t:ok(message:find("damaged.json", 1, true), ("case %d: %s"):format(k, message))
  end
  t:raises("No such file", function() limax.robot(path .. "x") end)
  t:raises("robot file", function() limax.robot(t:folder()) end)
end)

local genomes = require("limax.test").suite "robot of a genome"

local LATTICE = { 3, 3, 3 }

local function first_generation()
  local experiment = limax.experiment { fitness = "walk", lattice = LATTICE, population = 6,
    generations = 2, repetitions = 2, seed = 5, genome = { sigma = 0.5, features = 8,
      hidden = { 12 } }, simulation = { duration = 0.1 } }
  local run = limax.start(experiment, { repetition = 2, device = "cpu" })
  return run:generations()()
end

local function of_genome(genome, more)
  local fields = { genome = genome, lattice = LATTICE, sigma = 0.5, features = 8, hidden = { 12 },
    seed = 5, repetition = 2 }
  for name, value in pairs(more or {}) do fields[name] = value end
  return limax.robot(fields)
end

genomes:test("genes and a random genome describe the bodies of an evolution", function(t)
  local robots = first_generation()
  for i = 1, #robots do
    t:equal(of_genome(robots[i].genome).body.hash, robots[i].body.hash)
    t:equal(of_genome("random", { individual = i }).body.hash, robots[i].body.hash)
  end
  t:equal(of_genome(robots[2].genome:table()).body.letters, robots[2].body.letters)
  t:ok(of_genome("random", { individual = 1, seed = 6 }).body.hash ~= robots[1].body.hash)
  local genes = robots[1].genome:table()
  genes[7] = 0 / 0
  t:raises("genome[7]: expected a number", function() of_genome(genes) end)
end)

genomes:test("a simulation by steps gives the bits of a whole one", function(t)
  local robot = limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }
  local options = { duration = 0.3, device = "cpu", record = { center_of_mass = 50 } }
  local walk = robot:begin(options)
  t:equal(walk.steps, 0)
  for _ = 1, 7 do walk:step(13) end
  t:equal(walk.steps, 91)
  walk:go(0.25)
  local outcome = walk.simulation:outcome(1)
  t:equal(walk.steps, 91 + math.ceil(0.25 / outcome.time_step - 1e-6))
  t:equal(walk.status, "running")
  local center, positions = walk:center(), walk:positions()
  local sum = 0
  for mass = 1, positions:size() do sum = sum + positions[mass][3] end
  t:near(center[3], sum / positions:size())
  t:equal(walk:velocities().shape, positions.shape)
  t:same_bits(walk:finish():trace("center_of_mass"):table(),
    robot:simulate(options):trace("center_of_mass"):table())
  t:equal(walk:step(5).status, "done")
  t:raises("go: expected seconds above 0, got -1", function() walk:go(-1) end)
end)
