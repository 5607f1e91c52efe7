--- report_browser.lua: a report in a headless Chromium, where one is installed: nothing is loaded,
--- nothing fails, charts have the run's numbers, and the controls move the robots.
--- LIMAX_TEST_SCREENSHOTS names a folder for the screenshots.

local evolution = require "support.evolution"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local robots = require "limax.tools.report.robots"
local source = require "limax.base.source"

local suite = require("limax.test").suite "report_browser"

local DRIVER = host.home .. "/tests/report/browser.py"

-- The browser's path; nil, message where there is none.
local function chromium()
  for _, name in ipairs { "chromium", "chromium-browser", "google-chrome" } do
    local pipe = io.popen("command -v " .. name .. " 2>/dev/null")
    local path = pipe:read "*l"
    pipe:close()
    if path then return path end
  end
  return nil, "there is no Chromium here (on Debian: apt-get install chromium)"
end

local function needs(t)
  local program, why = chromium()
  if not program then t:skip(why) end
  if os.execute "command -v python3 >/dev/null 2>&1" ~= 0 then
    t:skip "there is no python3 here, which drives the browser"
  end
  return program
end

-- A finished run and what a browser sees of its report.
local function seen_of(t, program, change)
  local base = t:folder()
  limax.start(evolution.small { lattice = { 3, 3, 3 }, generations = 3, population = 8,
    supervisor = "random", simulation = { duration = 1.5, settle = 0.1, accuracy = "preview" },
    scene = limax.scenes.slope { angle = math.rad(5),
      boxes = { { from = { 1, -1, 0 }, to = { 1.5, 1, 0.2 } },
        { from = { 90, 90, 0 }, to = { 91, 91, 1 } } },
      spheres = { center = { -0.5, 0, 0 }, radius = 0.1 },
      planes = { normal = { 0, 2, 0 }, offset = -1 },
      wind = { velocity = { 0, 2, 0 }, drag = 1e-3 },
      drag = { density = 1, current = { -0.3, 0, 0.4 } },
      block = { position = { 0.35, 0, 0 }, size = { 0.1, 0.2, 0.3 }, velocity = { 1, 0, 0 } },
      terrain = { spacing = 1, origin = { -2, -2, -0.5 }, heights = { { 0, 0.1 }, { 0.2, 0 } } } },
    record = { center_of_mass = 50 } }, { out = base .. "/r", say = evolution.silent }):finish()
  if change then change(base .. "/r") end
  process.completes(t, base, { "report", "r" })
  local shots = os.getenv "LIMAX_TEST_SCREENSHOTS" or base
  assert(host.file.mkdir(shots))
  local pipe = io.popen(("python3 %s %s %s %s 2>%s"):format(process.quote(DRIVER),
    process.quote(program), process.quote(base .. "/r/report.html"), process.quote(shots),
    process.quote(base .. "/driver.txt")))
  local text = pipe:read "*a"
  pipe:close()
  local seen = host.json.decode(text)
  t:ok(seen, text .. tostring(source.read(base .. "/driver.txt")))
  return seen, base, shots
end

local function all(list) return #list > 0 and not tostring(host.json.encode(list)):find "false" end

