--- walk.lua: a task: walk on flat ground. The start does not count, so that falling over does not.

local limax = require "limax"

return limax.task {
  name = "walk", version = 1,
  about = {
    measured = "Twice the horizontal distance of the second half of the run, m.",
    passive = "0.00 m measured.",
    fixed = "no limit: there is one world, and nothing in it has to be sensed.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { actuation = { frequency = 3 } }, -- Hz
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 100, generations = 100, repetitions = 1,
  fitness = "walk",
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
