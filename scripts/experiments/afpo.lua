--- afpo.lua: new blood in every generation. Shows age-fitness Pareto optimization: two random
--- robots join each generation, and a robot competes only with those that are as young or younger,
--- so that a new kind of body has time to get better. `metrics.jsonl` has the ages.
--- One repetition; about half a minute on two cores.
--- Run it with: limax run scripts/experiments/afpo.lua

local limax = require "limax"

return limax.experiment {
  name = "afpo",
  simulation = { duration = 3, settle = 0.5, accuracy = "preview" }, -- s
  population = 60, generations = 40, repetitions = 1,
  fitness = "walk", -- m
  survival = { "age_fitness", newcomers = 2 },
  supervisor = "fixed",
}
