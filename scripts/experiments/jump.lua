--- jump.lua: soft bodies learn to jump. Shows another goal with the same encoding: the largest rise
--- of the centre of mass above its position at rest, in two seconds. Contact forces decide here, so
--- the tier is `evolve`.
---
--- 30 generations of 30 robots take about half a minute on two cores. The best score rose from
--- 0.55 m to 1.1 m; with seeds 2 and 3 from 0.24 m and 0.16 m to 1.0 m and 1.2 m.
--- Run it with: limax run scripts/experiments/jump.lua

local limax = require "limax"

return limax.experiment {
  name = "jump",
  scene = limax.scenes.land { actuation = { frequency = 3 } }, -- Hz
  simulation = { duration = 2, settle = 0.5, accuracy = "evolve" }, -- s
  -- Hz: the top of a jump lasts a few hundredths of a second
  record = { center_of_mass = 100 },
  population = 30, generations = 30, repetitions = 1,
  fitness = "height", -- m
}
