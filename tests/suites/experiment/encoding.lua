--- encoding.lua: encodings, mutations and crossovers: those of the library, and functions of a
--- script; their runs resume to the same bytes; messages name the mistake in one.

local limax = require "limax"
local evolution = require "support.evolution"

local suite = require("limax.test").suite "encoding"

local small, silent, finished = evolution.small, evolution.silent, evolution.finished

-- Two genes a voxel: its material, and all three weights.
local own = {
  genes = function(shape) return 2 * shape.voxels end,
  express = function(robots)
    local count = robots.materials.count
    for _, i in ipairs(robots) do
      local genes, voxels, weights = robots:genes(i), robots:voxels(i), robots:weights(i)
      for v = 1, #voxels do
        voxels[v] = math.floor(math.abs(genes[v]) * 7) % count
        for kind = 1, 3 do weights[kind][v] = math.min(1, math.abs(genes[#voxels + v])) end
      end
    end
  end,
}

local function genomes(robots)
  local list = {}
  for i = 1, #robots do list[i] = robots[i].genome:table() end
  return list
end

suite:test("every encoding of the library evolves, and resumes to the same bytes", function(t)
  local list = { "direct", "cppn", "l_system", { "symmetric", of = "cppn", axis = "x" },
    { "symmetric", of = own }, own }
  for _, encoding in ipairs(list) do
    evolution.resumes(t, { genome = { encoding = encoding, require_muscle = false },
      lattice = { 3, 3, 2 } })
  end
end)

suite:test("a script's body is a valid one: record, file and replay agree with it", function(t)
  local history = finished { genome = { encoding = own }, lattice = { 3, 3, 3 } }
  local robots = history[#history].population
  for i = 1, #robots do
    local robot = robots[i]
    if robot.fitness then
      local again = limax.robot(robot)
      t:equal(again.body.hash, robot.body.hash)
      t:equal(again.body.masses, robot.body.masses)
      t:equal(again:replay().fitness, robot.fitness)
    end
  end
end)

suite:test("bodies of `symmetric` are mirrored", function(t)
  local experiment = small { genome = { encoding = { "symmetric", axis = "x" }, sigma = 1,
    require_muscle = false }, lattice = { 4, 3, 3 }, generations = 1 }
  local robots = limax.start(experiment, { say = silent }):finish()[1].population
  for i = 1, #robots do
    for line in robots[i].body.letters:gmatch "[^\n]+" do t:equal(line:reverse(), line) end
  end
end)

suite:test("an offspring differs from its parents by the mutation and crossover", function(t)
  local function bred(genome)
    genome.encoding = "direct"
    local history = finished { genome = genome, generations = 2, lattice = { 3, 3, 3 },
      breeding = { mutation_rate = 0.25, crossover_rate = 0.25 } }
    return genomes(history[1].population), history[2].population
  end
  -- the parents' genes of each offspring, and how many of its own come from neither
  local function each(genome, check)
    local before, robots = bred(genome)
    for i = 1, #robots do
      if robots[i].origin == "bred" then
        local first, second = before[robots[i].parents[1]], before[robots[i].parents[2]]
        local of_second, new, runs = 0, 0, 0
        for g, gene in ipairs(robots[i].genome:table()) do
          local other = gene ~= first[g]
          if other and gene == second[g] then of_second = of_second + 1 end
          if other and gene ~= second[g] then new = new + 1 end
          if other and (g == 1 or robots[i].genome[g - 1] == first[g - 1]) then runs = runs + 1 end
        end
        check(of_second, new, runs, #first, first ~= second)
      end
    end
  end
  each({ mutation = "none", crossover = "none" }, function(of_second, new)
    t:equal({ of_second, new }, { 0, 0 })
  end)
  each({ mutation = "block", crossover = "none" }, function(_, new, runs, count)
    t:equal(new, math.ceil(0.25 * count))
    t:ok(runs <= 2)
  end)
  each({ mutation = "none", crossover = "two_point" }, function(of_second, new, runs, count, two)
    t:equal({ of_second, new }, { two and math.ceil(0.25 * count) or 0, 0 })
    t:ok(runs <= 2)
  end)
  each({ mutation = function(robots)
    for _, i in ipairs(robots) do robots:genes(i)[1] = i end
  end }, function(_, new) t:equal(new, 1) end)
end)

suite:test("the engine's operators on all rows are what it does by itself", function(t)
  local function run(genome)
    local history = finished { genome = genome }
    return genomes(history[#history].population)
  end
  t:equal(run { crossover = function(robots) robots:cross() end,
    mutation = function(robots) robots:mutate() end }, run {})
  t:equal(run { mutation = function(robots)
    for _, i in ipairs(robots) do robots:mutate { i } end
  end }, run {})
end)

suite:test("functions of an encoding make the first genes and vary them", function(t)
  local function filled(value)
    return function(robots)
      for _, i in ipairs(robots) do
        local genes, random = robots:genes(i), robots:random(i):uniform()
        for g = 1, #genes do genes[g] = value + random end
      end
    end
  end
  local mine = { genes = own.genes, express = own.express, initialize = filled(10),
    cross = function(robots)
      for _, i in ipairs(robots) do
        local first, second = robots:parents(i)
        robots:genes(i)[1] = first[1] + second[1]
      end
    end, mutate = function() end }
  local history = finished { genome = { encoding = mine, require_muscle = false }, generations = 2 }
  local before, robots = history[1].population, history[2].population
  t:ok(before[1].genome[3] > 10 and before[1].genome[3] < 11)
  t:ok(before[1].genome[3] ~= before[2].genome[3])
  for i = 1, #robots do
    if robots[i].origin == "bred" then
      local pair = robots[i].parents
      t:near(robots[i].genome[1], before[pair[1]].genome[1] + before[pair[2]].genome[1],
        { rtol = 1e-6 })
    end
  end
end)

suite:test("a wrong encoding or variation is refused with place and remedy", function(t)
  local function refused(message, genome)
    t:raises(message, function() small { genome = genome } end)
  end
  refused("genome.encoding.genes: its result: ",
    { encoding = { genes = function() return 0 end, express = own.express } })
  refused("genome.sigma: expected a number from 0.001 to 100, got 0", { sigma = 0 })
  refused('genome.sigma: the encoding "direct" does not use it',
    { encoding = "direct", sigma = 0.2 })
  local function fails(message, genome)
    t:raises(message, function() finished { genome = genome } end)
  end
  local function one(work)
    return { encoding = { genes = 3, express = function(robots)
      for _, i in ipairs(robots) do work(robots, i) end
    end } }
  end
  fails("voxels%[1%]: expected a whole number from 0 to 4, got 7",
    one(function(robots, i) robots:voxels(i)[1] = 7 end))
  fails("robot 1 is none of these", { mutation = function(robots) robots:genes(1) end })
  fails("robots:random: a body depends on its genes only", one(function(robots, i)
    robots:random(i)
  end))
  fails("nan", { mutation = function(robots) robots:genes(robots[1])[1] = 0 / 0 end })
  -- elites would change, or the bodies of elites
  fails("robots:mutate: rows[1] = 1 is none of these", { mutation = function(robots)
    robots:mutate { 1 }
  end })
  fails("express may not write genes", one(function(robots, i)
    robots:genes(i)[1] = robots:genes(i)[1] + 1
  end))
end)
