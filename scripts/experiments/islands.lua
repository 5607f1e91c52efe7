--- islands.lua: six populations that evolve side by side and exchange their best. Shows `islands`:
--- every fifth generation each island receives the two best robots of the island before it, so that
--- a good gait spreads while islands still try others. `metrics.jsonl` has best and mean of each
--- island. One repetition; about 15 seconds on two cores.
--- Run it with: limax run scripts/experiments/islands.lua

local limax = require "limax"

return limax.experiment {
  name = "islands",
  lattice = { 5, 5, 5 }, -- voxels of 0.1 m
  seed = 1,
  genome = { sigma = 0.25 },
  simulation = { duration = 3, settle = 0.5, accuracy = "preview" }, -- s

  population = 60, -- six islands of ten robots
  islands = { count = 6, every = 5, migrants = 2, topology = "ring" },
  generations = 30,
  repetitions = 1,

  fitness = "walk", -- m
  selection = { "tournament", size = 2 },
  supervisor = "fixed",
}
