--- archive.lua: archives: which robots each of them keeps, against a plain statement of its rule,
--- what breeds from them, and that a run that continues gives the same bytes.

local limax = require "limax"
local evolution = require "support.evolution"
local neighbours = require "limax.experiment.archives.neighbours"

local suite = require("limax.test").suite "archive"

local finished = evolution.finished

local function height(robot) return robot.body.size[3] end

-- The rows of the archive after the last generation.
local function rows_of(history) return history[#history].population.remembered.rows end

-- Checks that the archive holds the best robot of each cell, of all new robots with a score;
-- returns them.
local function check_cells(t, history, cell_of)
  local best, filled = {}, 0
  for _, entry in ipairs(history) do
    for _, record in ipairs(evolution.scored(entry.population)) do
      if record.generation == entry.generation then
        local cell = cell_of(record)
        filled = filled + (best[cell] and 0 or 1)
        if not best[cell] or record.fitness > best[cell].fitness then best[cell] = record end
      end
    end
  end
  t:equal(#rows_of(history), filled)
  for _, row in ipairs(rows_of(history)) do t:equal(row.id, best[row.cell].id) end
  return best, filled
end

local GRID = { "grid", cells = 3, qd_offset = -1, descriptors = { "muscle_share",
  { height, name = "height", range = { 1.2, 1.8 }, cells = 2 } } }

suite:test("a grid keeps the best robot of each cell, clamped to its range", function(t)
  local history = finished { archive = GRID, survival = "map_elites", generations = 4 }
  local best, filled = check_cells(t, history, function(record)
    local shares = record.body.counts
    local muscle = (shares["expanding muscle"] + shares["contracting muscle"]) / record.body.voxels
    t:equal(record.descriptors, { muscle, record.body.size[3] })
    return 1 + math.min(math.floor(muscle * 3), 2) + 3 * math.min(record.body.size[3] - 1, 1)
  end)
  local score, top = 0, -math.huge
  for _, record in pairs(best) do
    score, top = score + record.fitness + 1, math.max(top, record.fitness)
  end
  local line = history[#history].archive
  t:equal({ line.cells, line.filled, line.coverage, line.best }, { 6, filled, filled / 6, top })
  t:near(line.qd_score, score, { rtol = 1e-12 })
end)

suite:test("map_elites breeds from the archive only, with right parents and genomes", function(t)
  local seen = {}
  local history = finished { archive = GRID, survival = "map_elites", generations = 4,
    breeding = { mutation_rate = 0, crossover_rate = 0 }, supervisor = "fixed",
    selection = function(pool, random)
      for k = 1, #pool.ranked do seen[pool[pool.ranked[k]].id] = true end
      return pool.ranked[random:integer(#pool.ranked)], pool.ranked[1]
    end }
  local by_id = {}
  for k, entry in ipairs(history) do
    for _, robot in ipairs(entry.population) do
      t:ok(by_id[robot.id] == nil, "an id twice")
      if k > 1 then
        t:equal({ robot.origin, robot.generation }, { "bred", entry.generation })
        t:ok(seen[robot.parents[1]] and seen[robot.parents[2]], "a parent in the pool")
        -- without variation a child is a copy of its first parent
        t:equal(robot.body.hash, by_id[robot.parents[1]].body.hash)
      end
    end
    for _, robot in ipairs(entry.population) do by_id[robot.id] = robot end
  end
end)

-- The squared distance of two lists of numbers.
local function apart(a, b)
  local sum = 0
  for d = 1, #a do sum = sum + (a[d] - b[d]) ^ 2 end
  return sum
end

local SHARES = { "muscle_share", { "voxel_share", range = { 0.5, 1 } } }

suite:test("a CVT keeps the best robot of the nearest centre, and spreads its centres", function(t)
  local history = finished { archive = { "cvt", cells = 12, descriptors = SHARES },
    survival = "map_elites", generations = 4 }
  local centres = limax.archive.centres(12, 2)
  check_cells(t, history, function(record)
    local point = { record.descriptors[1], math.max(0, 2 * record.descriptors[2] - 1) }
    local nearest = 1
    for cell, centre in ipairs(centres) do
      if apart(point, centre) < apart(point, centres[nearest]) then nearest = cell end
    end
    return nearest
  end)
  -- no two of 50 centres are closer than half of what even squares would have
  centres = limax.archive.centres(50, 2)
  for i = 1, #centres do
    for j = 1, i - 1 do t:ok(apart(centres[i], centres[j]) > 0.25 / 50) end
  end
  t:raises("would take hours", function() limax.archive.centres(1e5, 5) end)
end)

-- Mean distance to the nearest k of a list of { id, descriptors }, without the robot itself.
local function novelty_of(record, others, k)
  local distances = {}
  for _, other in ipairs(others) do
    if other.id ~= record.id then
      -- the second range is half as long
      local a, b = record.descriptors, other.descriptors
      distances[#distances + 1] = math.sqrt((a[1] - b[1]) ^ 2 + (2 * (a[2] - b[2])) ^ 2)
    end
  end
  table.sort(distances)
  local sum, count = 0, math.min(k, #distances)
  for n = 1, count do sum = sum + distances[n] end
  return count > 0 and sum / count or 0
end

suite:test("novelty is the mean distance to the nearest of archive and population", function(t)
  local history = finished { generations = 5, population = 10,
    archive = { "novelty", descriptors = SHARES, k = 3, threshold = 0.05 },
    survival = { "novelty", share = 0.5 } }
  local rows, kept = {}, rows_of(history)
  for k, entry in ipairs(history) do
    local others, scored = { unpack(rows) }, evolution.scored(entry.population)
    for _, record in ipairs(scored) do others[#others + 1] = record end
    for _, record in ipairs(scored) do
      t:near(record.novelty, novelty_of(record, others, 3), { atol = 1e-12 })
      if record.generation == entry.generation then
        local next_row = kept[#rows + 1]
        t:equal(next_row ~= nil and next_row.id == record.id, record.novelty >= 0.05)
        if record.novelty >= 0.05 then rows[#rows + 1] = record end
      end
    end
    t:equal(entry.archive.filled, #rows)
    -- the survivors are the most novel half
    local novelties, survivors = {}, history[k + 1] and evolution.survivors(history[k + 1], 5) or {}
    for n, record in ipairs(scored) do novelties[n] = record.novelty end
    table.sort(novelties, function(a, b) return a > b end)
    for _, record in ipairs(scored) do
      if survivors[record.id] then t:ok(record.novelty >= novelties[5]) end
    end
  end
end)

suite:test("robots enter a novelty archive at random, and the oldest leave it", function(t)
  local history = finished { archive = { "novelty", descriptors = SHARES, add = 2, capacity = 5 },
    generations = 4, population = 8 }
  local generations = {}
  for k, row in ipairs(rows_of(history)) do generations[k] = row.generation end
  t:equal(generations, { 1, 2, 2, 3, 3 })
end)

suite:test("each resumes to the same bytes", function(t)
  local files = { "r01/robots/g0003.npy" }
  evolution.resumes(t, { survival = "map_elites", archive = GRID }, files)
  evolution.resumes(t, { survival = "map_elites",
    archive = { "cvt", cells = 20, descriptors = SHARES } }, files)
  evolution.resumes(t, { survival = "novelty",
    archive = { "novelty", descriptors = SHARES, k = 3, add = 2, capacity = 5 } }, files)
end)

suite:test("MAP-Elites draws parents evenly unless a selection is named", function(t)
  local experiment = evolution.small { archive = GRID, survival = "map_elites" }
  t:equal(experiment.config.selection, { name = "truncation", share = 1 })
  t:equal(experiment:override({ "population=8" }).config.selection, experiment.config.selection)
  t:equal(experiment:override({ "selection=rank" }).config.selection, "rank")
end)

suite:test("an archive beside another survival changes no result", function(t)
  local with, without = t:folder() .. "/with", t:folder() .. "/without"
  finished({ archive = GRID }, { out = with })
  finished({}, { out = without })
  evolution.same_files(t, with, without, { "r01/genomes/g0002.npy" })
end)

suite:test("a survival, a selection and an own loop may name rows as parents", function(t)
  local history = finished { archive = GRID, generations = 4,
    survival = function(robots) return { robots.ranked[1] }, robots.archive end,
    selection = function(pool, random)
      return pool.ranked[random:integer(#pool.ranked)], pool.archive[1]
    end }
  t:equal(history[4].population[2].parents[2], history[4].population.archive[1].id)
  local loop = limax.start(evolution.small { archive = GRID, generations = 3 },
    { say = evolution.silent })
  for robots in loop:generations() do
    robots:simulate():score()
    local pairs_of_parents = {}
    for child = 1, #robots do
      pairs_of_parents[child] = { robots.archive[1], robots.ranked[1] }
    end
    -- rows are copies
    robots.archive[1].fitness, robots.archive[1].descriptors[1] = 1e9, -1
    robots:breed { parents = pairs_of_parents, elites = {} }
  end
  t:equal(#loop.history, 3)
  t:ok(loop.history[3].archive.best < 1e9)
end)

suite:test("neighbours are those of a search of all points", function(t)
  local random = limax.engine.random(1, 1, "user")
  for dimensions = 1, 5 do
    local points = {}
    for i = 1, 300 do
      points[i] = {}
      -- few values, so that many distances are equal
      for d = 1, dimensions do points[i][d] = random:integer(12) end
    end
    local search = neighbours.new(points, dimensions)
    for i = 1, 40 do
      local best, query = math.huge, {}
      for d = 1, dimensions do query[d] = 14 * random:uniform() - 1 end
      for _, point in ipairs(points) do best = math.min(best, apart(point, query)) end
      t:near(apart(points[search:nearest_to(query)], query), best, { rtol = 1e-12 })
      t:equal(search.order[search.place[i] + 1], i)
    end
  end
end)

suite:test("a run goes on with another grid, and not with other descriptors", function(t)
  local options = { out = t:folder() .. "/run", resume = true, changed = true }
  local function go_on(generations, archive)
    return finished({ archive = archive, generations = generations }, options)
  end
  go_on(2, GRID)
  local history = go_on(4, { "grid", cells = 2, descriptors = GRID.descriptors })
  t:equal(history[4].archive.cells, 4)
  t:raises("its robots have 2 descriptors, and 1 are needed", function()
    go_on(5, { "grid", descriptors = { "muscle_share" } })
  end)
end)

suite:test("mistakes are refused with field and remedy", function(t)
  local function refused(message, fields)
    t:raises(message, function() evolution.small(fields) end)
  end
  local function grid(descriptors)
    return { archive = { "grid", descriptors = descriptors } }
  end
  refused('descriptors%[2%]: "distance" needs a range in m', grid { "contact", "distance" })
  refused('descriptors%[2%]: "contact" is in the list already', grid { "contact", "contact" })
  refused('survival: "map_elites" needs an archive', { survival = "map_elites" })
  t:raises("robot 1 of the first generation: descriptor 1 %(function%) is nil, .*archive.lua:%d+",
    function()
      finished(grid { { function() end, range = { 0, 1 } } })
    end)
  t:raises("is a table; expected an index or a row of the archive that it has now", function()
    finished { archive = GRID, survival = function() return {}, { {} } end }
  end)
end)
