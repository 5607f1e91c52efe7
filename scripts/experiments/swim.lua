--- swim.lua: soft bodies learn to swim. Shows another world under the same encoding: water that
--- presses on every exposed face against its motion, quadratically, and carries the body's weight,
--- so that nothing is there to push off from. A stroke that comes back as it went gains nothing but
--- by its timing: what swims bends, and beats its way back in another shape.
---
--- The score is the horizontal way in the second half of four seconds, twice: by then the start is
--- over, and half of the run is four whole strokes. 30 generations of 20 robots took 18 s on one
--- core of an AMD EPYC, in which the best went from 0.02 m to 0.39 m, with seeds 2 and 3 to 0.21 m
--- and 0.30 m. The first champion swims on at that pace, 0.1 m/s, for twice as long.
--- Run it with: limax run scripts/experiments/swim.lua
--- A river instead of still water: --set scene.drag.current=[0.2,0,0]

local limax = require "limax"

return limax.experiment {
  name = "swim",
  lattice = { 6, 3, 3 }, -- voxels of 0.1 m
  materials = "paper",
  genome = { sigma = 0.25 },
  scene = limax.scenes.water { actuation = { frequency = 2 } },
  simulation = { duration = 4, settle = 0 },
  population = 20,
  generations = 30,
  repetitions = 1,
  fitness = "walk", -- m
  selection = { "tournament", size = 3 },
  supervisor = "rules",
}
