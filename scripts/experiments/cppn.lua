--- cppn.lua: mirrored walkers from a compositional pattern-producing network: its periodic and
--- Gaussian units repeat parts of a body, and `symmetric` copies one side to the other. One
--- repetition; about 20 seconds on two cores.
--- Run it with: limax run scripts/experiments/cppn.lua

local limax = require "limax"

return limax.experiment {
  name = "cppn",
  genome = { encoding = { "symmetric", of = "cppn", axis = "y" }, hidden = { 16, 16 } },
  scene = { gravity = true, ground = true, friction = true, damping = true,
    actuation = { frequency = 2 } },
  simulation = { duration = 5, settle = 0.5 },
  population = 30, generations = 20, repetitions = 1,
  fitness = "walk",
}
