--- pareto.lua: far with little energy. Shows two objectives: NSGA-II ranks robots by who dominates
--- whom in distance and in the work of their muscles, and keeps the whole front from robots that
--- rest to robots that run. `metrics.jsonl` has the front's size and its hypervolume above the
--- reference point: no distance for 200 J.
--- One repetition; about half a minute on two cores.
--- Run it with: limax run scripts/experiments/pareto.lua

local limax = require "limax"

return limax.experiment {
  name = "pareto",
  simulation = { duration = 3, settle = 0.5, accuracy = "preview" }, -- s
  population = 60, generations = 40, repetitions = 1,
  fitness = "distance", -- m
  survival = { "nsga2", objectives = { "distance", "-energy" }, reference = { 0, 200 } }, -- m, J
  supervisor = "fixed",
}
