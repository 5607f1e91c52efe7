--- trials.lua: robots that are simulated in several trials: values, elites, random trials, resume,
--- files that replay, and messages.

local limax = require "limax"
local process = require "support.process"
local source = require "limax.base.source"
local evolution = require "support.evolution"

local suite = require("limax.test").suite "trials"

local land = limax.scenes.land
local ICE = land { friction = false }
local HALF = limax.engine.materials("paper"):table()
for _, material in ipairs(HALF.materials) do
  material.stiffness = material.stiffness and material.stiffness / 2
end

-- Three trials that differ in scene, in settings, and in materials.
local function three()
  return { { scene = land { actuation = { frequency = 5 } } },
    { scene = ICE, position = { 0, 0, 0.05 }, duration = 0.3, record = { center_of_mass = 100 } },
    { materials = HALF } }
end

local function least(robot)
  local value = math.huge
  for _, trial in ipairs(robot.trials) do value = math.min(value, trial:distance()) end
  return value
end

local function small(fields)
  local spec = { trials = three(), fitness = least }
  for name, value in pairs(fields or {}) do spec[name] = value end
  return evolution.small(spec)
end

local function finished(fields, options)
  options = options or {}
  options.say = options.say or evolution.silent
  return limax.start(small(fields), options):finish()
end

local FILES = { "r01/metrics.jsonl", "r01/ledger.jsonl", "config.json", "r01/robots/g0002.npy",
  "r01/champions/g0002.json" }

