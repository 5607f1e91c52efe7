--- task.lua: tasks, their worlds and their scores.

local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"

local suite = require("limax.test").suite "task"

suite:test("a trial's effects replace those of the experiment's scene", function(t)
  local function scenes(trial, changes)
    local experiment = limax.experiment { fitness = "walk", trials = { trial, {} },
      scene = limax.scenes.land { friction = { static = 0.8, kinetic = 0.7 } } }
    local list = experiment:override(changes or {}).trials.list
    return { list[1].scene, list[2].scene }
  end
  local list = scenes({ effects = { target = { position = { 1, 2, 0 } }, damping = false } },
    { "scene.control=reflex" })
  t:equal({ list[1].target[1].position, list[1].damping, list[1].friction }, { { 1, 2, 0 }, nil,
    list[2].friction })
  t:equal(list[1].control, list[2].control)
  t:equal(list[2].target, nil)
  t:raises("trials%[1%]: scene and effects: give a whole scene, or the effects that differ",
    function() scenes { scene = {}, effects = {} } end)
  t:raises("trials%[1%].effects: expected a table", function() scenes { effects = 1 } end)
end)

suite:test("the fitness target is how much nearer a robot is", function(t)
  local function scored(scene)
    return limax.fitness.target(limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }:simulate {
      scene = scene, duration = 1, device = "cpu" })
  end
  local ahead = scored(limax.scenes.land { target = { position = { 100, 0.1, 0 } } })
  t:near(scored(limax.scenes.land { target = { position = { -100, 0.1, 0 } } }), -ahead,
    { atol = 1e-4 })
  t:ok(math.abs(ahead) > 1e-3)
  -- the way there counts from when a goal is seen, until the next one is
  local goals = { { position = { 100, 0.1, 0 } }, { time = 0.5, position = { -100, 0.1, 0 } } }
  local robot = limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }:simulate { duration = 1,
    scene = limax.scenes.land { target = goals }, device = "cpu", record = { center_of_mass = 50 } }
  local path = robot:trace "center_of_mass"
  t:near(limax.fitness.target(robot), 2 * path[26][1] - path[1][1] - path[51][1], { atol = 1e-4 })
  t:raises("scene.target: the fitness \"target\" needs one",
    function() scored(limax.scenes.land()) end)
  t:raises("scene.target: the fitness \"target\" needs one",
    function() limax.experiment { fitness = "target" } end)
end)

suite:test("every task runs with its small budget, and its champion is scored", function(t)
  local folder = t:folder()
  local listed = process.completes(t, folder, { "task", "list" }).stdout
  for _, file in ipairs(host.file.list(host.home .. "/scripts/tasks")) do
    local name = file:match "^(.*)%.lua$"
    t:ok(listed:find(name .. " *version 1%. "), name)
    process.completes(t, folder, { "task", "run", name, "--small", "--set", "generations=2",
      "--set", "population=6", "--set", "simulation.duration=0.5", "--accuracy", "preview",
      "--controller", "network", "--out", name, "-q" })
    local scored = process.completes(t, folder, { "task", "score", name }).stdout
    local mean, spread, worlds = scored:match(name .. ", version 1, repetition 1: (%S+) %((.-)(%d+)"
      .. " worlds?%)")
    t:ok(worlds and (tonumber(worlds) <= 2 or tonumber(worlds) >= 32), scored)
    if name == "target" then
      t:equal(process.completes(t, folder, { "task", "score", name }).stdout, scored)
    end
    if worlds ~= "1" then
      local low, high = spread:match "^95 %% interval (%S+) to (%S+), $"
      t:ok(tonumber(low) <= tonumber(mean) and tonumber(mean) <= tonumber(high), scored)
    end
  end
  process.fails(t, folder, 2, { "task", "run", "targte" }, 'there is no task "targte"')
  process.write(folder .. "/own.lua", [[return require("limax").task { fitness = "walk",
    about = { measured = "x", passive = "y" } }]])
  process.fails(t, folder, 2, { "task", "run", "own.lua" },
    "own.lua: limax.task.about.fixed: is missing")
  process.fails(t, folder, 2, { "task", "score", "edge", "--small" },
    "--small belongs to limax task run")
  process.fails(t, folder, 2, { "task", "score" }, "expected list, run NAME or score DIR")
  process.fails(t, folder, 2, { "task", "run", "target", "--controller", "netwrk" },
    'did you mean "network"?')
end)
