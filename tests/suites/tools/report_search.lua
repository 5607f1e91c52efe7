--- report_search.lua: archives, fronts, islands, ages and step sizes in a report.

local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local reader = require "limax.run.reader"
local source = require "limax.base.source"

local suite = require("limax.test").suite "report, search"

local run, report, metrics_of = evolution.run, evolution.report, evolution.metrics

-- The numbers of the first chart of a page whose title begins so.
local function chart_named(page, title)
  for figure in page:gmatch '<figure class="chart">(.-)</figure>' do
    if figure:find('aria-label="' .. title, 1, true) then
      return assert(host.json.decode(figure:match '<script type="application/json">(.-)</script>'))
    end
  end
end

-- The robots of an archive with cells, as its arrays give them, and their letters by text.
local function robots_in(folder, generations)
  local by_cell, robots, by_text = {}, {}, {}
  for generation = 0, generations - 1 do
    for _, row in ipairs(reader.read(folder):rows(1, generation)) do
      if row.entered then by_cell[row.cell] = row end
    end
  end
  for _, row in pairs(by_cell) do
    robots[#robots + 1] = row
    by_text[("robot %d of generation %d: "):format(row.id, row.generation)] = row.letters
  end
  return robots, by_text
end

suite:test("a map has the robots of the archive, with their bodies", { limit = 20 }, function(t)
  local base = t:folder()
  local function mapped(name, archive)
    local folder = run(base .. "/" .. name, { archive = archive, survival = "map_elites",
      generations = 5, population = 12, lattice = { 3, 3, 2 } })
    report(t, base, { name, "--no-robots" })
    local page = source.read(folder .. "/report.html")
    return chart_named(page, "archive of fixed"), page, folder
  end
  local map, page, folder = mapped("grid", { "grid",
    descriptors = { { "muscle_share", cells = 4 }, { "voxel_share", cells = 5 } } })
  local rows, by_text = robots_in(folder, 5)
  t:equal(#map.robots.list, #rows)
  local lines = metrics_of(folder)
  t:equal(#rows, lines[#lines].archive.filled)
  for _, robot in ipairs(map.robots.list) do
    local letters = by_text[robot.text:match "^robot %d+ of generation %d+: "]
    t:equal(robot.letters, letters)
    t:near({ robot.box[3], robot.box[4] }, { (map.right - map.left) / 4,
      (map.bottom - map.top) / 5 }, { atol = 0.2 })
  end
  t:ok(page:find("hatched cells are empty", 1, true) and page:find("muscle_share (1)", 1, true))
  local curve = chart_named(page, "QD score").curves[1].points
  for k, line in ipairs(lines) do t:equal(curve[k], { k - 1, line.archive.qd_score }) end
  t:ok(not page:find('<section id="front"', 1, true) and not page:find "islands of")

  local done = process.completes(t, base, { "list", "." })
  t:ok(done.stdout:find "best%s+coverage%s+QD score"
    and done.stdout:find(("%.4g  "):format(lines[#lines].archive.coverage), 1, true), done.stdout)
  done = process.completes(t, base, { "run", host.home .. "/scripts/experiments/map_elites.lua",
    "--set=generations=1", "--set=population=4", "--set=simulation.duration=0.2" })
  t:ok(done.stderr:find("  coverage 0.", 1, true)
    and done.stdout:find("archive: robots in", 1, true), done.stderr)

  -- a cell of the plane has the best of its robots
  map, page, folder = mapped("cube", { "grid", cells = 3,
    descriptors = { "muscle_share", "voxel_share", "contact" } })
  local best = {}
  for _, row in ipairs((robots_in(folder, 5))) do
    local cell = (row.cell - 1) % 9
    best[cell] = math.max(best[cell] or -math.huge, row.fitness)
  end
  local count = 0
  for _ in pairs(best) do count = count + 1 end
  t:equal(#map.robots.list, count)
  for _, value in pairs(best) do
    t:ok(page:find((": fitness %.4g, "):format(value), 1, true), "the best of a cell")
  end
  t:ok(page:find("by the first two of 3 descriptors; of each cell the best", 1, true))
  -- one descriptor, and cells without a grid
  map = mapped("line", { "grid", descriptors = { "muscle_share" } })
  t:equal({ map.x, map.y, #map.robots.list > 0 }, { "muscle_share (1)", "fitness (m)", true })
  map = mapped("cvt", { "cvt", cells = 8, descriptors = { "muscle_share",
    { function(robot) return robot:mass() end, name = "own", range = { 0, 99 } } } })
  t:equal({ map.x, map.y }, { "muscle_share (1)", "own (unit of the script)" })
end)

suite:test("fronts, islands, ages and step sizes are drawn where a run has them", { limit = 20 },
  function(t)
    local base = t:folder()
    local folder = run(base .. "/a", { population = 12, generations = 5, lattice = { 3, 3, 2 },
      islands = { count = 2, every = 2, migrants = 1 }, genome = { mutation = "self_adaptive" },
      survival = { "nsga2", objectives = { "distance", "-mass" }, reference = { 0, 99 } } })
    report(t, base, { "a", "--no-robots" })
    report(t, base, { "a", "--no-robots", "--figures", "out" })
    local page, lines = source.read(folder .. "/report.html"), metrics_of(folder)
    local last = lines[#lines]
    local map = chart_named(page, "Pareto front of fixed")
    t:equal({ #map.robots.list, map.x, map.y }, { last.front.size, "distance (m)",
      "mass (kg; less is better)" })
    local print = source.read(base .. "/out/front.csv")
    t:equal(select(2, print:gsub("\nPareto[^\n]*,robots,", "")), last.front.size)
    t:equal(chart_named(page, "hypervolume").curves[1].points[5], { 4, last.front.hypervolume })
    for k, curve in ipairs(chart_named(page, "islands of fixed").curves) do
      t:equal({ curve.name, curve.points[5] }, { "island " .. k, { 4, last.islands[k].best } })
    end
    local steps = chart_named(page, "mean step size").curves[1].points
    t:equal(steps[#steps], { 4, last.step_size.mean })
    run(base .. "/b", { survival = "age_fitness" })
    report(t, base, { "b", "--no-robots" })
    page, lines = source.read(base .. "/b/report.html"), metrics_of(base .. "/b")
    t:equal(chart_named(page, "greatest age").curves[1].points[3], { 2, lines[3].age.most })
    t:ok(not page:find('<section id="archive"', 1, true) and not page:find('id="islands"', 1, true))
  end)

return suite