suite:test("each trial measures what a simulation of its own would", function(t)
  local run = limax.start(small(), { say = evolution.silent })
  local robots = run:generations()()
  robots:simulate():score()
  for _, i in ipairs { robots.ranked[1], robots.ranked[#robots.ranked] } do
    local robot, body = robots[i], limax.robot(robots[i])
    t:equal(#robot.trials, 3)
    for k, trial in ipairs(robot.trials) do
      local own = three()[k]
      local again = body:simulate { scene = own.scene or limax.defaults.scene, trial = 1,
        position = own.position, duration = own.duration, materials = own.materials,
        record = own.record }
      t:equal(trial:displacement(), again:displacement())
      t:equal(trial:trace("center_of_mass"):table(), again:trace("center_of_mass"):table())
      t:equal(trial:mass() > 0 and trial.status, "done")
    end
    t:equal(robot:distance(), robot.trials[1]:distance())
    t:equal(robot.fitness, least(robot))
    t:ok(robot.trials[1]:distance() ~= robot.trials[3]:distance(), "materials differ")
  end
end)

suite:test("a named fitness is averaged, and each trial is a case", function(t)
  local history = finished { fitness = "distance", selection = "lexicase", generations = 2 }
  local robots = history[1].population
  for _, i in ipairs(robots.ranked) do
    local robot, sum = robots[i], 0
    t:equal(#robot.cases, 3)
    for k, trial in ipairs(robot.trials) do
      t:equal(robot.cases[k], trial:distance())
      sum = sum + robot.cases[k]
    end
    t:equal(robot.fitness, sum / 3)
  end
  history = finished { fitness = { "distance", cases = 2 }, generations = 1 }
  t:equal(#history[1].population[history[1].champion.index].cases, 6)
end)

suite:test("a robot is done if all trials end well", function(t)
  local trials = { {}, { max_speed = 1e-3 } }
  local run = limax.start(small { trials = trials }, { say = evolution.silent })
  local robots = run:generations()()
  t:raises("none of the 6 robots can be scored %(6 diverged: trial 2: speed%)",
    function() robots:simulate():score() end)
  t:equal(robots[1].status, "diverged")
  t:equal(robots[1].trials[1].status, "done")
  t:equal(robots[1].trials[2].reason, "speed")
end)

suite:test("elites keep their scores in the same trials only", function(t)
  local history = finished()
  t:equal(history[2].evaluations, 4)
  -- every second generation is like the one before
  local function changing(generation)
    return { {}, { position = { 0, 0, 0.01 * math.floor(generation / 2) } } }
  end
  history = finished { trials = changing, generations = 4 }
  t:equal({ history[2].evaluations, history[3].evaluations, history[4].evaluations }, { 4, 6, 4 })
  local function fewer(generation)
    return generation == 1 and { {} } or { {}, { position = { 0, 0, 0.01 } } }
  end
  history = finished { trials = fewer, fitness = function(robot) return #robot.trials end,
    generations = 3 }
  t:equal({ history[1].best, history[2].best, history[3].best }, { 2, 1, 2 })
end)

-- Heights and friction from the run's numbers.
local function random_trials(_, random)
  return { { position = { 0, 0, 0.1 * random:uniform() } },
    { scene = land { friction = { static = 1, kinetic = random:uniform() } } } }
end

suite:test("same bytes for any threads and after resume, also of random trials", function(t)
  for name, trials in pairs { list = three(), random = random_trials } do
    local one, four = t:folder() .. "/one" .. name, t:folder() .. "/four" .. name
    finished({ trials = trials }, { out = one, device = "cpu", threads = 1 })
    finished({ trials = trials }, { out = four, device = "cpu", threads = 4 })
    evolution.same_files(t, four, one, FILES)
    local broken = t:folder() .. "/broken" .. name
    local run = limax.start(small { trials = trials },
      { out = broken, device = "cpu", say = evolution.silent })
    local next_one = run:generations()
    next_one():breed()
    next_one():simulate()
    run.folder:close() -- as a killed process leaves it
    finished({ trials = trials }, { out = broken, resume = true, device = "cpu" })
    evolution.same_files(t, broken, one, FILES)
  end
end)

suite:test("a champion's file replays to its score", function(t)
  local folder = t:folder() .. "/run"
  for _, fitness in ipairs { least, "distance" } do
    local out = ("%s-%s"):format(folder, type(fitness))
    local history = finished({ fitness = fitness }, { out = out })
    local robot = limax.robot(out .. "/r01/champions/g0002.json")
    local replayed, score = robot:replay { fitness = fitness }
    t:equal(score, history[3].best)
    t:equal(replayed.fitness, score)
    t:equal(#robot:simulate().trials, 3)
    t:equal(#robot:simulate({ trial = 2 }).trials, 1)
    t:equal(robot:simulate({ trial = 3 }):distance(), replayed.trials[3]:distance())
    -- saved and read again
    replayed:save(out .. "-robot.json")
    t:equal(limax.robot(out .. "-robot.json"):replay({ fitness = fitness }).fitness, score)
    robot:save(out .. "-copy.json")
    t:equal(limax.robot(out .. "-copy.json"):replay({ fitness = fitness }).fitness, score)
    t:raises("simulate: trial: expected a whole number from 1 to 3, got 4",
      function() robot:simulate { trial = 4 } end)
  end
end)

suite:test("scores again, and under the first materials, are of all trials", function(t)
  local out, stiffness = t:folder() .. "/run", { 9000, 8000 }
  local run = limax.start(small { trials = random_trials, supervision = { materials = true },
    supervisor = function(history)
      return { materials = { bone = { stiffness = stiffness[#history] } } }
    end }, { out = out, say = evolution.silent })
  for robots in run:generations() do
    robots:score()
    local again = limax.rescore.population(robots, { accuracy = "preview" })
    for _, i in ipairs(robots.ranked) do t:equal(again.fitness[i], robots[i].fitness) end
  end
  for k, entry in ipairs(run.history) do
    local champion = limax.robot(("%s/r01/champions/g%04d.json"):format(out, k - 1))
    local first = champion:simulate { materials = run.config.materials }
    t:equal(entry.best_standard, least(first))
    t:ok(k == 1 or champion.description.materials.materials[5].stiffness ~= 10000)
  end
end)

suite:test("the commands show every trial", function(t)
  local base = t:folder()
  for _, name in ipairs { "a", "c" } do
    limax.start(evolution.small { trials = { {}, { scene = ICE, duration = 0.3 } }, name = name,
      repetitions = 2, supervisor = name == "a" and "random" or "fixed" },
      { out = base .. "/" .. name, say = evolution.silent }):finish()
  end
  local compared = process.completes(t, base, { "compare", "a", "c" }).stdout
  local champion = limax.robot(base .. "/c/r01/champions/g0002.json")
  local value = champion:simulate { accuracy = "publish" }
  local mean = (value.trials[1]:distance() + value.trials[2]:distance()) / 2
  t:ok(compared:find(("%.4g"):format(mean), 1, true), compared)
  process.completes(t, base, { "report", "a" })
  local page = source.read(base .. "/a/report.html")
  t:ok(page:find("generation 2, trial 1", 1, true) and page:find("generation 2, trial 2", 1, true))
  process.completes(t, base, { "picture", "a", "--trial", "2", "--out", "a.svg" })
  process.fails(t, base, 2, { "picture", "a", "--trial", "3", "--out", "b.svg" }, "--trial 3: ")
end)

suite:test("a wrong trial is named with its field", function(t)
  local swapped = limax.engine.materials("paper"):table()
  swapped.materials[2], swapped.materials[3] = swapped.materials[3], swapped.materials[2]
  local function refused(message, trials)
    t:raises(message, function() small { trials = trials } end)
  end
  for got, trials in pairs { ["an empty one"] = {}, ['"ice"'] = "ice",
    ["a table"] = { scene = land() } } do
    refused("trials: expected a list such as .* got " .. got, trials)
  end
  refused("trials%[1%]%.posision: unknown field; did you mean", { { posision = 1 } })
  refused("trials%[2%]%.scene%.frction: .*friction", { {}, { scene = { frction = true } } })
  refused("trials%[1%]%.materials: expected those of the experiment with other numbers",
    { { materials = swapped } })
  refused("trials: expected a list .* got nil %(the function's list for generation 0%)",
    function() end)
  t:raises("trials%[2%]: simulation: record.contact needs the effect",
    function() finished { record = { contact = 20 }, trials = { {}, { scene = {} } } } end)
  t:raises("trials%[1%]%.scen: unknown field.*list for generation 1%)", function()
    finished { trials = function(generation) return { generation > 0 and { scen = 1 } or {} } end }
  end)
end)

suite:test("notes name the trial, and a fitness that reads only the first one is noted", function(t)
  local notes = small { trials = { {}, { scene = { gravity = { acceleration = { 0, 0, 9 } },
    ground = true }, duration = 0.333 } } }.notes
  local text = table.concat(notes, "\n")
  t:ok(text:find("trials[2].duration is rounded up from 0.333 s", 1, true), text)
  t:ok(text:find("trials[2].scene.gravity: its acceleration points up", 1, true), text)
  local warnings = {}
  finished({ fitness = function(robot) return robot:distance() end, generations = 1 },
    { say = function(words) warnings[#warnings + 1] = words end })
  local last = warnings[#warnings]
  t:ok(last:find("the fitness does not read robot.trials", 1, true), last)
end)

suite:test("--set changes a field of a trial", function(t)
  local changed = small():override { "trials.1.scene.friction.static=3", "trials.2.duration=0.2",
    "trials.3.scene.gravity.acceleration.3=-3", "scene.friction.static=2",
    "trials.2.materials.bone.stiffness=9000" }
  local trials = changed.config.trials
  t:equal(trials[1].scene.friction.static, 3)
  t:equal(trials[2].duration, 0.2)
  t:equal(trials[3].scene.gravity.acceleration, { 0, 0, -3 })
  t:ok(trials[3].scene.ground, "the rest is the experiment's scene")
  t:equal(trials[2].materials.materials[5].stiffness, 9000)
  t:raises("trials.1.duration=2: trials is a function", function()
    small({ trials = random_trials }):override { "trials.1.duration=2" }
  end)
  t:raises("trials: expected a list", function() small():override { "trials.7.duration=2" } end)
end)
