--- carry.lua: a task: push a bar of 4 kg ahead, which lies in front of a body of about 12 kg. The
--- start does not count, so that falling against the bar does not.

local limax = require "limax"

return limax.task {
  name = "carry", version = 1,
  about = {
    measured = "Twice the distance along x of the bar in the second half of the run, m.",
    passive = "0.00 m measured.",
    fixed = "no limit: there is one world, and nothing in it has to be sensed.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land {
    actuation = { frequency = 3 }, -- Hz
    -- half a voxel in front of the longest bodies: m, kg
    block = { size = { 0.2, 0.5, 0.2 }, position = { 0.55, -0.1, 0 }, mass = 4 },
  },
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 100, generations = 50, repetitions = 1,
  fitness = { "carry", axis = "x" },
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
