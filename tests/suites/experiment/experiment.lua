--- experiment.lua: `limax.experiment`: defaults, tiers, rounding, overrides, and one clear message
--- for each error.

local choice = require "limax.base.choice"
local limax = require "limax"
local host = require "limax.host"

local suite = require("limax.test").suite "experiment"

-- A small experiment with fields changed.
local function changed(fields)
  local all = { fitness = "walk", lattice = { 2, 2, 2 }, population = 6, generations = 2 }
  for name, value in pairs(fields) do all[name] = value end
  return limax.experiment(all)
end

suite:test("a tier is its parts, and an explicit field overrides one", function(t)
  local simulation = changed({ simulation = { accuracy = "preview" } }).config.simulation
  t:equal({ simulation.integrator, simulation.precision, simulation.time_step, simulation.bound },
    { "leapfrog", "single", "auto", "voxels" })
  simulation = changed({ simulation = { precision = "double" } }).config.simulation
  t:equal({ simulation.precision, simulation.time_step_most, simulation.bound_fraction },
    { "double", 2e-4, 0.45 })
  simulation = changed({ simulation = { time_step = 1e-4 } }).config.simulation
  t:equal(simulation.time_step, 1e-4)
  t:equal(simulation.bound_fraction, nil)
  simulation = changed({ simulation = { time_step = "auto" } }).config.simulation
  t:equal({ simulation.bound, simulation.bound_fraction, simulation.time_step_most },
    { nil, 0.9, 0 })
end)

