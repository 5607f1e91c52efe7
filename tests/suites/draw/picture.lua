--- picture.lua: canvases and `limax picture`: formats, sizes, views and wrong options.

local canvases = require "limax.draw.canvas"
local earlier = require "limax.tools.report.earlier"
local evolution = require "support.evolution"
local limax = require "limax"
local process = require "support.process"
local robots = require "limax.robot.robot"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local trial = require "support.trial"
local view = require "limax.draw.picture.view"

local suite = require("limax.test").suite "picture"

-- A robot file that walks for half a second.
local function robot_file(base)
  local path = base .. "/walker.json"
  limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }:simulate { scene = limax.scenes.land(),
    duration = 0.5, settle = 0.1, record = { center_of_mass = 50 }, accuracy = "preview" }
    :save(path)
  return path
end

local function picture(t, base, words, status)
  local done = process.ends(base, { "picture", unpack(words) })
  t:ok(done.status == (status or 0), done.stderr)
  return done
end

-- Width and height of a PNG, from its header.
local function png_size(bytes)
  local function number(at)
    local a, b, c, d = bytes:byte(at, at + 3)
    return ((a * 256 + b) * 256 + c) * 256 + d
  end
  return number(17), number(21)
end

suite:test("the same calls make pixels, SVG and PDF, and the same bytes each time", function(t)
  local function drawn(kind)
    local canvas = canvases.new(kind, 30, 20, { title = "a < b\1", transparent = true })
    canvas:clip(0, 0, 20, 20)
    canvas:polygon({ { 0, 0 }, { 30, 0 }, { 30, 1 }, { 0, 1 } }, { fill = "#ff0000" })
    canvas:polygon({ { 0, 1 }, { 1, 1 }, { 1, 2 }, { 0, 2 } },
      { fill = "#0000ff", fill_opacity = 0.5 })
    canvas:text(10, 15, "f(x) & \255", { size = 8, anchor = "middle" })
    return canvas:finish()
  end
  local pixels = drawn "pixels"
  t:equal(#pixels, 30 * 20 * 4)
  t:equal({ pixels:byte(1, 4) }, { 255, 0, 0, 255 })
  -- beyond the clip, and half covered
  t:equal({ pixels:byte(4 * 25 + 1, 4 * 25 + 4) }, { 0, 0, 0, 0 })
  t:equal({ pixels:byte(4 * 30 + 1, 4 * 30 + 4) }, { 0, 0, 255, 128 })
  local svg = drawn "svg"
  t:ok(svg:find(">f(x) &amp; ?</text>", 1, true) and svg:find("<title>a &lt; b?</title>", 1, true))
  t:equal(drawn("pdf"):sub(1, 5), "%PDF-")
  for _, kind in ipairs { "pixels", "png", "svg", "pdf" } do
    t:ok(drawn(kind) == drawn(kind), kind)
  end
end)

suite:test("stills and strips have the size and times of the options", function(t)
  local base = t:folder()
  local file = robot_file(base)
  for _, from in ipairs(view.names) do
    local words = { file, "--view", from, "--times", "0,0.2,0.5" }
    picture(t, base, { "--out", from .. ".png", "--width", "300", unpack(words) })
    local width, height = png_size(source.read(("%s/%s.png"):format(base, from)))
    t:ok(width == 300 and height > 60 and height < 300, ("%d x %d"):format(width, height))
    picture(t, base, { "--out", "strip.svg", unpack(words) })
    trial.contains(t, source.read(base .. "/strip.svg"), "0.00 s", "0.20 s", "0.50 s", " m</text>",
      ">expanding muscle<", ">bone<", ">centre of mass<")
  end
  t:ok(source.read(base .. "/side.png") ~= source.read(base .. "/top.png"))
  picture(t, base, { file, "--out", "clear.svg", "--transparent" })
  t:ok(not source.read(base .. "/clear.svg")
    :find('<polygon points="0.0,0.0 %S+ %S+ %S+" fill="#ffffff"/>'))
  picture(t, base, { file, "--out", "walk.pdf" })
  t:equal(source.read(base .. "/walk.pdf"):sub(1, 5), "%PDF-")
end)

suite:test("an animation has a frame for each 1/25 s", function(t)
  local base = t:folder()
  local file = robot_file(base)
  picture(t, base, { file, "--out", "walk.gif", "--width", "120" })
  local bytes = source.read(base .. "/walk.gif")
  t:equal(bytes:sub(1, 6), "GIF89a")
  -- a graphic control extension before each frame, which is shown for 4 hundredths
  t:equal(select(2, bytes:gsub("\33\249\4.\4%z", "")), 13)
  if os.execute "command -v ffmpeg >/dev/null 2>&1" ~= 0 then
    picture(t, base, { file, "--out", "walk.mp4" }, 1)
    t:skip "there is no ffmpeg here, which writes .mp4"
  end
  picture(t, base, { file, "--out", "walk.mp4", "--width", "120" })
  t:equal(source.read(base .. "/walk.mp4"):sub(5, 8), "ftyp")
end)

suite:test("any robot of a run can be drawn, as it was simulated", function(t)
  local base = t:folder()
  for k, encoding in ipairs { "fourier", "direct", { "symmetric", of = "cppn", axis = "y" } } do
    local folder = ("%s/r%d"):format(base, k)
    local history = evolution.finished({ generations = 5, genome = { encoding = encoding } },
      { out = folder })
    local robot
    for _, each in ipairs(history[2].population) do
      if each.generation == 1 and each.fitness then robot = each end
    end
    local again = robots.of(earlier.robot(runs.read(folder).runs[1], robot.id))
    t:equal(again.body.hash, robot.body.hash)
    t:equal(again:replay().fitness, robot.fitness)
    local done = picture(t, base, { folder, "--robot", tostring(robot.id), "--out", "r.svg" })
    t:ok(done.stdout:find(("robot %d of "):format(robot.id), 1, true), done.stdout)
  end
  process.fails(t, base, 1, { "picture", "r1", "--robot", "999", "--out", "r.svg" },
    "r1 has no robot 999: it has 1 to 30")
end)

suite:test("a run's last champion is drawn, wrong options are refused", function(t)
  local base = t:folder()
  evolution.run(base .. "/r")
  local done = picture(t, base, { "r", "--out", "r.png", "--times", "0" })
  t:ok(done.stdout:find("r01/champions/g0002.json", 1, true), done.stdout)
  t:equal((png_size(source.read(base .. "/r.png"))), 800)
  local file = robot_file(base)
  for words, text in pairs {
    [{ file, "--out", "x.bmp" }] = ".png, .svg, .pdf, .gif or .mp4",
    [{ file, "--out", "x.png", "--times", "0,9" }] = '--times: "9": expected seconds from 0 to 0.5',
    [{ file, "--out", "x.png", "--width", "90" }] = "6 poses side by side have 9 px each",
    [{ "none.json", "--out", "x.png" }] = "none.json is neither a robot file nor a run folder",
  } do
    process.fails(t, base, 2, { "picture", unpack(words) }, text)
  end
end)
