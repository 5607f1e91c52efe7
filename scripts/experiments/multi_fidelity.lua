--- multi_fidelity.lua: evolution with two fidelities. Every robot is scored at the tier `preview`,
--- and the best half of each generation again at `publish` (`limax.rescore.population`). For
--- comparison, the same evolution runs with every robot at `publish`; both final bests are scored
--- at `reference`.
---
--- Two seeds of 12 generations of 24 robots take 40 seconds on two cores. There it saved half of
--- the simulation time; the final bests walked 0.9 m and 0.8 m, those of `publish` 2.1 m and 1.2 m,
--- which with two seeds may be chance.
--- Run it with: limax scripts/experiments/multi_fidelity.lua [GENERATIONS [POPULATION [SECONDS]]]

local limax = require "limax"

local generations = tonumber(arg[1]) or 12
local population_size = tonumber(arg[2]) or 24
local duration = tonumber(arg[3]) or 3 -- s
local seeds = { 1, 2 }

-- Scores a generation again at `publish`, until the best half of its ranking has such scores.
-- `fine` keeps them by the robots' ids, also for elites. Returns the wall time of simulating, s.
local function improve(robots, fine, score)
  local seconds = 0
  repeat
    robots:score(score)
    local coarse = {}
    for k = 1, math.ceil(#robots.ranked / 2) do
      local i = robots.ranked[k]
      if not fine[robots[i].id] then coarse[#coarse + 1] = i end
    end
    local again = limax.rescore.population(robots, { accuracy = "publish" }, coarse)
    for _, i in ipairs(coarse) do fine[robots[i].id] = again.fitness[i] or 0 end
    seconds = seconds + again.seconds
  until #coarse == 0
  return seconds
end

-- Runs one evolution: its final best at `reference` (m), and the wall time of all simulations (s).
local function evolve(seed, accuracy, improves)
  local experiment = limax.experiment {
    name = "multi_fidelity", seed = seed, genome = { sigma = 0.25 },
    simulation = { duration = duration, settle = 0.3, accuracy = accuracy },
    population = population_size, generations = generations, repetitions = 1,
    fitness = "walk", supervisor = "fixed", record = {},
  }
  local seconds, best, fine = 0, nil, {}
  -- the same function in each generation, so that elites keep their scores
  local function score(robot) return fine[robot.id] or limax.fitness.walk(robot) end
  for robots in limax.start(experiment):generations() do
    robots:simulate()
    if improves then seconds = seconds + improve(robots, fine, score) else robots:score() end
    seconds = seconds + robots.timing.simulate
    if robots.generation == generations - 1 then
      local first = robots.ranked[1]
      best = limax.rescore.population(robots, { accuracy = "reference" }, { first }).fitness[first]
    end
    robots:breed()
  end
  return best, seconds
end

print(("walk fitness (m) of the final best at `reference`; %d generations of %d robots"):format(
  generations, population_size))
print "seed   all at publish       preview, the best half at publish   time saved"
for _, seed in ipairs(seeds) do
  local all, all_seconds = evolve(seed, "publish", false)
  local twice, twice_seconds = evolve(seed, "preview", true)
  print(("%-4d   %6.3f in %6.2f s   %6.3f in %6.2f s                  %4.0f %%"):format(seed, all,
    all_seconds, twice, twice_seconds, 100 * (1 - twice_seconds / all_seconds)))
end
