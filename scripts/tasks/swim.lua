--- swim.lua: a task: swim in water that carries the body's weight. The start does not count.

local limax = require "limax"

return limax.task {
  name = "swim", version = 1,
  about = {
    measured = "Twice the horizontal distance of the second half of the run, m.",
    passive = "0.00 m measured.",
    fixed = "no limit: there is one world, and nothing in it has to be sensed.",
  },
  lattice = { 6, 3, 3 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.water { actuation = { frequency = 2 } }, -- Hz
  -- s; half of it is four whole strokes
  simulation = { duration = 4, settle = 0, accuracy = "evolve" },
  population = 100, generations = 100, repetitions = 1,
  fitness = "walk",
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
