--- NAME.lua: soft bodies learn to walk along x. A first experiment to change: every field stands
--- here with what it means; whatever is left out has a default (limax.defaults). Half a minute on
--- two cores.
--- Run it with: limax run NAME.lua
--- One field changed, without an editor: limax run NAME.lua --set population=60

local limax = require "limax"

-- What is maximised: called once for each robot that ended well. Also there: robot:speed(),
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
  genome = { sigma = 0.25, features = 16, hidden = { 32, 32 } },

  -- what acts on a body; an effect that is not named is not there. More: drag, wind, planes,
  -- spheres, boxes, terrain, anchors, self_collision, block; limax.scenes has ready scenes
  scene = {
    gravity = true,
    ground = true,
    friction = true, -- { static = 1, kinetic = 0.6 }
    damping = true,
    actuation = { frequency = 2 }, -- Hz
  },

  -- first the body settles, then its muscles work for `duration`. The tier sets integrator,
  -- precision and time step: preview, evolve, publish, reference, from quick to exact
  simulation = { settle = 0.5, duration = 4, accuracy = "evolve" }, -- s, s
  record = { center_of_mass = 50 }, -- Hz: the traces that the fitness may read

  population = 30,
  generations = 30,
  repetitions = 1, -- 3 and more tell chance from effect

  -- of a generation 0.3 go on as they are, the others are bred; each gene comes from the second
  -- parent with crossover_rate, and changes with mutation_rate by N(0, mutation_scale^2)
  breeding = { elite_fraction = 0.3, crossover_rate = 0.4, mutation_rate = 0.1,
    mutation_scale = 0.1 },

  fitness = fitness, -- or a name: "walk", "distance", "speed", "height", "efficiency"
  selection = { "tournament", size = 3 }, -- or a function (population, random) -> i, j
  supervisor = "rules", -- or "fixed", "one_fifth", "llm", or a function (history) -> proposal
}
