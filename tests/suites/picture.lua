--- picture.lua: `limax picture`: what is drawn by pixels and as SVG, of which size, from where, and
--- what is refused.

local evolution = require "support.evolution"
local film_strip = require "limax.film_strip"
local host = require "limax.host"
local limax = require "limax"
local obstacles = require "limax.obstacle_picture"
local pixels = require "limax.picture.pixels"
local process = require "limax.test.process"
local source = require "limax.source"
local view = require "limax.picture.view"

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
  local done = process.limax({ "picture", unpack(words) }, { folder = base })
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

suite:test("polygons cover what they cover, and mix with what is there", function(t)
  local canvas = pixels.new(3, 2)
  -- the left pixel whole, the next one by a third, nothing of the last
  canvas:polygon({ { 0, 0 }, { 4 / 3, 0 }, { 4 / 3, 1 }, { 0, 1 } }, "#ff0000")
  local bytes = canvas:finish()
  t:equal({ bytes:byte(1, 12) }, { 255, 0, 0, 255, 255, 0, 0, 85, 0, 0, 0, 0 })
  canvas = pixels.new(1, 1, "#0000ff")
  canvas:polygon({ { 0, 0 }, { 1, 0 }, { 1, 1 }, { 0, 1 } }, "#ff0000", 0.5)
  t:equal({ canvas:finish():byte(1, 4) }, { 128, 0, 128, 255 })
  canvas = pixels.new(2, 1)
  canvas:clip(1, 0, 2, 1)
  canvas:polygon({ { 0, 0 }, { 2, 0 }, { 2, 1 }, { 0, 1 } }, "#ffffff")
  t:equal({ canvas:finish():byte(1, 8) }, { 0, 0, 0, 0, 255, 255, 255, 255 })
end)

suite:test("points along the sight fall on each other", function(t)
  for _, name in ipairs(view.names) do
    local each = view.of[name]
    local x, y = each.project { 0.3, -0.2, 0.7 }
    local p, q = each.project { 0.3 + each.sight[1], -0.2 + each.sight[2], 0.7 + each.sight[3] }
    t:near(x, p, { atol = 1e-12 })
    t:near(y, q, { atol = 1e-12 })
    local right, up = each.project { 1, 0, 0 }
    t:near(math.sqrt(right ^ 2 + up ^ 2), each.short, { rtol = 1e-12 })
  end
end)

-- Area of squares, m^2, and the volume that they enclose, by the divergence theorem.
local function measure(quads)
  local area, volume = 0, 0
  for _, q in ipairs(quads) do
    local a, b, n = {}, {}, {}
    for k = 1, 3 do a[k], b[k] = q[3][k] - q[1][k], q[4][k] - q[2][k] end
    for k = 1, 3 do
      local i, j = k % 3 + 1, (k + 1) % 3 + 1
      n[k] = (a[i] * b[j] - a[j] * b[i]) / 2
      for c = 1, 4 do volume = volume + n[k] * q[c][k] / 12 end
    end
    area = area + math.sqrt(n[1] ^ 2 + n[2] ^ 2 + n[3] ^ 2)
  end
  return area, volume
end

suite:test("obstacles are squares that face outward and lie where the scene has them", function(t)
  local region = { low = { -1, -1, -0.5 }, high = { 1, 1, 1 } }
  local function quads(scene) return obstacles.quads(scene, region) end
  local low = { from = { 0, 0, 0 }, to = { 0.25, 0.5, 0.1 } }
  local area, volume = measure(quads { boxes = { low } })
  t:near({ area, volume }, { 2 * (0.125 + 0.025 + 0.05), 0.0125 }, { rtol = 1e-9 })
  -- of two boxes that touch, what lies between them is left out; beyond the region nothing is drawn
  area, volume = measure(quads { boxes = { low,
    { from = { 0.25, 0, 0 }, to = { 0.5, 0.5, 0.23 } },
    { from = { 3, 3, 3 }, to = { 4, 4, 4 } } } })
  t:near(volume, 0.0125 + 0.25 * 0.5 * 0.23, { rtol = 1e-9 })
  t:near(area, 2 * 0.25 + 2 * 0.25 * 0.33 + 2 * 0.5 * 0.23, { rtol = 1e-9 })
  -- 24 by 12 squares of a ball
  area, volume = measure(quads { spheres = { { center = { 0.1, 0, 0.4 }, radius = 0.3 } } })
  t:near({ area, volume }, { 4 * math.pi * 0.09, 4 / 3 * math.pi * 0.027 }, { rtol = 0.03 })
  for _, quad in ipairs(quads { planes = { { normal = { 0, 3, 4 }, offset = 0.2 } } }) do
    for _, p in ipairs(quad) do t:near(0.6 * p[2] + 0.8 * p[3], 0.2, { atol = 1e-12 }) end
    t:ok(select(2, measure { quad }) > 0, "a plane faces along its normal")
  end
  local terrain = quads { terrain = { spacing = 1, origin = { 0, 0, 0.1 },
    heights = { { 0, 0 }, { 0.4, 0.4 } } } }
  area = 0
  for _, quad in ipairs(terrain) do
    for _, p in ipairs(quad) do
      t:near(p[3], 0.1 + 0.4 * math.min(math.max(p[1], 0), 1), { atol = 1e-12 })
    end
    area = area + measure { quad }
  end
  t:near(area, 2 + 2 * math.sqrt(1.16), { rtol = 1e-9 })
end)

