--- report_browser.lua: a report in a headless Chromium, where one is installed: nothing is loaded,
--- nothing fails, charts have the run's numbers, and the controls move the robots.

local base64 = require "limax.base.base64"
local evolution = require "support.evolution"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local robots = require "limax.tools.report.robots"
local source = require "limax.base.source"

local suite = require("limax.test").suite "report_browser"

local OPTIONS = " --headless --no-sandbox --disable-gpu-sandbox --use-gl=angle"
  .. " --use-angle=swiftshader --enable-unsafe-swiftshader --disable-dev-shm-usage --no-first-run"
  .. " --disable-background-networking --disable-component-update --disable-sync"
  .. " --window-size=1200,900 --enable-logging=stderr --user-data-dir="

-- The browser's path; the test is skipped where there is none.
local function chromium(t)
  for _, name in ipairs { "chromium", "chromium-browser", "google-chrome" } do
    local path = process.output("command -v " .. name .. " 2>/dev/null"):match "[^\n]+"
    if path then return path end
  end
  t:skip "there is no Chromium here (on Debian: apt-get install chromium)"
end

local function byte(digits) return string.char(tonumber(digits, 16)) end

-- Adds a script before all others, and its hash to the content policy.
local function with_script(page, script)
  local bytes = host.sha256(script):gsub("%x%x", byte)
  page = page:gsub("script%-src ", ("script-src 'sha256-%s' "):format(base64.encode(bytes)), 1)
  local head = page:find('<meta name="viewport"', 1, true)
  return page:sub(1, head - 1) .. "<script>" .. script .. "</script>" .. page:sub(head)
end

-- The report of a finished run as a browser shows it, and the folder.
local function seen_of(t)
  local program, base = chromium(t), t:folder()
  limax.start(evolution.small { lattice = { 3, 3, 3 }, generations = 3, population = 8,
    supervisor = "random",
    archive = { "grid", cells = 4, descriptors = { "muscle_share", "voxel_share" } },
    simulation = { duration = 1.5, settle = 0.1, accuracy = "preview" },
    scene = limax.scenes.slope { angle = math.rad(5), control = { signal = "a = sin(6 * t);" },
      boxes = { { from = { 1, -1, 0 }, to = { 1.5, 1, 0.2 } },
        { from = { 90, 90, 0 }, to = { 91, 91, 1 } } },
      spheres = { center = { -0.5, 0, 0 }, radius = 0.1 },
      planes = { normal = { 0, 2, 0 }, offset = -1 },
      block = { position = { 0.35, 0, 0 }, size = { 0.1, 0.2, 0.3 }, velocity = { 1, 0, 0 } },
      terrain = { spacing = 1, origin = { -2, -2, -0.5 }, heights = { { 0, 0.1 }, { 0.2, 0 } } } },
    record = { center_of_mass = 50 } }, { out = base .. "/r", say = evolution.silent }):finish()
  process.completes(t, base, { "report", "r" })
  source.write(base .. "/seen.html", with_script(source.read(base .. "/r/report.html"),
    source.read(host.home .. "/tests/report/browser.js")))
  os.execute(("timeout 120 %s%s%s file://%s 2>%s"):format(process.quote(program), OPTIONS,
    process.quote(base .. "/profile"), process.quote(base .. "/seen.html"),
    process.quote(base .. "/log.txt")))
  local log = source.read(base .. "/log.txt")
  local seen = log:match "SEEN (%S+) END"
  t:ok(seen, log)
  return host.json.decode((seen:gsub("%%(%x%x)", byte))), base
end

suite:test("charts and robots work, and nothing is loaded", function(t)
  local seen, base = seen_of(t)
  t:equal({ seen.problems, seen.loaded }, { {}, 0 })
  local k = 0
  for line in source.read(base .. "/r/r01/metrics.jsonl"):gmatch "[^\n]+" do
    k = k + 1
    local metrics = host.json.decode(line)
    t:equal(seen.charts[1].data.curves[1].points[k],
      { metrics.generation, metrics.best_standard or metrics.best })
  end
  -- a corner of the line for each generation
  t:equal(seen.charts[1].drawn[1], k)
  t:ok(seen.read_out:find("generation 2: best ", 1, true), seen.read_out)
  t:ok(seen.chosen.list[seen.chosen.clicked], "a robot of the archive is chosen by a click")
  t:ok(seen.chosen.list[seen.chosen.moved], "another one is chosen by an arrow key")
  t:ok(seen.chosen.moved ~= seen.chosen.clicked and seen.chosen.faces > 5, "its body is drawn")
  t:equal(seen.chosen.empty, seen.chosen.moved, "a place without a robot chooses none")
  t:ok(seen.overflow <= 0, "no wider than a narrow screen")
  t:equal(seen.focus[1].id, "skip")
  local reached = {}
  for _, at in ipairs(seen.focus) do
    t:ok(at.named and at.shown, at.id .. " has a name and shows its focus")
    reached[at.id] = true
  end
  t:ok(seen.plain.curves > 5, "curves without scripts")
  t:equal({ seen.plain.strips, seen.plain.robots }, { seen.shown, 0 },
    "film strips without scripts")
  if not robots.javascript() then t:skip "three.js was not there when limax was configured" end
  for name, fine in pairs(seen.ok) do t:ok(fine, name) end
  t:equal(seen.clock, "1.50 s")
  for _, name in ipairs { "play", "time", "speed", "follow", "reset" } do
    t:ok(reached[name], name .. " is reached by keyboard")
  end
  t:ok(seen.key:find("obstacle", 1, true), seen.key)
  -- the scene's z leans as far as its gravity does
  t:near(math.deg(math.acos(seen.up[3])), 5, { atol = 1e-3 })
  t:ok(seen.block[2][1] > seen.block[1][1] + 0.05, "the block moves as it did")
end)
