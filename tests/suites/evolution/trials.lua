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
  return evolution.small(evolution.with({ trials = three(), fitness = least }, fields))
end

local function finished(fields, options)
  return limax.start(small(fields), evolution.with({ say = evolution.silent }, options)):finish()
end

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
  t:raises("none of the 6 robots can be scored %(6 diverged: trial 2: speed beyond",
    function() robots:simulate():score() end)
  t:equal({ robots[1].status, robots[1].trials[1].status, robots[1].trials[2].reason },
    { "diverged", "done", "speed" })
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

suite:test("a resume gives the same bytes, also of random trials", function(t)
  for _, trials in ipairs { three(), random_trials } do
    evolution.resumes(t, { trials = trials, fitness = least })
  end
end)

suite:test("a champion's file replays to its score", function(t)
  local folder = t:folder() .. "/run"
  for _, fitness in ipairs { least, "distance" } do
    local out = ("%s-%s"):format(folder, type(fitness))
    local history = finished({ fitness = fitness }, { out = out })
    local robot = limax.robot(out .. "/r01/champions/g0002.json")
    local replayed, score = robot:replay { fitness = fitness }
    t:equal({ score, replayed.fitness }, { history[3].best, score })
    t:equal({ #robot:simulate().trials, #robot:simulate({ trial = 2 }).trials }, { 3, 1 })
    t:equal(robot:simulate({ trial = 3 }):distance(), replayed.trials[3]:distance())
    -- saved and read again
    for _, either in ipairs { robot, replayed } do
      either:save(out .. "-copy.json")
      t:equal(limax.robot(out .. "-copy.json"):replay({ fitness = fitness }).fitness, score)
    end
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

suite:test("report and picture show every trial", function(t)
  local base = t:folder()
  evolution.finished({ trials = { {}, { scene = ICE, duration = 0.3 } } }, { out = base .. "/a" })
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
  refused("trials: expected a list such as .* got an empty one", {})
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

suite:test("a fitness that reads only the first trial is noted", function(t)
  local warnings = {}
  finished({ fitness = function(robot) return robot:distance() end, generations = 1 },
    { say = function(words) warnings[#warnings + 1] = words end })
  local last = warnings[#warnings]
  t:ok(last:find("the fitness does not read robot.trials", 1, true), last)
end)

suite:test("--set changes a field of a trial", function(t)
  local trials = small():override({ "trials.1.scene.friction.static=3", "trials.2.duration=0.2",
    "trials.3.scene.gravity.acceleration.3=-3", "trials.2.materials.bone.stiffness=9000" })
    .config.trials
  t:equal({ trials[1].scene.friction.static, trials[2].duration }, { 3, 0.2 })
  t:equal(trials[3].scene.gravity.acceleration, { 0, 0, -3 })
  t:ok(trials[3].scene.ground, "the rest is the experiment's scene")
  t:equal(trials[2].materials.materials[5].stiffness, 9000)
  t:raises("trials.1.duration=2: trials is a function", function()
    small({ trials = random_trials }):override { "trials.1.duration=2" }
  end)
end)
