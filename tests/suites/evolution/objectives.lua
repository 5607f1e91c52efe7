--- objectives.lua: survival by several objectives and by age, and the archive of a Pareto front:
--- each against a plain statement of its rule, by the ranks of the engine, which its own tests
--- check, and that they resume to the same bytes.

local limax = require "limax"
local engine = require "limax.engine"
local evolution = require "support.evolution"
local front = require "limax.experiment.front"

local suite = require("limax.test").suite "objectives"

local finished, scored, survivors = evolution.finished, evolution.scored, evolution.survivors

-- Distance and negative mass of records, and their ids.
local function points_of(records)
  local points, ids = {}, {}
  for i, record in ipairs(records) do
    points[i], ids[i] = { record.objectives[1], -record.objectives[2] }, record.id
  end
  return points, ids
end

-- Checks that no robot is left out of the survivors for one of a worse front.
local function check_fronts(t, records, ranks, goes_on)
  local worst = 0
  for i, record in ipairs(records) do
    worst = goes_on[record.id] and math.max(worst, ranks[i]) or worst
  end
  for i, record in ipairs(records) do
    t:ok(goes_on[record.id] or ranks[i] >= worst, "a better front")
  end
end

local OBJECTIVES = { "distance", "-mass" }

suite:test("nsga2 keeps the first fronts, and metrics have the front", function(t)
  local history = finished { population = 12, generations = 4,
    survival = { "nsga2", objectives = OBJECTIVES, reference = { 0, 10 } } }
  for k, entry in ipairs(history) do
    local records = scored(entry.population)
    local ranks, size = engine.pareto((points_of(records))), 0
    for _, robot in ipairs(entry.population) do
      t:equal(robot.objectives, robot.fitness and { robot:distance(), robot:mass() })
    end
    for _, rank in ipairs(ranks) do size = size + (rank == 1 and 1 or 0) end
    t:equal(entry.front.size, size)
    t:ok(entry.front.hypervolume > 0)
    if history[k + 1] then
      check_fronts(t, records, ranks, survivors(history[k + 1], 6))
      t:equal(history[k + 1].population[7].origin, "bred")
    end
  end
end)

suite:test("a measure that the fitness returns comes before limax's of the same name", function(t)
  local history = finished { survival = { "nsga2", objectives = OBJECTIVES }, generations = 2,
    fitness = function(robot) return robot:distance(), { mass = robot.id } end }
  for _, record in ipairs(scored(history[1].population)) do
    t:equal(record.objectives[2], record.id)
  end
end)

