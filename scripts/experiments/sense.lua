--- sense.lua: bodies and networks evolve together. All voxels of a robot share one network, which
--- senses strain, contact and a clock, hears its neighbours, and adds to the sine of the muscles.
--- The first generation has zero weights, so that it walks by the sine only. The two switches make
--- the open loop, to compare with, and evolve networks for a given body.
---
--- Run it with: limax run scripts/experiments/sense.lua

local limax = require "limax"

local SENSES = true
-- a robot file, such as "runs/walk-1/r01/champions/g0039.json": all robots have its body
local BODY = nil

local drive = { frequency = 2 } -- Hz
local scene = SENSES and limax.scenes.land {
  control = limax.control.network {
    sensors = { "strain", "contact", "clock" }, hidden = 8, messages = 1, states = 2,
    base = "sine", frequency = drive.frequency, rate = 50, -- Hz
  },
} or limax.scenes.land { actuation = drive }

return limax.experiment {
  name = SENSES and "sense" or "open_loop",
  lattice = not BODY and { 5, 3, 4 } or nil, -- voxels of 0.1 m
  genome = BODY and { body = BODY } or { sigma = 0.25 },
  breeding = SENSES and { control_mutation_rate = 0.1, control_mutation_scale = 0.3 } or nil,
  scene = scene,
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 20, generations = 40, repetitions = 1,
  fitness = "walk", -- m
}
