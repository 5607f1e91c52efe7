--- climb.lua: a task: walk up a slope of 8 degrees. The start does not count.

local limax = require "limax"

return limax.task {
  name = "climb", version = 1,
  about = {
    measured = "Twice the distance uphill of the second half of the run, m.",
    passive = "0.00 m measured: friction holds it.",
    fixed = "no limit: there is one world, and nothing in it has to be sensed.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  -- downhill is -x, uphill is x
  scene = limax.scenes.slope { angle = math.rad(8), direction = math.pi,
    actuation = { frequency = 2 } }, -- Hz
  -- s; half of it is five whole periods, so that a periodic motion adds no distance
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" },
  population = 100, generations = 100, repetitions = 1,
  fitness = { "walk", axis = "x" },
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
