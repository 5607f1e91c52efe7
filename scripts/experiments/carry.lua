--- carry.lua: soft bodies learn to push a load. Shows the rigid block, which slides, turns and
--- falls over: a bar of 4 kg lies in front of bodies of about 12 kg. The score is twice its
--- distance along x in the second half of the run, so that a single push is not enough.
---
--- 40 generations of 30 robots took two minutes on one core of a busy AMD EPYC. The best score rose
--- from 0.28 m to 1.1 m; with seeds 2 and 3 from 0.39 m and 0.43 m to 0.95 m each. The winners walk
--- behind the bar and push it; the first generation pushes it once.
--- Run it with: limax run scripts/experiments/carry.lua

local limax = require "limax"

return limax.experiment {
  name = "carry",
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land {
    actuation = { frequency = 3 }, -- Hz
    -- half a voxel in front of the longest bodies: m, kg
    block = { size = { 0.2, 0.5, 0.2 }, position = { 0.55, -0.1, 0 }, mass = 4 },
  },
  simulation = { duration = 8, settle = 0.5, time_step = "auto" }, -- s
  population = 30, generations = 40, repetitions = 1,
  fitness = { "carry", axis = "x" }, -- m
}
