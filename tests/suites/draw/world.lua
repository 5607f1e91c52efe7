--- world.lua: what pictures draw of the world around a robot.

local block_picture = require "limax.draw.block_picture"
local film_strip = require "limax.draw.film_strip"
local host = require "limax.host"
local limax = require "limax"
local motion = require "limax.draw.motion"
local painted = require "support.painted"
local palette = require "limax.draw.palette"
local script = require "limax.base.script"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local suite = require("limax.test").suite "draw_world"

local AXES = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }
local SLAB = { low = { -1, -1, -1 }, high = { 1, 1, 1 } }

suite:test("terrain has the engine's heights, and goes on beyond its border", function(t)
  local terrain = { spacing = 0.5, origin = { -1, 2, 0.25 }, heights = { { 0, 1 }, { 2, 5 } } }
  t:equal(world.height(terrain, -1, 2), 0.25)
  t:equal(world.height(terrain, -0.5, 2.5), 5.25)
  -- bilinear: the mean of four in the middle
  t:equal(world.height(terrain, -0.75, 2.25), 2.25)
  t:equal(world.height(terrain, 100, -100), 2.25)
  t:equal(world.height(terrain, -100, 100), 1.25)
end)

suite:test("obstacles are in the picture from every view", { limit = 30 },
  function(t)
    local wide = { from = { 0.35, -3, 0 }, to = { 3, 3, 0.08 } }
    local scenes = {
      box = limax.scenes.land { boxes = wide },
      sphere = limax.scenes.land { spheres = { center = { 0.42, 0.1, 0 }, radius = 0.12 } },
    }
    for what, around in pairs(scenes) do
      local film = motion.of(painted.walked_in(around), { 0 })
      for _, name in ipairs(view.names) do
        local count = painted.colors_of(film, name)
        t:ok(painted.pixels_of(count, world.hex) > 200, ("%s from %s: %d pixels"):format(what, name,
          painted.pixels_of(count, world.hex)))
      end
    end
    local plain = motion.of(painted.walked_in(limax.scenes.land()), { 0 })
    local count = painted.colors_of(plain, "side")
    t:ok(painted.pixels_of(count, world.hex) < 20)
    -- a wall behind the body is seen, one before it is a veil through which the body is
    local function walled(side)
      local far = -math.huge
      for _, p in ipairs(plain.poses[1].points) do far = math.max(far, -side * p[2]) end
      plain.world = { up = { 0, 0, 1 }, ground = 0, boxes = {}, spheres = {}, flows = {},
        planes = { { normal = { 0, side, 0 }, offset = -far - 0.02 } } }
      plain.stage = stage.new(plain.world, AXES)
      local seen = painted.colors_of(plain, "side")
      return painted.pixels_of(seen, world.hex), painted.body_pixels(seen, plain)
    end
    local wall, body = walled(-1)
    t:ok(wall > 2000 and body > 2000, ("%d of the wall, %d of the body"):format(wall, body))
    local veil, through = walled(1)
    -- a mixed colour may happen to be one of the wall's
    t:ok(veil < 20, ("%d pixels"):format(veil))
    t:ok(through < body, "the veil changes what is behind it")
  end)

suite:test("a box hides a robot behind it and not one before it", { limit = 20 }, function(t)
  local function seen(low, high)
    local film = motion.of(painted.walked_in(limax.scenes.land {
      boxes = { from = { -1, low, 0 }, to = { 1.5, high, 0.5 } } }), { 0 })
    local count = painted.colors_of(film, "side")
    return painted.body_pixels(count, film), painted.pixels_of(count, world.hex)
  end
  local before, box = seen(0.23, 0.5)
  t:ok(before > 5000 and box > 2000, ("%d of the body, %d of the box"):format(before, box))
  local behind = seen(-0.2, -0.03)
  t:ok(behind < 0.2 * before, ("%d pixels of %d show behind the box"):format(behind, before))
end)

suite:test("what is behind a robot covers no pixel of it", { limit = 20 }, function(t)
  local plain = motion.of(painted.walked_in(limax.scenes.land()), { 0 })
  local count, frame = painted.colors_of(plain, "side")
  local share = painted.body_pixels(count, plain) / frame.scale ^ 2
  for name, around in pairs {
    steps = limax.scenes.land { ground = { height = -0.1 },
      boxes = { from = { -2, -2, -0.1 }, to = { 2, 2, 0 } } },
    terrain = limax.scenes.land { ground = false, terrain = { spacing = 0.3, origin = { -3, -3, 0 },
      heights = { { 0, 0 }, { 0, 0 } } } },
    floor = limax.scenes.land { ground = false, planes = true },
    wall = limax.scenes.land { planes = { normal = { 0, -1, 0 }, offset = -0.22 } },
  } do
    local film = motion.of(painted.walked_in(around), { 0 })
    count, frame = painted.colors_of(film, "side", 600)
    -- lines between faces take more pixels of a smaller picture
    t:near(painted.body_pixels(count, film) / frame.scale ^ 2, share, { rtol = 0.1 })
    t:ok(frame.scale > 0, name)
  end
end)

