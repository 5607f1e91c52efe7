--- picture_flow.lua: wind and current in pictures: arrows that go where these go, longer if faster,
--- with words, in every format and in the page's viewer.

local film_strip = require "limax.draw.film_strip"
local flow = require "limax.draw.picture.flow"
local host = require "limax.host"
local limax = require "limax"
local motion = require "limax.draw.motion"
local painted = require "support.painted"
local process = require "support.process"
local repl_picture = require "limax.tools.repl.picture"
local scene = require "limax.draw.picture.scene"
local source = require "limax.base.source"
local stage = require "limax.draw.picture.stage"
local surroundings = require "limax.tools.report.surroundings"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local suite = require("limax.test").suite "picture_flow"

local AXES = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }

local function windy(velocity) return { wind = { velocity = velocity, drag = 0.01 } } end

-- What is drawn of the flows of a world at 100 px/m and 10 px a capital: ends of each arrow,
-- how many dots, lines and rings, and the texts.
local function drawn(given, name)
  local got = { tips = {}, starts = {}, dots = 0, lines = 0, rings = 0, texts = {}, colors = {} }
  local canvas = {}
  function canvas.line(_, from, _, color)
    got.lines = got.lines + 1
    got.starts[#got.starts + 1], got.colors[color] = from, true
  end
  function canvas.polygon(_, points, style)
    got.tips[#got.tips + 1], got.colors[style.fill] = points[1], true
  end
  function canvas.circle(_, _, _, style)
    local kind = style.fill and "dots" or "rings"
    got[kind] = got[kind] + 1
  end
  function canvas.text(_, _, _, text) got.texts[#got.texts + 1] = text end
  local turned = stage.new(world.of(given), AXES)
  local frame = { view = view.of[name], scale = 100, text = 10, capital = 1, left = 0 }
  flow.draw(canvas, turned, frame, 0)
  return got, flow.room(turned, view.of[name])
end

-- Right and up on the page, px, of the first arrow.
local function arrow(got)
  local from, tip = got.starts[1], got.tips[1]
  return tip[1] - from[1], from[2] - tip[2]
end

suite:test("an arrow goes where the flow goes, as the eye sees it", function(t)
  for _, name in ipairs(view.names) do
    for _, v in ipairs { { 3, 0, 0 }, { -3, 0, 0 }, { 0, 2, 0 }, { 1, -2, 2 }, { 0.4, 1, -2 } } do
      local x, y = arrow((drawn(windy(v), name)))
      local right, up = view.of[name].project(v)
      local length = math.sqrt((x ^ 2 + y ^ 2) * (right ^ 2 + up ^ 2))
      t:near((x * right + y * up) / length, 1, { atol = 1e-9 })
    end
  end
end)

suite:test("an arrow is longer when the flow is faster, and stays a mark", function(t)
  local before = 0
  for _, speed in ipairs { 8, 10, 15, 20, 25 } do
    local x, y = arrow((drawn(windy { speed, 0, 0 }, "side")))
    t:near(y, 0, { atol = 1e-9 })
    t:ok(x > before, ("%g m/s: %.1f px after %.1f px"):format(speed, x, before))
    before = x
  end
  -- at 10 px a capital
  for _, speed in ipairs { 1e-9, 1000 } do
    local x = arrow((drawn(windy { speed, 0, 0 }, "side")))
    t:ok(x >= 20 and x <= 80, ("%g m/s: %.1f px"):format(speed, x))
    local _, y = arrow((drawn(windy { 0, 0, speed }, "side")))
    t:ok(y >= 20 and y <= 40, ("%g m/s: %.1f px up"):format(speed, y))
  end
end)

suite:test("what goes along the line of sight is a dot or a cross in a ring", function(t)
  local up = drawn(windy { 0, 0, 2 }, "top")
  t:equal({ up.rings, up.dots, up.lines, #up.tips }, { 1, 1, 0, 0 })
  local down = drawn(windy { 0, 0, -2 }, "top")
  t:equal({ down.rings, down.dots, down.lines, #down.tips }, { 1, 0, 2, 0 })
  local away = drawn(windy { 1, 1, -1 }, "iso")
  t:equal({ away.rings, away.lines, #away.tips }, { 1, 2, 0 })
end)

suite:test("rows do not meet, and nothing takes room where nothing flows", function(t)
  local both = { wind = { velocity = { 0, 0, 5 } }, drag = { current = { 0, 0, -4 } } }
  local got, room = drawn(both, "side")
  t:equal(got.texts, { "wind 5 m/s", "current 4 m/s" })
  t:equal(got.colors, { [world.flow_ink.wind] = true, [world.flow_ink.current] = true })
  -- up from the first, down from the second
  local first, second = math.max(got.starts[1][2], got.tips[1][2]), math.min(got.starts[2][2],
    got.tips[2][2])
  t:ok(first < second, ("%.1f px and %.1f px"):format(first, second))
  t:ok(math.max(got.starts[2][2], got.tips[2][2]) <= room * 10, "within its room")
  local rest, none = drawn({ wind = { velocity = { 0, 0, 0 } }, drag = { current = { 0, 0, 0 } } },
    "side")
  t:equal({ none, #rest.texts, rest.lines + rest.rings }, { 0, 0, 0 })
end)

suite:test("words say what flows where", function(t)
  local function words(given) return world.words(world.of(given)) end
  t:equal(words(windy { 5, 0, 0 }), "wind of 5 m/s along x")
  t:equal(words(windy { 0, -0.25, 0 }), "wind of 0.25 m/s along -y")
  t:equal(words(windy { 3, 4, -0 }), "wind of 5 m/s along (0.6, 0.8, 0)")
  t:equal(words(windy { 0, 0, 0 }), "still air")
  t:equal(words { drag = { current = { 0, 0, 0 } } }, "a fluid")
  t:equal(words { drag = { current = { 0, 0, 0.5 } } }, "a current of 0.5 m/s along z")
  t:equal(words { magnet = { force = "f = vec(0, 0, 0);" } }, "force magnet")
  t:equal(words {}, "")
end)

suite:test("wind is in pictures of pixels from every side, and turns as the robot does",
  { limit = 20 }, function(t)
    local still = motion.of(painted.walked_in(limax.scenes.land()), { 0 })
    local blown = motion.of(painted.walked_in(limax.scenes.land(windy { 4, 1, 0 })), { 0 })
    for _, name in ipairs(view.names) do
      local with, frame = painted.colors_of(blown, name)
      local without, plain = painted.colors_of(still, name)
      local pixels = with[world.flow_ink.wind] or 0
      t:ok(pixels > 20, ("%s: %d pixels"):format(name, pixels))
      t:equal(without[world.flow_ink.wind], nil)
      t:ok(frame.head > plain.head)
    end
    local turned, v = blown.stage.flows[1].velocity, { 4, 1, 0 }
    local back = blown.stage.back(turned)
    t:near(back, v, { atol = 1e-12 })
  end)

suite:test("each format has the arrow, and its SVG the words", { limit = 40 }, function(t)
  local base = t:folder()
  local around = limax.scenes.land { wind = { velocity = { 0, 2, 0 }, drag = 0.01 },
    drag = { density = 1.2, current = { -0.5, 0, 0 } } }
  local words = "wind of 2 m/s along y, a current of 0.5 m/s along -x"
  local walked = painted.walked_in(around)
  local function check(svg, what)
    for _, ink in pairs(world.flow_ink) do
      t:ok(select(2, svg:gsub(ink, "")) >= 3, what .. " has shaft, head and text in " .. ink)
    end
    t:ok(svg:find(">wind 2 m/s<", 1, true) and svg:find(">current 0.5 m/s<", 1, true),
      what .. " has the speeds")
    t:ok(svg:find("<desc>[^<]*" .. words:gsub("%p", "%%%0") .. "[^<]*</desc>"),
      what .. " says it to a reader")
  end
  check(film_strip.svg(walked), "the film strip")
  walked:save(base .. "/walker.json")
  for _, ending in ipairs { "svg", "png", "gif" } do
    process.completes(t, base, { "picture", "walker.json", "--out", "with." .. ending })
  end
  check(source.read(base .. "/with.svg"), "limax picture")
  local moving = limax.robot { voxels = painted.VOXELS }:begin { duration = 1, settle = 0,
    scene = around }
  check(source.read(repl_picture.write(moving, base .. "/now.svg")), "picture(moving)")
  -- the same robot in a scene without flows is smaller by their rows
  local saved = host.json.decode(source.read(base .. "/walker.json"))
  saved.scene.wind, saved.scene.drag = nil, nil
  assert(host.file.write_atomic(base .. "/calm.json", host.json.encode(saved)))
  for _, ending in ipairs { "png", "gif" } do
    local calm = process.completes(t, base, { "picture", "calm.json", "--out", "calm." .. ending })
    local blown = process.completes(t, base, { "picture", "walker.json", "--out",
      "with." .. ending })
    t:ok(tonumber(blown.stdout:match "x (%d+) pixels") > tonumber(calm.stdout:match
      "x (%d+) pixels"), ending .. ": " .. blown.stdout .. calm.stdout)
  end
end)

suite:test("the page's viewer is told of flows in the world's own coordinates", function(t)
  local given = world.of { ground = { height = 0 }, wind = { velocity = { 0, 2, 0 } },
    drag = { current = { 0, 0, 0 } } }
  local told = surroundings.of(given, { 0, 0, 0 }, { 1, 1, 1 })
  t:equal(told.flows, { { name = "wind", label = "wind 2 m/s", velocity = { 0, 2, 0 },
    hex = world.flow_ink.wind } })
  t:equal(surroundings.of(world.of {}, { 0, 0, 0 }, { 1, 1, 1 }).flows, nil)
end)

suite:test("a picture keeps its size and its text whatever blows", { limit = 20 }, function(t)
  local walked = painted.walked_in(limax.scenes.land(windy { 3, 0, 0 }))
  local film = motion.of(walked, { 0 })
  for _, v in ipairs { { 1e-6, 0, 0 }, { 1000, 1000, 1000 }, { 0, 0, -1000 } } do
    film.stage = stage.new(world.of { ground = { height = 0 }, wind = { velocity = v } }, AXES)
    for _, name in ipairs(view.names) do
      local frame = scene.frame(film, view.of[name], 300, 1,
        { text = 9, gap = 0, head = 2 })
      t:ok(frame.height > 100 and frame.height < 600, ("%s: %d px"):format(name, frame.height))
      -- a thin ring in `top` has no pixel of the pure colour
      t:ok(name == "top" or (painted.colors_of(film, name)[world.flow_ink.wind] or 0) > 10, name)
    end
  end
end)

return suite
