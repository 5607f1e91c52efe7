--- swim.lua: soft bodies learn to swim. Shows another world with the same encoding: water that
--- exerts a quadratic pressure on every exposed face that moves against it, and carries the body's
--- weight. A stroke that returns the way it came gains nothing except by its timing, so swimmers
--- bend and return in another shape.
---
--- The score is twice the horizontal distance in the second half of four seconds, which is four
--- whole strokes. 30 generations of 20 robots took 18 s on one core of an AMD EPYC. The best score
--- rose from 0.02 m to 0.39 m; with seeds 2 and 3 to 0.21 m and 0.30 m. The first champion keeps
--- its speed of 0.1 m/s for twice as long.
--- Run it with: limax run scripts/experiments/swim.lua
--- A river instead of still water: --set scene.drag.current=[0.2,0,0]

local limax = require "limax"

return limax.experiment {
  name = "swim",
  lattice = { 6, 3, 3 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.water { actuation = { frequency = 2 } },
  simulation = { duration = 4, settle = 0 },
  population = 20, generations = 30, repetitions = 1,
  fitness = "walk", -- m
}