suite:test("a ridge of terrain hides a robot behind it and not one before it", { limit = 20 },
  function(t)
    local function seen(from, to)
      local heights = {}
      for x = 1, 41 do
        heights[x] = {}
        for y = 1, 41 do
          local at = (y - 21) * 0.05
          heights[x][y] = at > from and at < to and 0.5 or 0
        end
      end
      local film = motion.of(painted.walked_in(limax.scenes.land { ground = false, terrain = {
        spacing = 0.05, origin = { -1, -1, 0 }, heights = heights } }), { 0 })
      -- along x whatever its first steps were
      local count = painted.colors_of(film, "side")
      return painted.body_pixels(count, film)
    end
    local before, behind = seen(0.22, 0.4), seen(-0.2, -0.03)
    t:ok(before > 5000, ("%d pixels before the ridge"):format(before))
    t:ok(behind < 0.3 * before, ("%d pixels of %d behind it"):format(behind, before))
  end)

suite:test("a slope is seen as one: up is against gravity", { limit = 20 }, function(t)
  local film = motion.of(painted.walked_in(limax.scenes.slope { angle = math.rad(10) }), { 0 })
  t:equal(world.words(film.world), "ground with a slope of 10 degrees")
  local down = film.stage.turn { 1, 0, 0 }
  t:near(math.deg(math.asin(-down[3])), 10, { atol = 1e-9 })
  for _, p in ipairs(film.poses[1].points) do
    t:ok(p[3] > stage.ground_height(film.stage, p[1], p[2]) - 0.01, "no mass is in the slope")
  end
  -- nothing to stand on, or no gravity: z stays up
  t:equal(world.of({ gravity = { acceleration = { 3, 0, -9 } } }).up, { 0, 0, 1 })
  t:equal(world.of({ ground = { height = 0 } }).up, { 0, 0, 1 })
end)

suite:test("a simulation in progress is drawn as it is, with its block", function(t)
  local moving = limax.robot { voxels = painted.VOXELS }:begin { duration = 1, settle = 0,
    scene = limax.scenes.land { block = { position = { 0.5, 0, 0 }, velocity = { 1, 0, 0 } } } }
  local function block_now()
    local film = motion.now(moving.finished(), moving:positions():table(), moving.time)
    t:ok(next((painted.colors_of(film, "side"))))
    return film.poses[1].block[1][1]
  end
  local before = block_now()
  moving:go(0.1)
  t:ok(block_now() > before + 0.02, "the block has moved")
end)

