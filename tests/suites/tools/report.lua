--- report.lua: `limax report` and `limax list` on small real runs: the page has the runs' numbers,
--- loads nothing, and shows what a run or a model wrote as text.

local evolution = require "support.evolution"
local forged = require "support.forged"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local source = require "limax.base.source"
local talker = require "support.talker"

local suite = require("limax.test").suite "report"

local run, report, metrics_of = evolution.run, evolution.report, evolution.metrics

-- The numbers of every chart of a page: lists of curves.
local function charts_of(page)
  local list = {}
  for text in page:gmatch '<script type="application/json">(.-)</script>' do
    list[#list + 1] = assert(host.json.decode(text))
  end
  return list
end

suite:test("the page has the run's numbers and loads nothing", { limit = 20 }, function(t)
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
  for _, id in ipairs { "results", "learning", "diversity", "parameters", "failures", "cost",
    "lineage", "configuration" } do
    t:ok(page:find(('<section id="%s"'):format(id), 1, true), id)
  end
  -- the only addresses are the names of SVG's own elements
  local stripped = page:gsub('xmlns="http://www.w3.org/2000/svg"', "")
    :gsub('"http://www.w3.org/2000/svg"', "")
  t:ok(not stripped:find "https?://", "no address")
  t:ok(page:find("default-src 'none'", 1, true) and not page:find("unsafe", 1, true))
  t:ok(not page:find "<[^>]- style=" and not page:find "<[^>]- on%l+=", "nothing runs inline")
end)

suite:test("other measures of a fitness are drawn, on the page and in figures",
  { limit = 20 }, function(t)
    local base = t:folder()
    run(base .. "/r", { fitness = function(robot)
      return robot:distance(), { voxels = robot.body.voxels, way = robot:distance() }
    end })
    report(t, base, { "r", "--no-robots" })
    report(t, base, { "r", "--no-robots", "--figures", "out" })
    local page = source.read(base .. "/r/report.html")
    t:ok(page:find('<section id="measures"', 1, true) and page:find("way of the champion", 1, true))
    local points = {}
    for k, line in ipairs(metrics_of(base .. "/r")) do
      points[k] = { line.generation, line.measures.voxels.champion }
    end
    local found
    for _, chart in ipairs(charts_of(page)) do
      if chart.y == "voxels" then found = chart.curves[1].points end
    end
    t:equal(found, points)
    t:ok(source.read(base .. "/out/measures.csv"):find("way of the champion", 1, true))
  end)

suite:test("several runs become arms side by side, and their differences", { limit = 20 },
  function(t)
    local base = t:folder()
    for _, name in ipairs { "fixed", "rules" } do
      for seed = 1, 2 do
        run(("%s/%s%d"):format(base, name, seed), { supervisor = name, seed = seed })
      end
    end
    report(t, base, { "fixed1", "fixed2", "rules1", "rules2", "--no-robots", "--out", "all.html" })
    local page = source.read(base .. "/all.html")
    local curves = charts_of(page)[1].curves
    t:equal({ #curves, curves[1].name, curves[2].name }, { 2, "fixed", "rules" })
    local first, second = metrics_of(base .. "/fixed1"), metrics_of(base .. "/fixed2")
    -- the centre of two is their mean
    t:near(curves[1].points[3][2], (first[3].best_standard + second[3].best_standard) / 2,
      { rtol = 1e-12 })
    t:ok(page:find("median of n = 2 runs per arm; band: lowest to highest of 2.", 1, true))
    t:ok(page:find("Fields in which the configurations differ", 1, true))
    t:ok(page:find('<th scope="row">supervisor</th><td>&quot;fixed&quot;</td>', 1, true))
    t:equal(select(2, page:gsub('label="better parents of the champion of %l+, seed %d', "")), 2)
  end)

suite:test("the report has the comparison, and a film strip of each robot", { limit = 20 },
  function(t)
    local base = t:folder()
    for _, name in ipairs { "fixed", "rules" } do
      run(("%s/%s"):format(base, name), { supervisor = name, generations = 1 })
    end
    report(t, base, { "fixed", "rules", "--out", "all.html" })
    local page = source.read(base .. "/all.html")
    t:ok(page:find("too few runs for any claim", 1, true))
    t:equal(select(2, page:gsub('class="figure%-row"', "")), 2)
    t:ok(page:find("film strip of rules, generation 0", 1, true))
  end)

suite:test("a curve ends with the first repetition that ends, bands are left out of many arms",
  function(t)
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
    t:equal(curves.meaning(list), "Lines: median of n = 2 runs per arm.")
    list[5] = nil
    t:equal(#curves.panel(list, "", "", best).bands, 4)
    -- of eight or more the interval of their interquartile mean
    local eight = arm("a", "done", { 1 }, { 2 }, { 3 }, { 4 }, { 5 }, { 6 }, { 7 }, { 8 })
    points, band = curves.over(eight, best)
    t:equal(points, { { 0, 4.5 } })
    t:ok(band[1][2] > 1 and band[1][2] < 4 and band[1][3] > 5 and band[1][3] < 8)
  end)

suite:test("the line of better parents leads from generation 0 to the champion", { limit = 20 },
  function(t)
    local lineage, runs = require "limax.tools.report.lineage", require "limax.tools.report.runs"
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

suite:test("without three.js the page says so and has the film strips", { limit = 20 }, function(t)
  local robots, runs = require "limax.tools.report.robots", require "limax.tools.report.runs"
  local folder = run(t:folder() .. "/r", { lattice = { 3, 3, 3 },
    scene = limax.scenes.stairs() })
  local list = runs.arms { runs.read(folder) }
  local found = robots.javascript
  robots.javascript = function() return nil end
  local shown = robots.section(list, {})
  robots.javascript = found
  t:equal(#shown.scripts, 0)
  t:ok(shown.body:find("libjs-three", 1, true) and not shown.body:find("<canvas", 1, true))
  t:equal(select(2, shown.body:gsub("<svg ", "")), 2)
  -- names within the pictures are apart
  t:ok(shown.body:find('id="strip1-clip1"', 1, true))
  t:ok(shown.body:find("url(#strip2-clip6)", 1, true))
  local ids = {}
  for id in shown.body:gmatch ' id="([^"]+)"' do
    t:ok(not ids[id], id .. " is there once")
    ids[id] = true
  end
  for id in shown.body:gmatch "url%(#([^)]+)%)" do t:ok(ids[id], id .. " is there") end
end)

suite:test("figures for print have their width, and the numbers drawn in them", { limit = 20 },
  function(t)
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
      local low, high = csv:match(("fitness %%(m%%),best,%d,,([^,]+),([^\n]+)\n"):format(k - 1))
      t:equal({ tonumber(low), tonumber(high) }, { math.min(unpack(values)),
        math.max(unpack(values)) })
    end
    for _, name in ipairs { "learning", "diversity", "parameters" } do
      t:ok(source.read(("%s/out/%s.csv"):format(base, name)), name)
      for _, width in ipairs { 85, 175 } do
        local svg = source.read(("%s/out/%s-%d.svg"):format(base, name, width))
        t:ok(svg:find(('width="%dmm"'):format(width), 1, true), name)
        -- 8 pt, and nothing else
        for size in svg:gmatch '<text[^>]-font%-size="([%d.]+)"' do t:equal(size, "10.67") end
        t:ok(name == "parameters" or svg:find("n = 2", 1, true), name)
        t:ok(svg:find "</svg>%s*$", name)
        local pdf = source.read(("%s/out/%s-%d.pdf"):format(base, name, width))
        t:equal(pdf:sub(1, 5), "%PDF-")
      end
    end
  end)

suite:test("HTML in a name, reason or note is shown as text", { limit = 20 }, function(t)
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

suite:test("a model's run and its replay: who set what, the cost, its answers as text",
  { limit = 30 }, function(t)
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
      if chart.y == "mutation_rate (per gene)" then
        local titles = {}
        for _, curve in ipairs(chart.curves) do
          titles[#titles + 1] = ("%s %d"):format(curve.name, #curve.points)
        end
        setters[#setters + 1] = titles
      end
    end
    t:equal(setters, {
      { "repetition 1 4", "set by: model 3", "set by: clamped 1" },
      { "repetition 1 4", "set by: replayed 3", "set by: clamped 1" } })
    t:ok(page:find("model&#39;s questions", 1, true), "a column of the cost")
    t:ok(page:find("&lt;script&gt;alert(1)", 1, true) and not page:find(evil, 1, true))
  end)

suite:test("a run in progress is reported and listed", { limit = 20 }, function(t)
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

return suite
