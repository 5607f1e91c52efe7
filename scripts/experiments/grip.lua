--- grip.lua: soft hands learn to grip. A hand is held by its lowest layer and has a fixed, soft
--- ball between where its fingers may grow. Shows anchors and a fitness that reads a trace: the
--- share of masses that touch the ball, at its most less at its least in the second half of the
--- run, so that a hand must close on the ball and let it go again; leaning on it scores nothing.
---
--- The ball fills most of the lattice's upper half, so that a hand is what the network leaves out
--- as much as what it puts there. 30 generations of 20 robots took 6 s on one core of an AMD EPYC;
--- the best went from 0.12 to 0.26 of the masses, with seeds 2 and 3 to 0.21 and 0.22.
--- Run it with: limax run scripts/experiments/grip.lua

local limax = require "limax"

-- The largest change of the share of touching masses, once the start is over.
local function opening(robot)
  local touching = robot:trace "contact"
  local least, most, samples = 1, 0, touching:size()
  for sample = math.floor(samples / 2), samples do
    local share = touching[sample][1]
    least, most = math.min(least, share), math.max(most, share)
  end
  return most - least
end

return limax.experiment {
  name = "grip",
  lattice = { 5, 3, 5 }, -- voxels of 0.1 m
  materials = "paper",
  genome = { sigma = 0.25 },
  scene = {
    gravity = true, damping = true, friction = true,
    actuation = { frequency = 1 }, -- Hz
    anchors = true, -- the lowest layer
    -- soft, since a finger may start within it: N/m, m
    spheres = { center = { 0.25, 0.15, 0.45 }, radius = 0.16, stiffness = 2000 },
  },
  simulation = { duration = 3, settle = 0.5, time_step = "auto" },
  record = { contact = 50 }, -- Hz
  population = 20,
  generations = 30,
  repetitions = 1,
  fitness = opening, -- 1
  selection = { "tournament", size = 3 },
  supervisor = "rules",
}
