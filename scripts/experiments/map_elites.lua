--- map_elites.lua: many different walkers instead of one. Shows an archive: a grid over the share
--- of muscles and the mean contact with the ground keeps the best robot of each cell, and all
--- parents come from it. `metrics.jsonl` has its coverage and QD score, `rNN/archive` its robots.
--- One repetition; about 45 seconds on two cores.
--- Run it with: limax run scripts/experiments/map_elites.lua

local limax = require "limax"

return limax.experiment {
  name = "map_elites",
  simulation = { duration = 3, settle = 0.5, accuracy = "preview" }, -- s
  population = 60, generations = 40, repetitions = 1,
  fitness = "walk", -- m
  archive = { "grid", descriptors = { { "muscle_share", cells = 12 }, { "contact", cells = 12 } } },
  survival = "map_elites",
  supervisor = "fixed",
}
