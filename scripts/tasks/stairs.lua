--- stairs.lua: a task: climb stairs whose steps are a third of a voxel high.

local limax = require "limax"

return limax.task {
  name = "stairs", version = 1,
  about = {
    measured = "The distance along x, m.",
    passive = "0.00 m measured.",
    fixed = "no limit: there is one world, and nothing in it has to be sensed.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.stairs { step = 0.033, depth = 0.25, count = 12, start = 0.6, width = 8,
    actuation = { frequency = 3 } }, -- m, Hz
  simulation = { duration = 5, settle = 0.5, accuracy = "publish" }, -- s: see ACCURACY.md
  population = 100, generations = 80, repetitions = 1,
  fitness = { "distance", axis = "x" },
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
