--- sigma_sweep.lua: which standard deviation of the positional encoding suits walkers? The paper
--- chose sigma by a sweep. This script runs a short evolution for each sigma and seed, and prints a
--- table. 15 runs of 10 generations of 20 robots; about half a minute on two cores.
--- Run it with: limax scripts/experiments/sigma_sweep.lua [GENERATIONS [POPULATION]]

local limax = require "limax"

local generations = tonumber(arg[1]) or 10
local population = tonumber(arg[2]) or 20
local seeds = { 1, 2, 3 }

-- The history of one evolution.
local function evolve(sigma, seed)
  local experiment = limax.experiment {
    name = "sigma", seed = seed, genome = { sigma = sigma },
    simulation = { duration = 2, settle = 0.5, time_step = "auto" }, -- s
    population = population, generations = generations, repetitions = 1,
    fitness = "walk", supervisor = "fixed",
  }
  return limax.start(experiment):finish()
end

local function mean(list)
  local sum = 0
  for _, value in ipairs(list) do sum = sum + value end
  return sum / #list
end

print(("walk fitness (m), mean of %d seeds, %d generations of %d robots"):format(#seeds,
  generations, population))
print "sigma   first best   last best   hamming at first   bodies at first"
for _, sigma in ipairs { 0.15, 0.25, 0.5, 1, 4 } do
  local first, last, hamming, distinct = {}, {}, {}, {}
  for k, seed in ipairs(seeds) do
    local history = evolve(sigma, seed)
    first[k], last[k] = history[1].best, history[#history].best
    hamming[k], distinct[k] = history[1].diversity.all.hamming, history[1].diversity.all.distinct
  end
  print(("%-5g  %11.4f %11.4f %18.3f %17.1f"):format(sigma, mean(first), mean(last),
    mean(hamming), mean(distinct)))
end
