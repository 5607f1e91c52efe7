--- report.lua: `limax report` and `limax list` on small real runs: the page has the runs' numbers,
--- loads nothing, shows what a run or a model wrote as text, and has the archive, front, islands,
--- ages and step sizes of runs that have them.

local activity = require "limax.tools.console.activity"
local evolution = require "support.evolution"
local forged = require "support.forged"
local host = require "limax.host"
local limax = require "limax"
local motion = require "limax.draw.motion"
local process = require "support.process"
local reader = require "limax.run.reader"
local report_page = require "limax.tools.report.page"
local replay = require "limax.tools.report.replay"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local talker = require "support.talker"
local trial = require "support.trial"

local suite = require("limax.test").suite "report"

local run, metrics_of = evolution.run, evolution.metrics
local contains = trial.contains

local function report(t, base, words) process.completes(t, base, { "report", unpack(words) }) end

-- The numbers of every chart of a page: lists of curves.
local function charts_of(page)
  local list = {}
  for figure in page:gmatch '<figure class="chart">(.-)</figure>' do
    local text = figure:match '<script type="application/json">(.-)</script>'
    list[#list + 1] = assert(host.json.decode(text))
    list[#list].title = figure:match 'aria%-label="([^"]*)'
  end
  return list
end

-- The first chart whose title begins so.
local function chart_named(page, title)
  for _, chart in ipairs(charts_of(page)) do
    if chart.title:sub(1, #title) == title then return chart end
  end
end

suite:test("the page has the run's numbers and loads nothing", function(t)
  local base = t:folder()
  run(base .. "/r", { generations = 4, supervisor = "random" })
  report(t, base, { "r", "--no-robots" })
  local page = source.read(base .. "/r/report.html")
  local charts, lines = charts_of(page), metrics_of(base .. "/r")
  local best, mean = charts[1].curves[1], charts[1].curves[2]
  t:equal({ best.name, mean.name, #best.points }, { "best", "mean", 4 })
  for k, line in ipairs(lines) do
    t:equal(best.points[k], { k - 1, line.best_standard or line.best })
    t:equal(mean.points[k], { k - 1, line.mean })
    t:ok(page:find(("%.4g</td>"):format(line.mean), 1, true), "the table of numbers has the mean")
  end
  for id in ("results learning diversity parameters failures cost lineage configuration")
    :gmatch "%l+" do
    contains(t, page, ('<section id="%s"'):format(id))
  end
  -- the only addresses are the names of SVG's own elements
  local stripped = page:gsub('xmlns="http://www.w3.org/2000/svg"', "")
    :gsub('"http://www.w3.org/2000/svg"', "")
  t:ok(not stripped:find "https?://", "no address")
  t:ok(page:find("default-src 'none'", 1, true) and not page:find("unsafe", 1, true))
  t:ok(not page:find "<[^>]- style=" and not page:find "<[^>]- on%l+=", "nothing runs inline")
end)

suite:test("several runs become arms, which are compared, with a film strip of each", function(t)
  local base = t:folder()
  for _, name in ipairs { "fixed", "rules" } do
    for seed = 1, 2 do
      run(("%s/%s%d"):format(base, name, seed), { supervisor = name, seed = seed })
    end
  end
  report(t, base, { "fixed1", "fixed2", "rules1", "rules2", "--out", "all.html" })
  local page = source.read(base .. "/all.html")
  local curves = charts_of(page)[1].curves
  t:equal({ #curves, curves[1].name, curves[2].name }, { 2, "fixed", "rules" })
  local first, second = metrics_of(base .. "/fixed1"), metrics_of(base .. "/fixed2")
  -- the centre of two is their mean
  t:near(curves[1].points[3][2], (first[3].best_standard + second[3].best_standard) / 2,
    { rtol = 1e-12 })
  contains(t, page, "median of n = 2 runs per arm; band: lowest to highest of 2.",
    "Fields in which the configurations differ", "too few runs for any claim",
    '<th scope="row">supervisor</th><td>&quot;fixed&quot;</td>', "film strip of rules, ")
  -- the comparison comes first: sentences, then a table
  local compared = page:match '<section.->(.-)</section>'
  t:ok(compared:find "<p>rules: too few runs for any.- all 2 pairs of runs.-</p>\n<div.-<table>"
    and compared:find('<tr><th scope="row">rules</th><td class="number">2</td>', 1, true), compared)
  t:equal(select(2, page:gsub('class="figure%-row"', "")), 4)
end)

suite:test("what a report is doing is shown, redrawn on a terminal, else every 10 s", function(t)
  local base = t:folder()
  local words = { run(base .. "/a", {}), run(base .. "/b", { supervisor = "random" }) }
  local texts = {}
  local function collect(text) texts[#texts + 1] = text end
  report_page.text(runs.read_all(words, false, collect), { progress = collect })
  contains(t, table.concat(texts, "\n"), "reading " .. words[2], "simulating random, gen",
    "comparing: ", "drawing Learning", "lineage of fixed")

  local function written(on_terminal)
    local parts, now = {}, 0
    local show = activity.new { on_terminal = on_terminal, columns = 12,
      clock = function() return now end, write = function(text) parts[#parts + 1] = text end }
    for _, text in ipairs { "first", "first", "second \27[31m text" } do
      show(text)
      now = now + 6
    end
    show()
    return table.concat(parts)
  end
  t:equal(written(true), "\r\27[Kfirst\r\27[Ksecond \\u00\r\27[K")
  t:equal(written(false), "second \\u001b[31m text\n")
end)

suite:test("a curve ends with its first repetition, many arms have no bands", function(t)
  local curves = require "limax.tools.report.curves"
  local function arm(name, state, ...)
    local made = { name = name, runs = {} }
    for k, values in ipairs { ... } do
      made.runs[k] = { state = state, lines = {} }
      for g, value in ipairs(values) do
        made.runs[k].lines[g] = { generation = g - 1, best = value }
      end
    end
    return made
  end
  local function best(line) return line.best end
  local points, band = curves.over(arm("a", "done", { 1, 2, 9 }, { 3, 4 }), best)
  t:equal(points, { { 0, 2 }, { 1, 3 } })
  t:equal(band, { { 0, 1, 3 }, { 1, 2, 4 } })
  points = curves.over(arm("a", "running", { 1, 2, 9 }, { 3, 4 }), best)
  t:equal(points, { { 0, 2 }, { 1, 3 }, { 2, 9 } })
  local list = {}
  for k = 1, 5 do list[k] = arm("arm " .. k, "done", { 1, 2 }, { 2, 3 }) end
  t:equal(#curves.panel(list, "", "", best).bands, 0)
  -- of eight or more the interval of their interquartile mean
  local eight = arm("a", "done", { 1 }, { 2 }, { 3 }, { 4 }, { 5 }, { 6 }, { 7 }, { 8 })
  points, band = curves.over(eight, best)
  t:equal(points, { { 0, 4.5 } })
  t:ok(band[1][2] > 1 and band[1][2] < 4 and band[1][3] > 5 and band[1][3] < 8)
end)

suite:test("the line of better parents leads from generation 0 to the champion", function(t)
  local lineage = require "limax.tools.report.lineage"
  local folder = run(t:folder() .. "/r", { generations = 8, population = 8 })
  local read = runs.read(folder).runs[1]
  local line = lineage.of(read)
  local champion = read.lines[8].champion
  t:equal({ line[1].generation, line[#line].id, line[#line].body.hash }, { 0, champion.id,
    champion.hash })
  for k = 2, #line do
    local is_parent = false
    for _, id in ipairs(line[k].parents) do is_parent = is_parent or id == line[k - 1].id end
    t:ok(is_parent and line[k].generation > line[k - 1].generation)
  end
end)

suite:test("figures for print have their width, and the numbers drawn in them", function(t)
  local base = t:folder()
  for seed = 1, 2 do
    run(("%s/r%d"):format(base, seed), { seed = seed, supervisor = "random" })
  end
  report(t, base, { "r1", "r2", "--figures", "out" })
  t:ok(not host.file.exists(base .. "/r1/report.html"), "no page")
  local lines = { metrics_of(base .. "/r1"), metrics_of(base .. "/r2") }
  local csv = source.read(base .. "/out/learning.csv")
  t:equal(csv:match "^[^\n]*", "panel,x_axis,y_axis,curve,x,y,low,high")
  for k = 1, 3 do
    local values = { lines[1][k].best_standard, lines[2][k].best_standard }
    local row = "best and mean,generation,fitness %%(m%%),best,%d,([^,]+),,"
    local drawn = csv:match(row:format(k - 1))
    t:near(tonumber(drawn), (values[1] + values[2]) / 2, { rtol = 1e-12 })
    local low = csv:match(("fitness %%(m%%),best,%d,,([^,]+),"):format(k - 1))
    t:equal(tonumber(low), math.min(unpack(values)))
  end
  for _, name in ipairs { "learning", "diversity", "parameters" } do
    t:ok(source.read(("%s/out/%s.csv"):format(base, name)), name)
    for _, width in ipairs { 85, 175 } do
      local svg = source.read(("%s/out/%s-%d.svg"):format(base, name, width))
      t:ok(svg:find(('width="%dmm"'):format(width), 1, true), name)
      t:ok(name == "parameters" or svg:find("n = 2", 1, true), name)
      t:ok(svg:find "</svg>%s*$", name)
      local pdf = source.read(("%s/out/%s-%d.pdf"):format(base, name, width))
      t:equal(pdf:sub(1, 5), "%PDF-")
    end
  end
end)

suite:test("HTML in a name, reason or note is shown as text", function(t)
  local base, evil = t:folder(), '</script><img src=x onerror="alert(1)"><!-- \' &'
  run(base .. "/r", { not_in_paper = { evil },
    supervisor = function() return { [evil] = evil, mutation_rate = 0.11 }, evil end })
  -- an experiment's name cannot be like this; a folder from elsewhere may say so
  forged.object(base .. "/r", "config.json", function(config)
    config.name, config.supervisor = evil, evil
  end)
  report(t, base, { "r", "--no-robots" })
  local page = source.read(base .. "/r/report.html")
  t:ok(not page:find("<img", 1, true) and not page:find("onerror=\"", 1, true), "inert")
  t:ok(page:find("&lt;/script&gt;&lt;img src=x onerror=&quot;alert(1)&quot;&gt;&lt;!-- &#39; &amp;",
    1, true), "shown as it is")
  for text in page:gmatch '<script type="application/json">(.-)</script>' do
    t:ok(not text:find("<", 1, true), "JSON cannot end its element")
  end
end)

suite:test("a model's run and its replay: who set what, the cost, its answers as text", function(t)
  local evil = "<script>alert(1)</script>"
  local model = talker.run(t, { "llm", client = talker.new(function(_, n)
    return host.json.encode { mutation_rate = n == 2 and 7 or 0.12, reason = evil }
  end) })
  local again = talker.run(t, { "replay", run = model.folder })
  report(t, t:folder(), { model.folder, again.folder, "--no-robots", "--out",
    model.folder .. "/both.html" })
  local page = source.read(model.folder .. "/both.html")
  local setters = {}
  for _, chart in ipairs(charts_of(page)) do
    local titles = {}
    for k, curve in ipairs(chart.curves) do titles[k] = curve.name .. " " .. #curve.points end
    if chart.y == "mutation_rate (per gene)" then setters[#setters + 1] = titles end
  end
  t:equal(setters, {
    { "repetition 1 4", "set by: model 3", "set by: clamped 1" },
    { "repetition 1 4", "set by: replayed 3", "set by: clamped 1" } })
  t:ok(page:find("model&#39;s questions", 1, true), "a column of the cost")
  t:ok(page:find("&lt;script&gt;alert(1)", 1, true) and not page:find(evil, 1, true))
end)

suite:test("a run in progress is reported and listed", function(t)
  local base = t:folder()
  run(base .. "/runs/half", { supervisor = "random" })
  local folder = base .. "/runs/half"
  -- as a process leaves its journal that was killed in the middle of its third generation
  local text = source.read(folder .. "/journal.jsonl")
  assert(host.file.write_atomic(folder .. "/journal.jsonl",
    text:match "^[^\n]*\n[^\n]*\n[^\n]*\n" .. '{"hash":"0123'))
  run(base .. "/runs/whole", { supervisor = "fixed", seed = 7 })
  report(t, base, { "runs/half", "--no-robots", "--out", "half.html" })
  t:equal(#charts_of(source.read(base .. "/half.html"))[1].curves[1].points, 2)
  local done = process.completes(t, base, { "list" })
  t:ok(done.stdout:find "runs/half +stopped +random +1 +1 +2/3 ", done.stdout)
  t:ok(done.stdout:find "runs/whole +done +fixed +7 +1 +3/3 ", done.stdout)
end)

suite:test("limax list --robots has the best robots of the last generations", function(t)
  local base, expected = t:folder(), {}
  evolution.script(base .. "/try.lua", "repetitions = 2, lattice = { 3, 2, 2 },"
    .. " fitness = function(robot) return robot:distance(), { mass = robot.body.mass } end")
  process.completes(t, base, { "run", "-q", "try.lua", "--out", "r" })
  for repetition = 1, 2 do
    for _, row in ipairs(reader.read(base .. "/r"):rows(repetition, 2)) do
      local body, parents = row.body, table.concat(row.parents, "+")
      if row.fitness then
        expected[#expected + 1] = { row.fitness, ("%d %d %d %.4g %s %.4g %.4g %.4g %s %d"):format(
          row.id, repetition, row.generation, row.fitness, parents ~= "" and parents or "-",
          row.fitness, row.fitness / row.outcome.time, row.measures.mass,
          table.concat(body.size, "x"), body.voxels) }
      end
    end
  end
  table.sort(expected, function(a, b) return a[1] > b[1] end)
  for _, count in ipairs { 3, 10 } do
    local done = process.completes(t, base, { "list", "--robots", "r", tostring(count) })
    local lines = {}
    for line in done.stdout:gmatch "[^\n]+" do
      lines[#lines + 1] = line:gsub("^ +", ""):gsub(" +", " ")
    end
    t:equal(table.remove(lines, 1),
      "id repetition generation fitness parents distance speed mass body voxels")
    t:equal(#lines, math.min(count, #expected))
    for k, line in ipairs(lines) do t:equal(line, expected[k][2]) end
  end
  process.fails(t, base, 2, { "list", "--robots", "r", "0" },
    'N is "0"; expected a whole number from 1')
  process.fails(t, base, 2, { "list", "--robots", "." }, "is not a run folder")
end)

suite:test("the replay of a robot of 5x5x5 voxels takes less than 150 kB for 5 s", function(t)
  local body = limax.robot { voxels = (("ecsbe\n"):rep(5) .. "\n"):rep(5) }
  local walked = motion.simulate(body, { scene = limax.scenes.land(), duration = 5 })
  local data = replay.of(walked)
  -- all masses except the inner 4x4x4
  t:equal({ data.masses, #data.materials }, { 216 - 64, 150 })
  t:equal((data.samples - 1) / data.rate, walked:duration())
  local row, height = walked:trace "position", 0
  for s = 0, data.samples - 1 do height = height + data.steps[s * data.masses * 3 + 3] end
  t:near(height * data.step, row[row:size()][1][3], { atol = data.step })
  t:ok(#replay.packed(walked) < 150e3)
  t:equal(data.tints, nil)
end)

suite:test("a replay has the activations of a controller, and its target", function(t)
  local scene = limax.scenes.land { actuation = false, target = true,
    moving_boxes = { from = { 1, 1, 1 }, to = { 2, 2, 2 }, velocity = { 0, 3, 0 }, turns = 0.15 },
    block = { position = { 1, 0, 0 } }, control = { signal = "a = 1;", rate = 20 } }
  local data = replay.of(motion.simulate(limax.robot { voxels = "es" },
    { scene = scene, duration = 0.2 }))
  local faces = #data.materials
  t:equal(#data.tints, data.samples * faces)
  -- at the end the muscle's five faces are light; the passive voxel's and the block's are plain
  local light = 0
  for f = #data.tints - faces + 1, #data.tints do
    light = light + (data.tints[f] == 135 and 1 or 0)
    t:ok(data.tints[f] == 135 or data.tints[f] == 100)
  end
  t:equal(light, 5)
  t:ok(data.world.target)
  local moving = data.world.moving[1]
  t:equal({ #moving.parts, #moving.path }, { 6, 3 * data.samples })
  t:near(moving.path[#moving.path - 1], 0.3) -- m: 0.15 s forwards, 0.05 s back
end)

-- ---- archives, fronts, islands ------------------------------------------------------------------

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

suite:test("a map has the robots of the archive, with their bodies", function(t)
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
  -- a cell of the plane has the best of its robots
  map, page, folder = mapped("cube", { "grid", cells = 3,
    descriptors = { "muscle_share", "voxel_share", "contact" } })
  local best, count = {}, 0
  for _, row in ipairs((robots_in(folder, 5))) do
    local cell = (row.cell - 1) % 9
    count = count + (best[cell] and 0 or 1)
    best[cell] = math.max(best[cell] or -math.huge, row.fitness)
  end
  t:equal(#map.robots.list, count)
  for _, value in pairs(best) do contains(t, page, (": fitness %.4g, "):format(value)) end
  -- one descriptor, and cells without a grid
  map = mapped("line", { "grid", descriptors = { "muscle_share" } })
  t:equal({ map.x, map.y, #map.robots.list > 0 }, { "muscle_share (1)", "fitness (m)", true })
  map = mapped("cvt", { "cvt", cells = 8, descriptors = { "muscle_share",
    { function(robot) return robot:mass() end, name = "own", range = { 0, 99 } } } })
  t:equal({ map.x, map.y }, { "muscle_share (1)", "own (unit of the script)" })
end)

suite:test("fronts, islands, ages and step sizes are drawn where a run has them", function(t)
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
