--- islands.lua: populations that evolve side by side: offspring have parents of their own island,
--- an exchange moves the best, and what survival, selection and scripts see of an island.

local evolution = require "support.evolution"
local limax = require "limax"

local suite = require("limax.test").suite "islands"

local finished = evolution.finished

-- An experiment of three islands of four robots.
local function three(fields, islands)
  return evolution.with({ population = 12, generations = 5,
    islands = evolution.with({ count = 3, every = 2, migrants = 1 }, islands) }, fields)
end

-- Ids of the robots of each island as sets, and the robots by rank.
local function of_islands(robots, count)
  local ids, ranked = {}, {}
  for k = 1, count do ids[k], ranked[k] = {}, {} end
  for _, i in ipairs(robots.ranked) do table.insert(ranked[robots[i].island], robots[i]) end
  for _, robot in ipairs(robots) do ids[robot.island][robot.id] = true end
  return ids, ranked
end

-- Robots of island `k` that were elsewhere before, best first.
local function arrived(robots, k, before)
  local list = {}
  for _, robot in ipairs(robots) do
    if robot.island == k and robot.origin == "elite" and not before[k][robot.id] then
      list[#list + 1] = robot
    end
  end
  return list
end

suite:test("offspring have parents of their island, and an exchange moves the best", function(t)
  local history = finished(three())
  for g = 2, #history do
    local robots = history[g].population
    local before, best = of_islands(history[g - 1].population, 3)
    local sizes = { 0, 0, 0 }
    for _, robot in ipairs(robots) do
      sizes[robot.island] = sizes[robot.island] + 1
      for _, parent in ipairs(robot.origin == "bred" and robot.parents or {}) do
        t:ok(before[robot.island][parent], ("the parent of robot %d is elsewhere"):format(robot.id))
      end
    end
    t:equal(sizes, { 4, 4, 4 })
    for k = 1, 3 do
      local come, source = arrived(robots, k, before), (k + 1) % 3 + 1
      if (g - 1) % 2 == 1 then
        t:equal(#come, 0)
      elseif not before[k][best[source][1].id] then
        t:equal({ #come, come[1].id, come[1].fitness },
          { 1, best[source][1].id, best[source][1].fitness })
      end
    end
  end
end)

suite:test("migrants come from the islands of the topology, and leave places to offspring",
  function(t)
    local seen = {}
    for _, topology in ipairs { "complete", "random" } do
      local history = finished(three({ survival = { "plus", share = 1 } },
        { every = 1, migrants = 2, topology = topology }))
      for g = 2, #history do
        local before, best = of_islands(history[g - 1].population, 3)
        local elites = { 0, 0, 0 }
        for _, robot in ipairs(history[g].population) do
          local k = robot.island
          if robot.origin == "elite" then elites[k] = elites[k] + 1 end
          for from = 1, robot.origin == "elite" and not before[k][robot.id] and 3 or 0 do
            if best[from][1].id == robot.id then seen[topology .. (from - k) % 3] = true end
          end
        end
        t:equal(elites, { 3, 3, 3 })
      end
    end
    t:equal(seen, { complete1 = true, complete2 = true, random1 = true, random2 = true })
  end)

suite:test("functions see one island, its state and its diversity", function(t)
  local history = finished(three {
    state = function() return { calls = {} } end,
    survival = function(robots, _, state)
      t:equal({ #robots, #robots.ranked, robots.state == state }, { 4, 4, true })
      for _, robot in ipairs(robots) do t:equal(robot.island, robots.island) end
      t:ok(limax.diversity.distinct(robots) <= 4)
      state.calls[robots.island] = (state.calls[robots.island] or 0) + 1
      return { robots.ranked[#robots.ranked] }
    end,
    selection = function(robots, _, state)
      t:equal(#robots.ranked, 1)
      t:ok(state.calls[robots.island] > 0)
      return robots.ranked[1], robots.ranked[1]
    end,
  })
  for g = 2, #history do
    local _, best = of_islands(history[g - 1].population, 3)
    for _, robot in ipairs(history[g].population) do
      local worst = best[robot.island][4].id
      if robot.origin == "bred" then t:equal(robot.parents, { worst, worst }) end
    end
  end
end)

suite:test("metrics have best and mean of each island", function(t)
  local history = finished(three())
  local _, best = of_islands(history[5].population, 3)
  for k, island in ipairs(history[5].islands) do
    t:equal({ island.best, island.scored }, { best[k][1].fitness, #best[k] })
    t:ok(island.mean <= island.best)
  end
  t:equal(finished()[1].islands, nil)
end)

suite:test("an island without a scored robot begins anew from all others", function(t)
  local history = finished(three({ generations = 2, population = 40, fitness = function(robot)
    return robot.id <= 2 and 0 / 0 or robot:distance()
  end }, { count = 20 }))
  t:equal(history[1].islands[1], { scored = 0 })
  local before = of_islands(history[1].population, 20)
  for _, robot in ipairs(history[2].population) do
    t:ok(robot.island ~= 1 or robot.origin == "bred" and not before[1][robot.parents[1]])
  end
end)

suite:test("MAP-Elites has an archive on each island, which migrants enter", function(t)
  local spec = three({ survival = "map_elites", generations = 6,
    archive = { "grid", descriptors = { "muscle_share" }, cells = 5 } }, { every = 1 })
  local history = finished(spec)
  local best, home = {}, {}
  for _, entry in ipairs(history) do
    for _, robot in ipairs(entry.population) do
      for _, parent in ipairs(robot.origin == "bred" and robot.parents or {}) do
        t:ok(home[parent][robot.island], "a parent of another island")
      end
    end
    for _, robot in ipairs(entry.population) do
      home[robot.id] = home[robot.id] or {}
      home[robot.id][robot.island] = true
      if robot.fitness then
        local cell = 5 * (robot.island - 1) + math.min(math.floor(5 * robot.descriptors[1]), 4) + 1
        if not best[cell] or robot.fitness > best[cell].fitness then best[cell] = robot end
      end
    end
  end
  local moved = false
  for _, row in ipairs(history[#history].population.remembered.rows) do
    t:equal({ row.id, row.island }, { best[row.cell].id, best[row.cell].island })
    moved = moved or best[row.cell].origin == "elite"
    best[row.cell] = nil
  end
  t:equal({ next(best), moved, history[6].archive.cells }, { nil, true, 15 })
  evolution.resumes(t, spec, { "r01/robots/g0003.npy" })
end)

suite:test("islands that cannot be are refused", function(t)
  local function refused(message, fields, islands)
    t:raises(message, function() evolution.small(three(fields, islands)) end)
  end
  refused("does not make 5 equal islands", nil, { count = 5 })
  refused("islands.migrants: expected at most 3", nil, { migrants = 4 })
  refused('islands: with the survival "map_elites" each has its own archive "grid" or "cvt"',
    { survival = "map_elites", archive = { "novelty", descriptors = { "contact" } } })
  t:raises("breed: in an experiment with islands, elites and parents come from its survival",
    function()
      local run = limax.start(evolution.small(three()), { say = evolution.silent })
      for robots in run:generations() do robots:score():breed { elites = { 1 } } end
    end)
end)