suite:test("the paper's materials are told apart in grey", function(t)
  local list = limax.robot { voxels = painted.VOXELS }.materials:table().materials
  local colors, greys = palette.of(list), {}
  for _, material in ipairs(list) do
    if material.kind ~= "empty" then
      local value = tonumber(colors[material.letter].hex:sub(2), 16)
      -- luma of ITU-R BT.601
      greys[#greys + 1] = 0.299 * math.floor(value / 65536)
        + 0.587 * (math.floor(value / 256) % 256) + 0.114 * (value % 256)
    end
  end
  table.sort(greys)
  for k = 2, #greys do
    t:ok(greys[k] - greys[k - 1] > 25, ("%.0f and %.0f of 255"):format(greys[k - 1], greys[k]))
  end
end)

suite:test("the film strip names what is there, and a block that was not recorded", { limit = 20 },
  function(t)
    local land = limax.scenes.land { spheres = { center = { 1, 0, 0 }, radius = 0.1 },
      boxes = { { from = { 2, 0, 0 }, to = { 3, 1, 1 } },
        { from = { 4, 0, 0 }, to = { 5, 1, 1 } } },
      block = { position = { 0.5, 0, 0 } } }
    local robot = limax.robot { voxels = painted.VOXELS }
    local svg = film_strip.svg(painted.walked_in(land))
    t:ok(svg:find(">ground, 2 boxes, 1 sphere<", 1, true), "what is there")
    t:ok(svg:find(">obstacle<", 1, true) and svg:find(">block<", 1, true))
    local without = robot:simulate { scene = land, duration = 0.2, record = { position = 20 } }
    svg = film_strip.svg(without)
    t:ok(svg:find("the block is not drawn: its positions were not recorded", 1, true))
    t:ok(not svg:find(">block<", 1, true))
  end)

suite:test("each experiment's world is in the pictures of its robots", { limit = 60 }, function(t)
  local expected = { stairs = world.hex, grip = world.hex, carry = block_picture.hex }
  for _, name in ipairs { "stairs", "climb", "grip", "carry", "swim", "walk" } do
    local found = script.run(("%s/scripts/experiments/%s.lua"):format(host.home, name))
    local given = found.config
    local robot = limax.robot { voxels = ("ecscb\n"):rep(3) .. "\n" .. ("scbse\n"):rep(3) }
    local walked = assert(motion.simulate(robot, { scene = given.scene, duration = 0.2 }))
    local film = motion.of(walked, { 0 })
    local count = painted.colors_of(film, "side")
    t:ok(painted.body_pixels(count, film) > 3000, name)
    if expected[name] then
      t:ok(painted.pixels_of(count, expected[name]) > 100, ("%s: %d pixels"):format(name,
        painted.pixels_of(count, expected[name])))
    end
    local svg = film_strip.svg(walked)
    t:ok(not svg:lower():find("nan", 1, true) and not svg:find("inf", 1, true), name)
    t:note(("%s: %s, %d bytes"):format(name, world.words(film.world), #svg))
  end
end)

suite:test("held masses are marked", { limit = 20 }, function(t)
  -- the second layer from below, as far as x = 0.1 m
  local walked = painted.walked_in { gravity = true, damping = true, actuation = true,
    anchors = { from = { 0, 0, 0.1 }, to = { 0.1, 1, 0.1 } } }
  local film = motion.of(walked, { 0, 0.2 })
  local count = 0
  for m, first in ipairs(film.poses[1].points) do
    if film.held[m] then
      count = count + 1
      t:equal(film.poses[2].points[m], first)
    end
  end
  t:equal(count, 6)
  t:ok(film_strip.svg(walked):find(">held<", 1, true), "in the legend")
  local marked = 0
  for _, face in ipairs(skin.visible(film.faces, film.poses[1].points, film.colors,
    view.of.side.sight, film.held)) do
    for _, edge in ipairs(face.edges) do marked = marked + (edge == "held" and 1 or 0) end
  end
  t:ok(marked >= 2, ("%d edges"):format(marked))
  local plain = motion.of(painted.walked_in(limax.scenes.land()), { 0 })
  t:equal(next(plain.held), nil)
end)

suite:test("any scene and any robot make a picture", { limit = 60 }, function(t)
  local heights = {}
  for x = 1, 40 do
    heights[x] = {}
    for y = 1, 40 do heights[x][y] = 0.05 * math.sin(x) * math.cos(2 * y) end
  end
  for name, around in pairs {
    far = limax.scenes.land { boxes = { from = { 1e5, 1e5, 0 }, to = { 1e6, 1e6, 1e6 } } },
    tiny = limax.scenes.land { spheres = { center = { 0.1, 0.1, -0.001 }, radius = 0.001 } },
    huge = limax.scenes.land { ground = false,
      spheres = { center = { 0, 0, -100 }, radius = 100 } },
    within = limax.scenes.land { boxes = { from = { -1, -1, -1 }, to = { 1, 1, 1 },
      stiffness = 1 } },
    fine = limax.scenes.land { ground = false, terrain = { spacing = 0.02, heights = heights,
      origin = { -0.4, -0.4, 0 } } },
    gorge = { gravity = true, friction = true, damping = true, planes = {
      { normal = { 0, 1, 1 } }, { normal = { 0, -1, 1 }, offset = -0.2 } } },
    steep = limax.scenes.slope { angle = math.rad(80) },
    corner = limax.scenes.corner { distance = 0.5 },
    crossing = limax.scenes.land { spheres = { { center = { 0.6, 0, 0 }, radius = 0.3 },
      { center = { 0.8, 0, 0 }, radius = 0.3 } },
      boxes = { from = { 0.5, -0.2, 0 }, to = { 0.9, 0.2, 0.2 } } },
  } do
    local walked = painted.walked_in(around, 0.1)
    local film = motion.of(walked, { 0, 0.1 })
    for _, from in ipairs(view.names) do
      local count, frame = painted.colors_of(film, from, 200)
      t:ok(frame.height > 20 and frame.height < 2000, ("%s: %d px"):format(name, frame.height))
      t:ok(next(count), name)
    end
    local svg = film_strip.svg(walked)
    t:ok(not svg:lower():find("nan", 1, true) and not svg:find("inf", 1, true), name)
    t:ok(#svg < 600e3, ("%s: %d bytes"):format(name, #svg))
  end
  t:equal(#stage.pieces(stage.new(world.of {}, AXES), SLAB, view.of.side.sight), 0)
end)

return suite
