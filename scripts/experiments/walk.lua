--- walk.lua: soft bodies learn to walk. Shows the main job of limax from genome to champion: 40
--- generations of 30 robots on flat ground, scored by the distance of the second half of five
--- seconds, so that falling over is no gait. One repetition; about 40 seconds on two cores.
--- Run it with: limax run scripts/experiments/walk.lua

local limax = require "limax"

return limax.experiment {
  name = "walk",
  lattice = { 5, 5, 5 }, -- voxels of 0.1 m
  materials = "paper",
  seed = 1,

  -- smooth bodies, whole limbs of one material: sigma_sweep.lua finds that they walk farthest
  genome = { sigma = 0.25 },

  scene = {
    gravity = true,
    ground = true,
    friction = true,
    damping = true,
    actuation = { frequency = 2 }, -- Hz
  },

  -- s; at twice this tier's step (`preview`, or time_step = "auto") a run takes half of the time,
  -- and its champion may live by the step: 5.2 m there were 2 m at the finest
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" },

  population = 30,
  generations = 40,
  repetitions = 1,

  fitness = "walk", -- m
  selection = { "tournament", size = 3 },
  supervisor = "rules",
}
