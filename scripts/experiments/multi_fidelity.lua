--- multi_fidelity.lua: evolution with two fidelities. Every robot is scored at the tier `preview`;
--- promising ones are scored again at `publish`, and only those scores choose elites and parents.
--- Shows an own loop over `population:breed` with `limax.rescore`. For comparison, the same
--- evolution runs with every robot at `publish`; both final bests are scored again at `reference`.
---
--- Two seeds of 12 generations of 24 robots take one to two minutes on two cores of an AMD EPYC.
--- There it simulated 50 and 49 robots at `publish` instead of 211, which saved 74 % and 52 % of
--- the simulation time. Both final bests walked farther than those of `publish` (3.4 m and 2.8 m
--- against 1.1 m and 1.7 m), which with two seeds may be chance.
--- Run it with: limax scripts/experiments/multi_fidelity.lua [GENERATIONS [POPULATION [SECONDS]]]

local limax = require "limax"

local generations = tonumber(arg[1]) or 12
local population_size = tonumber(arg[2]) or 24
local duration = tonumber(arg[3]) or 3 -- s
local seeds = { 1, 2 }
-- Share of the population: the elites (0.3) and a third more, since `preview` may misjudge some.
local promising_share = 0.4

local function experiment(seed, accuracy)
  return limax.experiment {
    name = "multi_fidelity", seed = seed, genome = { sigma = 0.25 },
    simulation = { duration = duration, settle = 0.3, accuracy = accuracy },
    population = population_size, generations = generations, repetitions = 1,
    fitness = "walk", supervisor = "fixed", record = {},
  }
end

-- Indices with a score, best first.
local function ranked(scores)
  local list = {}
  for i in pairs(scores) do list[#list + 1] = i end
  table.sort(list, function(a, b)
    if scores[a] ~= scores[b] then return scores[a] > scores[b] end
    return a < b
  end)
  return list
end

-- Scores of the promising robots at `publish`; an elite keeps its score.
local function score_again(robots, scored)
  local promising, unscored = {}, {}
  for k = 1, math.min(#robots.ranked, math.ceil(promising_share * #robots)) do
    promising[k] = robots.ranked[k]
  end
  for _, i in ipairs(promising) do
    if not scored[robots[i].id] then unscored[#unscored + 1] = i end
  end
  local seconds = 0
  if #unscored > 0 then
    local again = limax.rescore.population(robots, { accuracy = "publish" }, unscored)
    -- -math.huge: it failed at `publish`
    for _, i in ipairs(unscored) do scored[robots[i].id] = again.fitness[i] or -math.huge end
    seconds = again.seconds
  end
  local scores = {}
  for _, i in ipairs(promising) do
    local score = scored[robots[i].id]
    if score > -math.huge then scores[i] = score end
  end
  return scores, seconds, #unscored
end

local tournament = limax.selection.get { "tournament", size = 3 }

-- Elites and pairs of parents by the finer scores.
local function choose(seed, robots, scores)
  local best = ranked(scores)
  local elites, parents = {}, {}
  for k = 1, math.min(#best, math.floor(0.3 * #robots + 0.5)) do elites[k] = best[k] end
  for child = 1, #robots - #elites do
    local random = limax.engine.random(seed, 1, "user", robots.generation, child)
    parents[child] = { tournament({ ranked = best }, random) }
  end
  return { elites = elites, parents = parents }
end

-- Runs one evolution: its final best at `reference` (m), the wall time of all simulations (s), and
-- the number of simulations at `publish`.
local function evolve(seed, twice)
  local scored, seconds, fine, result = {}, 0, 0, nil
  for robots in limax.start(experiment(seed, twice and "preview" or "publish")):generations() do
    robots:simulate():score()
    seconds = seconds + robots.timing.simulate
    local scores = {}
    if twice then
      local again, count
      scores, again, count = score_again(robots, scored)
      seconds, fine = seconds + again, fine + count
    else
      fine = fine + robots.evaluations
      for _, i in ipairs(robots.ranked) do scores[i] = robots[i].fitness end
    end
    if robots.generation == generations - 1 then
      local best = ranked(scores)[1]
      result = limax.rescore.population(robots, { accuracy = "reference" }, { best }).fitness[best]
    end
    robots:breed(choose(seed, robots, scores))
  end
  return result, seconds, fine
end

print(("walk fitness (m) of the final best at `reference`; %d generations of %d robots"):format(
  generations, population_size))
print "seed   all at publish                preview, then publish           time saved"
local saved = 0
for _, seed in ipairs(seeds) do
  local all, all_seconds, all_fine = evolve(seed, false)
  local twice, twice_seconds, twice_fine = evolve(seed, true)
  saved = saved + (1 - twice_seconds / all_seconds) / #seeds
  print(("%-4d   %6.3f, %3d runs in %6.2f s   %6.3f, %3d runs in %6.2f s   %4.0f %%"):format(seed,
    all, all_fine, all_seconds, twice, twice_fine, twice_seconds,
    100 * (1 - twice_seconds / all_seconds)))
end
print(("two fidelities save %.0f %% of the simulation time, mean of %d seeds"):format(
  100 * saved, #seeds))
