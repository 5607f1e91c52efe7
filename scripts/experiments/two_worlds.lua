--- two_worlds.lua: soft bodies that walk on flat land and over uneven ground. Shows trials: each
--- robot is simulated in both worlds, and scored by the shorter of its two distances, so that a
--- robot for one world only does not win.
---
--- 30 generations of 20 robots took 76 s on one core of an Intel Xeon. The best score rose from
--- 0.36 m to 2.5 m; with seeds 2 and 3 to 1.5 m and 1.3 m. Scored by the flat world only, the
--- champions of these seeds walked 2.7 m, 2.1 m and 3.0 m there, and 0.3 m, 0.8 m and 0.7 m in the
--- other.
--- Run it with: limax run scripts/experiments/two_worlds.lua

local limax = require "limax"

local drive = { frequency = 3 } -- Hz

return limax.experiment {
  name = "two_worlds",
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  trials = {
    { scene = limax.scenes.land { actuation = drive } },
    { scene = limax.scenes.rough { roughness = 0.06, spacing = 0.2, size = 8, actuation = drive } },
  },
  simulation = { duration = 4, settle = 0.5, accuracy = "evolve" }, -- s
  population = 20, generations = 30, repetitions = 1,
  fitness = function(robot)
    local flat, rough = robot.trials[1]:distance(), robot.trials[2]:distance()
    return math.min(flat, rough), { flat = flat, rough = rough } -- m
  end,
}
