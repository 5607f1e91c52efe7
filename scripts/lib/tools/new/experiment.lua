--- NAME.lua: soft bodies learn to walk along x. A starting point with a comment on each field;
--- fields that are left out have defaults (limax.defaults). Half a minute on two cores.
--- Run it with: limax run NAME.lua
--- Change a field without an editor: limax run NAME.lua --set population=60

local limax = require "limax"

-- The number to maximise, called once for each simulated robot. Other measures: robot:speed(),
-- :height(), :path_length(), :contact(), :energy(), :strain(), robot:trace "center_of_mass",
-- robot.body.mass, robot.body.count.bone. A second value, a list, is for lexicase selection.
local function fitness(robot)
  return robot:distance { axis = "x" } -- m
end

return limax.experiment {
  name = "NAME", -- of the run folders: runs/NAME-1, ...
  seed = 1, -- equal seeds give equal bytes
  lattice = { 4, 4, 4 }, -- voxels of 0.1 m along x, y, z
  materials = "paper", -- materials/paper.json, or a file or table of your own

  -- how genomes become bodies: a small sigma gives large pieces of one material
  genome = { sigma = 0.15, features = 16, hidden = { 32, 32 } },

  -- the effects that act on a body. Others: drag, wind, planes, spheres, boxes, terrain, anchors,
  -- self_collision, block; limax.scenes has ready scenes
  scene = {
    gravity = true,
    ground = true,
    friction = true, -- { static = 1, kinetic = 0.6 }
    damping = true,
    actuation = { frequency = 2 }, -- Hz
  },

  -- the body settles, then its muscles act for `duration`. The tier sets integrator, precision and
  -- time step: preview, evolve, publish, reference, from fast to accurate
  simulation = { settle = 0.5, duration = 4, accuracy = "evolve" }, -- s, s
  record = { center_of_mass = 50 }, -- Hz: the traces that the fitness may read

  population = 30,
  generations = 30,
  repetitions = 1, -- 3 or more to distinguish an effect from chance

  -- 0.3 of a generation survive, the others are bred: each gene comes from the second parent with
  -- crossover_rate, and changes with mutation_rate by N(0, mutation_scale^2)
  breeding = { elite_fraction = 0.3, crossover_rate = 0.4, mutation_rate = 0.1,
    mutation_scale = 0.1 },

  fitness = fitness, -- or a name: "walk", "distance", "speed", "height", "efficiency"
  selection = { "tournament", size = 3 }, -- or a function (population, random) -> i, j
  supervisor = "rules", -- or "fixed", "one_fifth", "llm", or a function (history) -> proposal
}
