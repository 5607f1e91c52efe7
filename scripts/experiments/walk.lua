--- walk.lua: soft bodies learn to walk. Shows the main job of limax from genome to champion: 40
--- generations of 30 robots on flat ground, scored by the distance of the second half of five
--- seconds, so that falling over is no gait. One repetition; about half a minute on two cores.
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

  -- s; `auto` lets every body take the longest step that it bears: quick, and still the same bits
  -- each time
  simulation = { duration = 5, settle = 0.5, time_step = "auto" },

  population = 30,
  generations = 40,
  repetitions = 1,

  fitness = "walk", -- m
  selection = { "tournament", size = 3 },
  supervisor = "rules",
}