suite:test("a Pareto archive holds what no robot of the run dominates", function(t)
  local history = finished { population = 10, generations = 4, survival = "map_elites",
    archive = { "pareto", objectives = OBJECTIVES } }
  local all = {}
  for _, entry in ipairs(history) do
    for _, record in ipairs(scored(entry.population)) do all[#all + 1] = record end
  end
  local points, ids = points_of(all)
  local front_ids, kept = {}, {}
  for i, rank in ipairs((engine.pareto(points))) do front_ids[ids[i]] = rank == 1 or nil end
  local rows = history[#history].population.remembered.rows
  for _, row in ipairs(rows) do kept[row.id] = true end
  t:equal(kept, front_ids)
  t:equal({ history[4].front.size, history[4].archive.filled }, { #rows, #rows })
  t:equal(history[4].front.hypervolume, nil)
end)

suite:test("a full Pareto archive keeps the ends of its front and the least crowded", function(t)
  local archive = limax.archive.get { "pareto", objectives = OBJECTIVES, capacity = 4 }
  local rows, random = {}, limax.engine.random(1, 1, "user")
  local function offer(...)
    local candidates, stay, distances = {}, {}, {}
    for k, distance in ipairs { ... } do
      candidates[k] = { id = 10 * distance, objectives = { distance, distance } }
    end
    local entered, leaving = archive.choose(rows, {}, candidates, random)
    -- a resumed run reads only those that entered
    t:equal({ archive.choose(rows, {}, entered) }, { entered, leaving })
    for _, row in ipairs(rows) do
      if not leaving or not leaving[row.id] then stay[#stay + 1] = row end
    end
    for _, row in ipairs(entered) do stay[#stay + 1] = row end
    for k, row in ipairs(stay) do distances[k] = row.objectives[1] end
    table.sort(distances)
    rows = stay
    return distances
  end
  t:equal(offer(0, 1, 2, 6), { 0, 1, 2, 6 })
  t:equal(offer(4), { 0, 2, 4, 6 })
  t:equal(offer(0.1, 9, 5), { 0, 2, 6, 9 })
end)

suite:test("hypervolume is exact in two and three dimensions", function(t)
  local random = limax.engine.random(1, 1, "user")
  for dimensions = 2, 3 do
    local points, grid, inside = {}, 8, 0
    -- corners on a lattice: the volume is the number of its dominated cells
    for i = 1, 6 do
      points[i] = {}
      for k = 1, dimensions do points[i][k] = random:integer(0, grid) - 1 end
    end
    for cell = 0, grid ^ dimensions - 1 do
      local covered = false
      for _, point in ipairs(points) do
        local under, rest = true, cell
        for k = 1, dimensions do
          under = under and point[k] >= rest % grid + 1
          rest = math.floor(rest / grid)
        end
        covered = covered or under
      end
      if covered then inside = inside + 1 end
    end
    t:equal(front.hypervolume(points, dimensions == 2 and { 0, 0 } or { 0, 0, 0 }), inside)
  end
end)

suite:test("age_fitness: ages follow the oldest ancestor, newcomers are random", function(t)
  local history = finished { population = 10, generations = 5,
    survival = { "age_fitness", share = 0.4, newcomers = 2 } }
  local bodies = {}
  for k, entry in ipairs(history) do
    local before, fresh = {}, 0
    for _, record in ipairs(k > 1 and scored(history[k - 1].population) or {}) do
      before[record.id] = record
    end
    for _, robot in ipairs(entry.population) do
      local record = robot.record
      if record.origin == "initial" then
        t:equal({ record.age, #record.parents, record.generation }, { 0, 0, entry.generation })
        fresh = fresh + 1
        t:ok(not bodies[record.body.hash], "a body of before")
        bodies[record.body.hash] = true
      elseif record.origin == "elite" then
        t:equal(record.age, before[record.id].age + 1)
      else
        local first, second = before[record.parents[1]], before[record.parents[2]]
        t:equal(record.age, math.max(first.age, second.age) + 1)
      end
    end
    t:equal(fresh, k == 1 and 10 or 2)
    -- survivors: the first fronts of fitness and youth
    local records, points = scored(entry.population), {}
    for i, record in ipairs(records) do points[i] = { record.fitness, -record.age } end
    if history[k + 1] then
      check_fronts(t, records, engine.pareto(points), survivors(history[k + 1], 4))
    end
  end
  t:ok(history[5].age.most >= history[5].age.mean)
end)

suite:test("each resumes to the same bytes", function(t)
  evolution.resumes(t, { survival = { "nsga2", objectives = OBJECTIVES, reference = { 0, 9 } } })
  evolution.resumes(t, { survival = "map_elites",
    archive = { "pareto", objectives = OBJECTIVES, capacity = 3 } }, { "r01/robots/g0003.npy" })
  evolution.resumes(t, { survival = "age_fitness" })
  evolution.resumes(t, { survival = "age_fitness", islands = { count = 2, every = 2,
    migrants = 1 } })
end)

suite:test("mistakes are refused with field and remedy", function(t)
  local function refused(message, fields)
    t:raises(message, function() evolution.small(fields) end)
  end
  refused('survival "nsga2".objectives: expected a list of 2 to 8 measures',
    { survival = { "nsga2", objectives = { "distance" } } })
  refused("reference: expected one number for each of the 2 objectives",
    { survival = { "nsga2", objectives = OBJECTIVES, reference = { 1 } } })
  refused('archive.objectives: the survival "nsga2" has others; both must be the same',
    { survival = { "nsga2", objectives = OBJECTIVES },
      archive = { "pareto", objectives = { "distance", "mass" } } })
  refused("survival.newcomers: expected at most", { survival = { "age_fitness", newcomers = 99 } })
  refused("threshold and add: name one", { archive = { "novelty", descriptors = { "mass" },
    threshold = 1, add = 1 } })
end)