suite:test("obstacles stand in stills and in strips", { limit = 20 }, function(t)
  local base = t:folder()
  local robot = limax.robot { voxels = "eb\nbb" }
  local function drawn(scene, name)
    robot:simulate { scene = scene, duration = 0.1, settle = 0, accuracy = "preview" }
      :save(base .. "/robot.json")
    picture(t, base, { "robot.json", "--out", name .. ".svg", "--times", "0" })
    local strip = film_strip.svg(limax.robot(base .. "/robot.json"):simulate {
      record = { position = 20, center_of_mass = 20 } })
    return select(2, source.read(("%s/%s.svg"):format(base, name)):gsub("<polygon", "")),
      select(2, strip:gsub("<polygon", ""))
  end
  local still, strip = drawn(limax.scenes.land(), "without")
  local still_with, strip_with = drawn(limax.scenes.land {
    boxes = { from = { 0.25, 0, 0 }, to = { 0.35, 0.2, 0.1 } } }, "with")
  -- of the box 2 squares on top, 2 to the right and one in front; six poses in a strip, whose way
  -- may be another
  t:equal(still_with - still, 5)
  t:ok(strip_with - strip >= 6 * 5, strip_with - strip)
end)

suite:test("stills and strips have the size, the times and the dots that were asked for",
  { limit = 20 }, function(t)
    local base = t:folder()
    local file = robot_file(base)
    for _, from in ipairs(view.names) do
      picture(t, base, { file, "--out", from .. ".png", "--view", from, "--times", "0,0.2,0.5",
        "--width", "300", "--dpi", "300" })
      local bytes = source.read(("%s/%s.png"):format(base, from))
      local width, height = png_size(bytes)
      t:ok(width == 300 and height > 40 and height < 200, ("%d x %d"):format(width, height))
      -- 300 per inch are 11811 = 0x2e23 per metre
      t:ok(bytes:find("pHYs\0\0\46\35\0\0\46\35\1", 1, true))
      picture(t, base, { file, "--out", from .. ".svg", "--view", from, "--times", "0,0.2,0.5" })
      local svg = source.read(("%s/%s.svg"):format(base, from))
      for _, text in ipairs { "0.00 s", "0.20 s", "0.50 s", " m</text>" } do
        t:ok(svg:find(text, 1, true), text)
      end
      t:ok(svg:find('fill="#ffffff"/>', 1, true))
    end
    local side, top = source.read(base .. "/side.png"), source.read(base .. "/top.png")
    t:ok(side ~= top)
    picture(t, base, { file, "--out", "clear.svg", "--transparent" })
    local clear = source.read(base .. "/clear.svg")
    t:ok(not clear:find('<rect width="%d+" height="%d+" fill="#ffffff"/>'))
    t:equal(select(2, clear:gsub(" s</text>", "")), 6)
  end)

suite:test("an animation has a frame for each 1/25 s", { limit = 30 }, function(t)
  local base = t:folder()
  local file = robot_file(base)
  picture(t, base, { file, "--out", "walk.gif", "--width", "120" })
  local bytes = source.read(base .. "/walk.gif")
  t:equal(bytes:sub(1, 6), "GIF89a")
  -- a graphic control extension before each frame, which is shown for 4 hundredths
  t:equal(select(2, bytes:gsub("\33\249\4.\4%z", "")), 13)
  picture(t, base, { file, "--out", "part.gif", "--width", "120", "--times", "0.1,0.3" })
  t:equal(select(2, source.read(base .. "/part.gif"):gsub("\33\249\4.\4%z", "")), 6)
  if os.execute "command -v ffmpeg >/dev/null 2>&1" ~= 0 then
    picture(t, base, { file, "--out", "walk.mp4" }, 1)
    t:skip "there is no ffmpeg here, which writes .mp4"
  end
  picture(t, base, { file, "--out", "walk.mp4", "--width", "120" })
  t:equal(source.read(base .. "/walk.mp4"):sub(5, 8), "ftyp")
  t:ok(not host.file.exists(base .. "/walk.mp4.part.mp4"))
end)

suite:test("a run's last champion is drawn, and nonsense is refused", { limit = 20 }, function(t)
  local base = t:folder()
  limax.start(evolution.small {}, { out = base .. "/r", say = evolution.silent }):finish()
  local done = picture(t, base, { "r", "--out", "r.png", "--times", "0" })
  t:ok(done.stdout:find("r01/champions/g0002.json", 1, true), done.stdout)
  t:equal((png_size(source.read(base .. "/r.png"))), 800)
  local file = robot_file(base)
  for words, text in pairs {
    [{ file }] = "--out FILE is missing", [{ file, "--out", "x.bmp" }] = ".png, .svg, .gif or .mp4",
    [{ file, "--out", "x.png", "--times", "0,9" }] = '--times: "9": expected seconds from 0 to 0.5',
    [{ file, "--out", "x.png", "--view", "back" }] = "side, top, iso",
    [{ "none.json", "--out", "x.png" }] = "none.json is no robot file and no run folder",
  } do
    done = picture(t, base, words, 2)
    t:ok(done.stderr:find(text, 1, true), done.stderr)
  end
end)

return suite
