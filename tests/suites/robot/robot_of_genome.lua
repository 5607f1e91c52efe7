--- robot_of_genome.lua: `limax.robot { genome = ... }` gives the bodies of an evolution, and a
--- simulation by steps the bits of a whole one.

local limax = require "limax"

local suite = require("limax.test").suite "robot of a genome"

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

suite:test("genes and a random genome describe the bodies of an evolution", function(t)
  local robots = first_generation()
  for i = 1, #robots do
    t:equal(of_genome(robots[i].genome).body.hash, robots[i].body.hash)
    t:equal(of_genome("random", { individual = i }).body.hash, robots[i].body.hash)
  end
  t:equal(of_genome(robots[2].genome:table()).body.letters, robots[2].body.letters)
  t:ok(of_genome("random", { individual = 1, seed = 6 }).body.hash ~= robots[1].body.hash)
end)

suite:test("a gene that is not a number is refused", function(t)
  local genes = first_generation()[1].genome:table()
  genes[7] = 0 / 0
  t:raises("genome[7]: expected a number", function() of_genome(genes) end)
end)

suite:test("a simulation by steps gives the bits of a whole one", function(t)
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
