--- user_functions.lua: what a fitness and a supervisor of a script may read, the summary of a run,
--- and a golden walk.

local limax = require "limax"
local suite = require("limax.test").suite "user functions"

local SMALL = { "lattice=[3,3,3]", "population=6", "generations=2", "simulation.duration=0.4",
  "simulation.settle=0.1" }

-- The history of an experiment, run in memory.
local function run(experiment, changes)
  local list = { unpack(SMALL) }
  for _, change in ipairs(changes or {}) do list[#list + 1] = change end
  return limax.start(experiment:override(list), { say = function() end }):finish()
end

suite:test("a fitness sees the whole robot", function(t)
  local seen
  local history = run(limax.experiment {
    record = { center_of_mass = 50, position = 20, contact = 50, energy = 50, strain = 50 },
    fitness = function(robot)
      local center, position = robot:trace "center_of_mass", robot:trace "position"
      local energy, displacement = robot:energy(), robot:displacement()
      local mean, most = robot:strain()
      seen = { id = robot.id, parents = robot.parents, generation = robot.generation,
        status = robot.status, genes = robot.genome:size(), size = robot.body.size,
        mass = robot.body.mass, bones = robot.body.count.bone, letter = robot.body.voxel[2][2][2],
        rate = center.rate, unit = center.unit, samples = center:size(),
        masses = position:size(2), work = energy.muscle_work, rise = displacement[3],
        contact = robot:contact(), straight = robot:distance() <= robot:path_length() + 1e-9,
        height = robot:height(), speed = robot:speed(), mean = mean, most = most }
      return robot:distance(), { displacement[1], displacement[2] }
    end,
    selection = "lexicase",
  })
  t:equal(#history, 2)
  t:equal({ seen.status, seen.rate, seen.unit }, { "done", 50, "m" })
  t:equal(seen.samples, 21)
  t:equal(#seen.parents, 2)
  t:equal(seen.generation, 1)
  t:ok(seen.masses >= 8 and seen.genes > 1000 and seen.mass > 0.7 and seen.straight)
  t:ok(seen.contact >= 0 and seen.contact <= 1 and seen.most >= seen.mean and seen.work >= 0)
  t:ok((".ecsb"):find(seen.letter, 1, true) and seen.bones >= 0)
  t:equal(#history[2].population[1].cases, 2)
end)

suite:test("a supervisor reads the history, and its proposals and reasons are kept", function(t)
  local function patient(history)
    local now, before = history[#history], history[#history - 2]
    if not before then return nil, "too early" end
    t:ok(now.mean <= now.best and now.quantiles.q50 and now.diversity.all.hamming)
    t:equal(#now.population, 6)
    t:ok(now.failed.invalid >= 0 and now.materials.materials[1].kind == "empty")
    return { mutation_scale = 1.5 * now.parameters.mutation_scale }, "more"
  end
  local history = run(limax.experiment { fitness = "walk", supervisor = patient },
    { "generations=4" })
  t:equal(history[3].ledger.reason, "too early")
  t:equal(history[4].ledger.reason, "more")
  t:near(history[4].parameters.mutation_scale, 0.15)
  t:ok(#history[4].ledger.entries >= 4)
end)

suite:test("travels", { devices = "all" }, function(t)
  local robot = limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }:simulate {
    scene = limax.scenes.land(), duration = 2, device = t.device }
  t:near(robot:distance(), 0.1165, { rtol = 1e-3 })
  t:golden("travels", { com = robot:trace "center_of_mass" },
    { rtol = 1e-3, why = "short horizon, before the chaos of contact" })
end)

suite:test("the summary of a run, read from its folder", function(t)
  local folder = t:folder() .. "/run"
  local experiment = limax.experiment { fitness = "walk", name = "small" }:override(SMALL)
  limax.start(experiment, { out = folder }):finish()
  local texts = {}
  require("limax.tools.console.summary").show(folder, { color = false, ascii = true, width = 80,
    write = function(text) texts[#texts + 1] = text end })
  local text = table.concat(texts)
  for _, part in ipairs { "small: 2 generations of 6 robots", "distance, m", "body lengths/s",
    "best, generation 0", "champion, generation 1", "z=3", "champion.svg", "next:" } do
    t:ok(text:find(part, 1, true), "no " .. part)
  end
  t:equal(require("limax.host").file.exists(folder .. "/champion.svg"), "file")
  t:ok(not text:find "[\128-\255\27]")
end)
