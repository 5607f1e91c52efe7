--- walk.lua: soft bodies learn to walk. Shows the main use of limax: 40 generations of 30 robots on
--- flat ground, scored by the distance of the second half of five seconds, so that falling over
--- does not count. One repetition; about 40 seconds on two cores.
--- Run it with: limax run scripts/experiments/walk.lua

local limax = require "limax"

return limax.experiment {
  name = "walk",
  lattice = { 5, 5, 5 }, -- voxels of 0.1 m
  materials = "paper",
  seed = 1,

  -- smooth bodies with limbs of one material walk farthest: see CLUSTER.md
  genome = { sigma = 0.25 },

  scene = {
    gravity = true,
    ground = true,
    friction = true,
    damping = true,
    actuation = { frequency = 2 }, -- Hz
  },

  -- s; with twice the step (`preview`, or time_step = "auto") a run takes half of the time, but its
  -- champion may exploit the step: 5.2 m there were 2 m at the finest step
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" },

  population = 30,
  generations = 40,
  repetitions = 1,

  fitness = "walk", -- m
  selection = { "tournament", size = 3 },
  supervisor = "rules",
}