suite:test("charts and robots work, and nothing is loaded", { limit = 600 }, function(t)
  local program = needs(t)
  local seen, base, shots = seen_of(t, program)
  -- once with scripts and once without
  local address = "file://" .. base .. "/r/report.html"
  t:equal(seen.requests, { address, address })
  t:equal(seen.problems, {})
  local k = 0
  for line in source.read(base .. "/r/metrics.jsonl"):gmatch "[^\n]+" do
    k = k + 1
    local metrics = host.json.decode(line)
    t:equal(seen.charts[1].data.curves[1].points[k],
      { metrics.generation, metrics.best_standard or metrics.best })
  end
  -- a corner of the line for each generation
  t:equal(seen.charts[1].drawn[1], k)
  t:ok(seen.read_out:find("generation 2: best ", 1, true), seen.read_out)
  t:ok(seen.overflow <= 0, "no wider than a narrow screen")
  t:equal(seen.unnamed, {}, "whatever takes the focus has a name")
  t:equal(seen.focus[1].name, "skip")
  local reached = {}
  for _, at in ipairs(seen.focus) do
    t:ok(at.seen and at.outlined, at.name .. " shows its focus")
    reached[at.name] = true
  end
  t:ok(seen.plain.curves > 5, "curves without scripts")
  t:equal(seen.plain.strips, 2, "film strips without scripts")
  if not robots.javascript() then t:skip "three.js was not there when limax was configured" end
  t:equal(seen.views, 2)
  t:ok(seen.still, "the same picture twice, while nothing moves")
  for _, name in ipairs { "moved", "scrubbed_to_end", "strain", "phase", "without_ground",
    "without_trail" } do
    t:ok(all(seen[name]), name)
  end
  for _, name in ipairs { "paused", "scrubbed_back", "turned_by_key" } do t:ok(seen[name], name) end
  t:equal(seen.clock, "1.50 s")
  for _, name in ipairs { "play", "time", "speed", "colours", "ground", "trail", "follow",
    "canvas" } do
    t:ok(reached[name], name .. " is reached by keyboard")
  end
  t:equal(seen.plain.robots, "none", "without scripts no empty views")
  local found = {}
  for _, thing in ipairs(seen.world) do found[thing.name] = thing end
  t:equal(#seen.world, 5, "the box that is far away is left out")
  t:near({ found.box.low, found.box.high }, { { 1, -1, 0 }, { 1.5, 1, 0.2 } }, { atol = 1e-6 })
  t:near({ found.sphere.low, found.sphere.high }, { { -0.6, -0.1, -0.1 }, { -0.4, 0.1, 0.1 } },
    { atol = 1e-3 })
  t:near({ found.plane.low[2], found.plane.high[2], found.plane.low[3] }, { -1, -1, 0 },
    { atol = 1e-4 })
  t:near(found.ground.high[3], 0, { atol = 0.01 })
  t:near(found.terrain.low[3], -0.5, { atol = 0.01 })
  t:equal({ #seen.flows, seen.flows[1].name, seen.flows[2].name }, { 2, "wind", "current" })
  t:near({ seen.flows[1].way, seen.flows[2].way }, { { 0, 1, 0 }, { -0.6, 0, 0.8 } },
    { atol = 1e-6 })
  t:ok(seen.flows[1].height > 0.2, "above the robot")
  t:ok(seen.key:find("wind 2 m/s", 1, true) and seen.key:find("current 0.5 m/s", 1, true), seen.key)
  -- the scene's z leans as far as its gravity does
  t:near(math.deg(math.acos(seen.up[3])), 5, { atol = 1e-3 })
  t:ok(seen.block[2][1] > seen.block[1][1] + 0.05, "the block goes where it went")
  for _, name in ipairs { "robots", "strain", "phase", "top", "dark", "narrow" } do
    t:ok(#source.read(("%s/%s.png"):format(shots, name)) > 2000, name)
  end
end)

suite:test("HTML and scripts in a run are not executed", { limit = 600 }, function(t)
  local program = needs(t)
  local evil = "</script></title><script>window.alerted = true</script>"
    .. "<img src=http://127.0.0.1:9/x onerror='window.alerted = true'>"
  local seen = seen_of(t, program, function(folder)
    for name, fields in pairs { ["config.json"] = { "name", "supervisor", "not_in_paper" },
      STATUS = { "state" } } do
      local value = host.json.decode(source.read(folder .. "/" .. name))
      for _, field in ipairs(fields) do value[field] = evil end
      assert(host.file.write_atomic(folder .. "/" .. name, host.json.encode(value)))
    end
    local lines = source.read(folder .. "/ledger.jsonl"):gsub("[^\n]+", function(text)
      local line = host.json.decode(text)
      line.reason = evil
      return host.json.encode(line)
    end)
    assert(host.file.write_atomic(folder .. "/ledger.jsonl", lines))
  end)
  t:equal(seen.alerted, false)
  t:equal({ seen.images, #seen.requests, seen.problems }, { 0, 2, {} })
  t:ok(seen.title:find(evil, 1, true), "shown as it is: " .. seen.title)
end)

return suite
