--- jump.lua: a task: jump high.

local limax = require "limax"

return limax.task {
  name = "jump", version = 1,
  about = {
    measured = "The highest rise of the centre of mass above its height at rest, m.",
    passive = "0.00 m measured.",
    fixed = "no limit: there is one world, and nothing in it has to be sensed.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { actuation = { frequency = 3 } }, -- Hz
  simulation = { duration = 3, settle = 0.5, accuracy = "evolve" }, -- s
  -- Hz: the top of a jump lasts a few hundredths of a second
  record = { center_of_mass = 100 },
  population = 100, generations = 100, repetitions = 1,
  fitness = "height",
  small = { population = 12, generations = 6, ["simulation.duration"] = 2 },
}
