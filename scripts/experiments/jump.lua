--- jump.lua: soft bodies learn to jump. Shows another goal with the same encoding: the largest rise
--- of the centre of mass above its position at rest, in two seconds. Contact forces decide here, so
--- the tier is `evolve`. One repetition of 30 generations, about half a minute on two cores.
--- Run it with: limax run scripts/experiments/jump.lua

local limax = require "limax"

return limax.experiment {
  name = "jump",
  genome = { sigma = 1 },
  scene = limax.scenes.land { actuation = { frequency = 3 } }, -- Hz
  simulation = { duration = 2, settle = 0.5, accuracy = "evolve" }, -- s
  -- Hz: the top of a jump lasts a few hundredths of a second
  record = { center_of_mass = 100 },
  population = 30, generations = 30, repetitions = 1,
  fitness = "height", -- m
}
