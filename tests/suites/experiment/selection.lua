--- selection.lua: the selection schemes against the closed forms of their chances, on populations
--- made by hand. All draws have fixed seeds.

local limax = require "limax"
local suite = require("limax.test").suite "selection"

-- A scored population: robots with these scores (false: failed), ranked as scoring does.
local function scored(scores, cases)
  local population = { ranked = {} }
  for i, score in ipairs(scores) do
    population[i] = { fitness = score or nil, cases = cases and cases[i] }
    if score then table.insert(population.ranked, i) end
  end
  table.sort(population.ranked, function(a, b)
    if scores[a] ~= scores[b] then return scores[a] > scores[b] end
    return a < b
  end)
  return population
end

local function stream(generation)
  return limax.engine.random(7, 1, "selection", generation or 0, 0)
end

-- How often each robot is picked, first and second parents together.
local function counts_of(spec, population, offspring)
  local scheme, random = limax.selection.get(spec), stream()
  local counts = {}
  for i = 1, #population do counts[i] = 0 end
  for _ = 1, offspring do
    local i, j = scheme(population, random)
    counts[i] = counts[i] + 1
    counts[j] = counts[j] + 1
  end
  return counts
end

-- Pearson's chi square of counts against chances.
local function chi_square(counts, chances)
  local total, sum = 0, 0
  for _, count in ipairs(counts) do total = total + count end
  for i, chance in ipairs(chances) do
    if chance > 0 then sum = sum + (counts[i] - total * chance) ^ 2 / (total * chance) end
  end
  return sum
end

-- 99.9 % point of chi square with 9 degrees of freedom
local MOST_9 = 27.88

local TEN = { 3, 9, 1, 7, 5, 10, 2, 8, 4, 6 }
local OFFSPRING = 20000

-- The chance of a robot of TEN by its score.
local function tournament(size)
  return function(score) return (score ^ size - (score - 1) ^ size) / 10 ^ size end
end
local function rank(pressure)
  return function(score) return (pressure - 2 * (pressure - 1) * (10 - score) / 9) / 10 end
end
local function even() return 0.1 end
local function best_three(score) return score > 7 and 1 / 3 or 0 end

-- scheme, chance by the score of TEN, how a robot's fitness follows from that score
local CLOSED_FORMS = {
  { { "tournament", size = 1 }, tournament(1) },
  { { "tournament", size = 2 }, tournament(2) },
  { { "tournament", size = 7 }, tournament(7) },
  { { "rank", pressure = 1 }, rank(1) },
  { { "rank", pressure = 1.5 }, rank(1.5) },
  { { "rank", pressure = 2 }, rank(2) },
  { "roulette", function(score) return score / 55 end },
  -- negative fitness, -3 to 6, is shifted by the worst
  { "roulette", function(score) return (score - 1) / 45 end, function(score) return score - 4 end },
  -- all shares are 0
  { "roulette", even, function() return 0 end },
  { "roulette", even, function() return -2 end },
  { { "truncation", share = 0.3 }, best_three },
  -- one robot at least, however small the share
  { { "truncation", share = 0.001 }, function(score) return score > 9 and 1 or 0 end },
}

suite:test("robots are picked by the closed forms of the chances", function(t)
  for k, case in ipairs(CLOSED_FORMS) do
    local spec, chance_of, fitness_of = unpack(case, 1, 3)
    local scores, chances = {}, {}
    for i, score in ipairs(TEN) do
      scores[i], chances[i] = fitness_of and fitness_of(score) or score, chance_of(score)
    end
    local counts = counts_of(spec, scored(scores), OFFSPRING)
    t:ok(chi_square(counts, chances) < MOST_9, "case " .. k)
    for i, chance in ipairs(chances) do t:ok(chance > 0 or counts[i] == 0, "case " .. k) end
  end
end)

suite:test("lexicase keeps specialists, epsilon lets the generalist in", function(t)
  local cases = { { 1, 0 }, { 0, 1 }, { 0.75, 0.75 }, { 0.5, 0.5 } }
  local population = scored({ 1, 1, 1.5, 1 }, cases)
  local plain = counts_of("lexicase", population, 2000)
  t:equal({ plain[3], plain[4] }, { 0, 0 })
  t:near(plain[1], 2000, { rtol = 0.05 })
  t:equal(counts_of({ "lexicase", epsilon = 0.25 }, population, 100)[3], 200)

  -- median absolute deviation of { 1, 0, 0.75 } is 0.25
  local three = scored({ 1, 1, 1.5 }, { cases[1], cases[2], cases[3] })
  t:equal(counts_of({ "lexicase", epsilon = "mad" }, three, 100)[3], 200)
end)

suite:test("lexicase refuses populations without comparable cases", function(t)
  local lexicase, random = limax.selection.get "lexicase", stream()
  t:raises("robot 2 has no cases", function() lexicase(scored({ 1, 2 }, { { 1 } }), random) end)
  t:raises("robot 1 has 1 cases and robot 2 has 2",
    function() lexicase(scored({ 1, 2 }, { { 1 }, { 1, 2 } }), random) end)
  t:raises("case 1 of robot 1 is",
    function() lexicase(scored({ 2, 1 }, { { 0 / 0 }, { 1 } }), random) end)
end)

local ALL = { "truncation", "tournament", "rank", "roulette", "lexicase" }

suite:test("a failed robot is never chosen, a better one is chosen more often", function(t)
  local scores, cases = {}, {}
  for i = 1, 40 do
    scores[i] = i % 3 ~= 0 and (i * 17) % 41 - 10
    cases[i] = { scores[i] or 0, -(scores[i] or 0) / 2, (i * 5) % 7 }
  end
  local population = scored(scores, cases)
  local mean = 0
  for _, index in ipairs(population.ranked) do mean = mean + scores[index] end
  mean = mean / #population.ranked
  for _, name in ipairs(ALL) do
    local counts, chosen = counts_of(name, population, 3000), 0
    for i, count in ipairs(counts) do
      if not scores[i] then t:equal(count, 0) end
      chosen = chosen + count * (scores[i] or 0) / 6000
    end
    -- lexicase goes by the cases, which here pull against each other
    if name ~= "lexicase" then t:ok(chosen > mean + 2, name .. " has no pressure") end
  end
end)

suite:test("one scored robot is both parents, none is an error", function(t)
  for _, name in ipairs(ALL) do
    local scheme, random = limax.selection.get(name), stream()
    local i, j = scheme(scored({ false, 5, false }, { {}, { 1 }, {} }), random)
    t:equal({ i, j }, { 2, 2 })
    t:raises("no robot of this generation has a fitness",
      function() scheme(scored { false, false }, random) end)
  end
end)
