--- climb.lua: soft bodies learn to walk up a slope of 8 degrees. Shows tilted gravity and a fitness
--- with a direction: the distance uphill in the second half of the run. A body that does not move
--- scores 0, a body that slides down less.
---
--- 40 generations of 20 robots took 32 s on one core of an AMD EPYC. The best score rose from
--- -0.02 m to 0.25 m; with seeds 2 and 3 to 0.31 m and 0.30 m. On 15 degrees, at 3 Hz, evolution
--- found a body that does not slide, and nothing better.
--- Run it with: limax run scripts/experiments/climb.lua

local limax = require "limax"

return limax.experiment {
  name = "climb",
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  -- downhill is -x, uphill is x
  scene = limax.scenes.slope { angle = math.rad(8), direction = math.pi,
    actuation = { frequency = 2 } }, -- Hz
  -- s; half of it is five whole periods, so that a periodic motion adds no distance
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" },
  population = 20, generations = 40, repetitions = 1,
  fitness = { "walk", axis = "x" }, -- m
}