suite:test("a duration is rounded up to whole samples, with a note", function(t)
  local experiment = changed { simulation = { duration = 1.01, settle = 0.05 },
    record = { center_of_mass = 50, energy = 20 } }
  -- 100 Hz is the least common multiple
  t:near(experiment.config.simulation.duration, 1.01)
  local ends = ": at %d Hz its last sample is at 1 s of 1.01 s"
  t:ok(experiment.notes[1]:find("record.center_of_mass" .. ends:format(50), 1, true))
  t:ok(experiment.notes[2]:find("record.energy" .. ends:format(20), 1, true))
  t:equal(#experiment.notes, 2)
  experiment = changed { simulation = { duration = 1.001, settle = 0.05 } }
  t:equal(experiment.config.simulation.settle, 0.05)
  t:near(experiment.config.simulation.duration, 1.02)
  t:ok(experiment.notes[1]:find "rounded up from 1.001 s to 1.02 s")
end)

suite:test("functions are recorded as file, lines and SHA-256", function(t)
  local experiment = changed { fitness = function(robot)
    return robot:distance()
  end }
  local record = experiment.config.fitness["function"]
  t:equal(record.file, "experiment.lua")
  t:equal(record.last_line, record.first_line + 2)
  t:equal(#record.sha256, 64)
  -- the configuration is plain data that JSON keeps
  t:equal(host.json.decode(host.json.encode(experiment.config)), experiment.config)
  t:equal(experiment.config.name, "experiment")
  t:ok(choice.contains(experiment.scripts, experiment.origin), "it is not among its own scripts")
end)

-- fields -> their message
local wrong = {
  { { populatoin = 3 }, 'populatoin: unknown field; did you mean "population"?' },
  { { scene = { friction = true } }, "ground" },
  { { population = 1 }, "population: expected a whole number from 2 to 1000000 (robots), got 1" },
  { { lattice = { 0, 5, 5 } }, "lattice[1]: expected a whole number from 1 (voxels), got 0" },
  { { lattice = { 5, 5 } }, "lattice: expected a list { nx, ny, nz } of voxels, got 2 entries" },
  { { breeding = { elite_fraction = 1 } }, "expected a number above 0 and below 1" },
  { { breeding = { mutation_rate = 0 / 0 } }, "mutation_rate: expected a number from 0 to 1" },
  { { simulation = { time_step = 0 } }, 'time_step: expected "auto" or a number from 1e-09 to 1' },
  { { selection = { "tournament", siez = 3 } }, 'did you mean "size"?' },
  { { supervision = { ranges = { mutation_rate = { 0, 1 } } } }, "narrowed, never widened" },
  { { seed = "18446744073709551616" }, "seed: expected a whole number" },
  { { seed = 1.5 }, "seed: expected a whole number" },
  { { seed = -1 }, "seed: expected a whole number" },
  { { name = "../x" }, "name: expected a name of letters" },
  { { 3 }, "without a name" },
}

suite:test("one clear message for each wrong field, at the caller's line", function(t)
  for _, case in ipairs(wrong) do
    local message = t:raises(case[2], function() changed(case[1]) end)
    t:ok(message:find "experiment%.lua:%d+: ", "no place in: " .. message)
    t:ok(not message:find "\n", "more than one line: " .. message)
    t:equal(select(2, pcall(changed, case[1])).status, 2)
  end
  t:raises("fitness: expected a name", function() limax.experiment {} end)
  t:raises("limax.experiment: expected a table, got nil", function() limax.experiment(nil) end)
  local box = { size = { 1, 1, 1 } }
  box.inner = { box }
  t:raises("limax.experiment.scene.boxes.1.inner.1: expected values that can be copied, got a table"
    .. " that contains itself", function() changed { scene = { boxes = { box } } } end)
end)

-- The field of a configuration at a path; materials by their names.
local function at(config, path)
  local value = config
  for step in path:gmatch "[^.]+" do
    local entry = value[tonumber(step) or step]
    for _, each in ipairs(value) do
      if type(each) == "table" and each.name == step then entry = each end
    end
    value = entry
  end
  return value
end

-- overrides, then a path and its value after them, ...
local OVERRIDES = {
  -- the other effects of the default scene stay
  { { "scene.actuation.frequency=3" }, "scene.friction.kinetic", 0.6 },
  { { "scene.friction=false" }, "scene.friction", nil },
  { { "scene.gravity.acceleration.1=1" }, "scene.gravity.acceleration", { 1, 0, -9.81 } },
  { { "scene.gravity=false", "scene.gravity.acceleration.1=1" }, "scene.gravity.acceleration",
    { 1, 0, -9.81 } },
  { { "lattice.3=7" }, "lattice", { 2, 2, 7 } },
  { { "genome.hidden.1=8" }, "genome.hidden", { 8, 32 } },
  { { "selection.size=5" }, "selection", { name = "tournament", size = 5 } },
  { { "fitness.axis=x" }, "fitness", { name = "walk", axis = "x" } },
  { { "simulation.accuracy=preview", "simulation.duration=2" }, "simulation.duration", 2 },
  -- a field of the tier is still the tier's
  { { "simulation.position.3=1", "simulation.accuracy=preview" }, "simulation.precision", "single",
    "simulation.position", { 0, 0, 1 } },
  { { "seed=18446744073709551615" }, "seed", "18446744073709551615" },
  { { "record.energy=20" }, "record.center_of_mass", 50 },
  { { "population=null" }, "population", 30 },
  { { "supervision.ranges.mutation_rate.2=0.3" }, "supervision.ranges.mutation_rate",
    { 0.001, 0.3 } },
  { { "materials.b.stiffness=3e4" }, "materials.materials.bone.stiffness", 3e4 },
  { { "materials.soft tissue.stiffness=500" }, "materials.materials.soft tissue.stiffness", 500 },
  -- the others stay, and so do changes that came before
  { { "materials.bone.stiffness=2e4", "materials.s.stiffness=800" },
    "materials.materials.bone.stiffness", 2e4, "materials.materials.soft tissue.stiffness", 800,
    "materials.materials.expanding muscle.stiffness", 2e3, "materials.name", "paper" },
}

suite:test("overrides change any field, and not the experiment itself", function(t)
  local base = changed {}
  for _, case in ipairs(OVERRIDES) do
    local config = base:override(case[1]).config
    for k = 2, #case + 1, 2 do
      if case[k] then t:equal({ case[k], at(config, case[k]) }, { case[k], case[k + 1] }) end
    end
  end
  t:equal(base.config.population, 6)
end)

-- change -> what its message holds
local wrong_overrides = {
  { "materials.bon.stiffness=1", 'there is no material "bon"; did you mean "bone"?' },
  { "materials.bone.stifness=1", 'materials: material 5 "bone": unknown field "stifness"; the' },
  { "materials.bone.stiffness=-1", "stiffness is -1" },
  { "simulation.position.4=1", "expected a list { x, y, z } in m, got 4 entries" },
  { "latice.3=2", 'did you mean "lattice"?' },
  { "population", "expected path=value" },
  { "scene..x=1", "has an empty step" },
  { "population.size=3", "population has no fields" },
}

suite:test("an override that cannot be applied is refused, with a suggestion", function(t)
  local base = changed {}
  for _, case in ipairs(wrong_overrides) do
    local message = t:raises(case[2], function() base:override { case[1] } end)
    t:ok(not message:find "\n", message)
    t:equal(select(2, pcall(base.override, base, { case[1] })).status, 2)
  end
  t:raises('did you mean "paper"?', function()
    base:override { "materials=papr", "materials.bone.stiffness=1" }
  end)
end)

local function gravity(z)
  return { gravity = { acceleration = { 0, 0, z } }, ground = true, friction = true,
    actuation = true }
end

-- fields -> their note
local NOTES = {
  { { scene = { gravity = true, ground = true, actuation = true,
    friction = { static = 0.6, kinetic = 1 } } },
    "static 0.6 is below kinetic 1" },
  { { scene = gravity(9.81) }, "points up, away from scene.ground" },
  { { scene = gravity(-9.81) }, "^none" },
  { { scene = { gravity = { acceleration = { 0, 0, 1 } }, actuation = true } }, "^none" },
  { { breeding = { mutation_rate = 0, crossover_rate = 0 } }, "copies of their" },
  { { population = 8, selection = { "tournament", size = 9 } },
    "a tournament of 9 in a population of 8" },
  -- 0.1 kg on 1000 N/m: 0.98 mm
  { { simulation = { edge = 0.0039 } }, "soft tissue %(0.1 kg%).* bodies collapse" },
  { { simulation = { edge = 0.004 } }, "^none" },
  { { scene = { drag = true, actuation = { frequency = 0.002 } } },
    "0.002 Hz, a period of 500 s, .* no muscle completes a cycle" },
  -- 1.25 s from 7.7 m, 1.2 s in all
  { { simulation = { position = { 0, 0, 7.7 }, settle = 0.2, duration = 1 } },
    "falls for 1.253 s, and a run takes 1.2 s: it never" },
  { { simulation = { position = { 0, 0, 7.7 }, velocity = { 0, 0, -1 }, settle = 0.2,
    duration = 1 } }, "^none" },
}

suite:test("valid but probably unintended settings give a note", function(t)
  for _, case in ipairs(NOTES) do
    local notes = changed(case[1]).notes
    t:ok(#notes <= 1 and (notes[1] or "none"):find(case[2]), table.concat(notes, "\n"))
  end
end)

suite:test("the paper's experiment states the paper's tables", function(t)
  local path = host.home .. "/scripts/experiments/paper.lua"
  local config = require("limax.base.script").run(path).config
  t:equal({ config.generations, config.population, config.repetitions }, { 100, 30, 3 })
  t:equal(config.lattice, { 5, 5, 5 })
  t:equal(config.breeding, { mutation_rate = 0.1, mutation_scale = 0.1, crossover_rate = 0.4,
    elite_fraction = 0.3 })
  t:equal(config.scene.gravity.acceleration, { 0, 0, -9.81 })
  t:equal(config.scene.ground, { stiffness = 1e5, damping_ratio = 0.1, height = 0 })
  t:equal(config.scene.friction, { static = 0.6, kinetic = 1.0 })
  t:equal({ config.simulation.edge, config.simulation.time_step }, { 0.1, 1e-5 })
  t:equal(config.materials, limax.engine.materials("paper"):table())
end)
