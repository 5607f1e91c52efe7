--- stairs.lua: soft bodies learn to climb stairs. Shows obstacles in a scene. The first step is a
--- hand's width in front of a body; each step is a third of a voxel high. The score is the distance
--- along the stairs, which are wider than a body strays sideways.
---
--- 30 generations of 20 robots took 85 s of one core. The best score rose from 0.19 to 0.67 m; with
--- seeds 2 and 3 to 0.73 m and 1.97 m.
--- Run it with: limax run scripts/experiments/stairs.lua

local limax = require "limax"

return limax.experiment {
  name = "stairs",
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.stairs { step = 0.033, depth = 0.25, count = 12, start = 0.6, width = 8,
    actuation = { frequency = 3 } }, -- m, Hz
  simulation = { duration = 5, settle = 0.5, accuracy = "publish" }, -- s: see ACCURACY.md
  population = 20, generations = 30, repetitions = 1,
  fitness = { "distance", axis = "x" }, -- m
}
