--- picture_world.lua: what pictures draw of a scene's world: everything that stands there, in front
--- of what it hides and behind what hides it.

local block_picture = require "limax.block_picture"
local film_strip = require "limax.film_strip"
local host = require "limax.host"
local limax = require "limax"
local motion = require "limax.motion"
local order = require "limax.picture.order"
local palette = require "limax.palette"
local pixels = require "limax.picture.pixels"
local polygon = require "limax.picture.polygon"
local scene = require "limax.picture.scene"
local script = require "limax.script"
local skin = require "limax.skin"
local stage = require "limax.picture.stage"
local view = require "limax.picture.view"
local world = require "limax.picture.world"

local suite = require("limax.test").suite "picture_world"

local AXES = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }
local SLAB = { low = { -1, -1, -1 }, high = { 1, 1, 1 } }

-- ---- what hides what ----------------------------------------------------------------------------

-- The faces of a cube that look at the eye.
local function cube_faces(low, edge, sight)
  local corners, faces = {}, {}
  for k = 0, 7 do
    corners[k + 1] = {}
    for c = 1, 3 do
      corners[k + 1][c] = low[c] + (math.floor(k / 2 ^ (c - 1)) % 2) * edge
    end
  end
  for k, face in ipairs(block_picture.faces(0)) do
    faces[k] = { corners = face.corners, letter = "e" }
  end
  return skin.visible(faces, corners, { e = { hex = "#e8743a" } }, sight)
end

-- m^2: nearer to an edge than this is on it
local EDGE = 1e-4

-- Where the line of sight through a point of the page meets a flat polygon: its depth, or nothing.
local function depth_at(piece, x, y, from)
  local points, flat = piece.points, {}
  for k, p in ipairs(points) do flat[k] = { from.project(p) } end
  local area = 0
  for k, p in ipairs(flat) do
    local q = flat[k % #flat + 1]
    area = area + p[1] * q[2] - q[1] * p[2]
  end
  local near = math.huge
  for k, p in ipairs(flat) do
    local q = flat[k % #flat + 1]
    -- twice the area between the point and an edge; inside it has one sign
    local turn = (q[1] - p[1]) * (y - p[2]) - (q[2] - p[2]) * (x - p[1])
    near = math.min(near, area > 0 and turn or -turn)
  end
  -- edges are no place to ask
  if near < EDGE then return nil, near > -EDGE end
  local one, other = {}, {}
  for c = 1, 3 do one[c], other[c] = points[2][c] - points[1][c], points[3][c] - points[1][c] end
  local normal = polygon.cross(one, other)
  -- a point of that line: what the page shows at along = ... with away = 0 or up = 0
  local at = { 0, 0, 0 }
  local x0, y0 = from.project(at)
  local ax, ay = from.project { 1, 0, 0 }
  local e = from.eye_axis
  local bx, by = from.project(e)
  ax, ay, bx, by = ax - x0, ay - y0, bx - x0, by - y0
  local det = ax * by - ay * bx
  local u, v = ((x - x0) * by - (y - y0) * bx) / det, (ax * (y - y0) - ay * (x - x0)) / det
  at = { u + v * e[1], v * e[2], v * e[3] }
  local rate = polygon.dot(normal, from.sight)
  if math.abs(rate) < 1e-12 then return nil, true end
  return (polygon.dot(normal, points[1]) - polygon.dot(normal, at)) / rate
end

local EYES = {}
for _, name in ipairs(view.names) do
  EYES[name] = { project = view.of[name].project, sight = view.of[name].sight,
    -- a direction that the page shows beside that of along
    eye_axis = name == "top" and { 0, 1, 0 } or { 0, 0, 1 } }
end

-- Asks at many points of the page what was painted there last, and whether that is the nearest.
local function check_order(t, from, pieces, faces, random)
  local all, painted = {}, {}
  for _, side in ipairs(pieces.sides) do all[#all + 1] = side end
  for _, ball in ipairs(pieces.balls) do
    for _, facet in ipairs(ball.facets) do all[#all + 1] = facet end
  end
  for _, face in ipairs(faces) do all[#all + 1] = face end
  local sorted = order.new(pieces, from.sight)
  for _, face in ipairs(faces) do sorted:add(face) end
  sorted:each(function(piece) painted[#painted + 1] = piece end)
  local asked = 0
  for _ = 1, 400 do
    local x, y = 2.4 * random:uniform() - 1.2, 2.4 * random:uniform() - 1.2
    local last, nearest, least, second, unsure = nil, nil, math.huge, math.huge, false
    for _, piece in ipairs(painted) do
      local depth, edge = depth_at(piece, x, y, from)
      unsure = unsure or edge
      if depth then last = piece.look end
    end
    for _, piece in ipairs(all) do
      local depth = depth_at(piece, x, y, from)
      if depth and depth < least then
        nearest, second, least = piece.look, least, depth
      elseif depth then
        second = math.min(second, depth)
      end
    end
    -- pieces that touch may be painted either way
    if not unsure and second - least > 0.02 then
      t:ok(last == nearest, ("at %.3f, %.3f the nearest is not on top"):format(x, y))
      asked = asked + (nearest and 1 or 0)
    end
  end
  return asked
end

suite:test("the last that is painted at a place is the nearest there", { limit = 60 }, function(t)
  local random = limax.engine.random(5, 1, "user")
  local function between(low, high) return low + (high - low) * random:uniform() end
  for _, name in ipairs(view.names) do
    local from, asked = EYES[name], 0
    for _ = 1, 12 do
      local given = { up = { 0, 0, 1 }, planes = {}, boxes = {}, spheres = {} }
      -- boxes and balls on a chessboard of 0.5 m, cubes on the other fields: nothing overlaps
      local cubes = {}
      for i = -2, 1 do
        for j = -2, 1 do
          local x, y = i / 2 + 0.02, j / 2 + 0.02
          local what = random:integer(4)
          if what == 1 then
            given.boxes[#given.boxes + 1] = { from = { x, y, 0 },
              to = { x + between(0.1, 0.45), y + between(0.1, 0.45), between(0.05, 0.8) } }
          elseif what == 2 then
            given.spheres[#given.spheres + 1] = { center = { x + 0.23, y + 0.23,
              between(0.23, 0.5) }, radius = between(0.05, 0.22) }
          else
            cubes[#cubes + 1] = { x + between(0, 0.2), y + between(0, 0.2), between(0, 0.6) }
          end
        end
      end
      local block = block_picture.spaces(block_picture.corners({ 0, 0, 1.3, 0.9, 0.3, 0.3,
        0.1 }, { 0.3, 0.4, 0.2 }))
      local turned = stage.new(given, AXES)
      local pieces = stage.pieces(turned, { low = { -2, -2, -2 }, high = { 2, 2, 2 } }, from.sight,
        block, "#b98b4f")
      local faces = {}
      for _, low in ipairs(cubes) do
        for _, face in ipairs(cube_faces(low, 0.25, from.sight)) do faces[#faces + 1] = face end
      end
      asked = asked + check_order(t, from, pieces, faces, random)
    end
    t:ok(asked > 500, ("%s: %d places were asked"):format(name, asked))
  end
end)

suite:test("the faces of a body at rest hide each other as they do", { limit = 30 }, function(t)
  local random, n = limax.engine.random(6, 1, "user"), 4
  for _, name in ipairs(view.names) do
    local from, voxel, mass_at, points = EYES[name], {}, {}, {}
    for x = 1, n do
      voxel[x] = {}
      for y = 1, n do
        voxel[x][y] = {}
        for z = 1, n do voxel[x][y][z] = random:uniform() < 0.6 and "e" or "." end
      end
    end
    for z = 0, n do
      for y = 0, n do
        for x = 0, n do
          points[#points + 1] = { x / 4 - 0.5, y / 4 - 0.5, z / 4 - 0.5 }
          mass_at[x + (n + 1) * (y + (n + 1) * z)] = #points
        end
      end
    end
    local faces = skin.visible(skin.faces(voxel, mass_at), points, { e = { hex = "#e8743a" } },
      from.sight)
    t:ok(check_order(t, from, { sides = {}, balls = {}, patches = {} }, faces, random) > 40)
  end
end)

suite:test("a plane cuts a polygon in two that make the whole", function(t)
  local square = { points = { { 0, 0, 0 }, { 2, 0, 0 }, { 2, 2, 0 }, { 0, 2, 0 } },
    edges = { true, true, true, true }, look = {} }
  local front, behind = polygon.split(square, { 1, 0, 0 }, 0.5)
  t:equal(front.points, { { 0.5, 0, 0 }, { 2, 0, 0 }, { 2, 2, 0 }, { 0.5, 2, 0 } })
  -- the cut has no line
  t:equal(front.edges, { true, true, true, false })
  t:equal(behind.points, { { 0, 0, 0 }, { 0.5, 0, 0 }, { 0.5, 2, 0 }, { 0, 2, 0 } })
  t:equal(behind.edges, { true, false, true, true })
  t:equal({ polygon.split(square, { 1, 0, 0 }, 0.01, 0.02) }, { square })
  t:equal(select(2, polygon.split(square, { 1, 0, 0 }, 1.99, 0.02)), square)
  t:equal(select(2, polygon.split(square, { 1, 0, 0 }, 3)), square)
  t:equal({ polygon.crossing(square, { 1, 0, 0 }, 0.5) }, { { 0.5, 0, 0 }, { 0.5, 2, 0 } })
  t:equal(polygon.crossing(square, { 0, 0, 1 }, 1), nil)
end)

suite:test("the sides of a solid have lines along their edges", function(t)
  local box = { up = { 0, 0, 1 }, planes = {}, spheres = {},
    boxes = { { from = { 0, 0, 0 }, to = { 0.5, 0.4, 0.3 } } } }
  local pieces = stage.pieces(stage.new(box, AXES), SLAB, view.of.side.sight)
  t:equal(#pieces.sides, 3)
  for _, side in ipairs(pieces.sides) do t:equal(side.edges, { true, true, true, true }) end
end)

suite:test("terrain has the engine's heights, and goes on beyond its border", function(t)
  local terrain = { spacing = 0.5, origin = { -1, 2, 0.25 }, heights = { { 0, 1 }, { 2, 5 } } }
  t:equal(world.height(terrain, -1, 2), 0.25)
  t:equal(world.height(terrain, -0.5, 2.5), 5.25)
  -- bilinear: the mean of four in the middle
  t:equal(world.height(terrain, -0.75, 2.25), 2.25)
  t:equal(world.height(terrain, 100, -100), 2.25)
  t:equal(world.height(terrain, -100, 100), 1.25)
end)

-- ---- pictures -----------------------------------------------------------------------------------

local VOXELS = "ees\nccb\n\nsse\nbbc"

-- A robot that was simulated for a moment in this scene.
local function walked_in(around, duration)
  return assert(motion.simulate(limax.robot { voxels = VOXELS }, { scene = around,
    duration = duration or 0.2 }))
end

-- How many pixels of a picture have each colour, as "#rrggbb".
local function colors_of(film, name, width)
  local frame = scene.frame(film, view.of[name], width or 300, 1)
  local canvas = pixels.new(frame.panel, frame.height, "#ffffff")
  scene.draw(canvas, film, frame, film.poses[1], 1)
  local bytes, count = canvas:finish(), {}
  for at = 1, #bytes, 4 do
    local color = ("#%02x%02x%02x"):format(bytes:byte(at, at + 2))
    count[color] = (count[color] or 0) + 1
  end
  return count, frame
end

-- Pixels of a colour in any light that falls on a flat face.
local function pixels_of(count, hex)
  local sum, seen = 0, {}
  for k = 0, 400 do
    local shade = palette.shade(hex, 0.5 + k / 400 * 0.6)
    if not seen[shade] then sum, seen[shade] = sum + (count[shade] or 0), true end
  end
  return sum
end

local function body_pixels(count, film)
  local sum = 0
  for letter in pairs(film.used) do sum = sum + pixels_of(count, film.colors[letter].hex) end
  return sum
end

suite:test("what stands around a robot is in its picture, from every side", { limit = 30 },
  function(t)
    local wide = { from = { 0.35, -3, 0 }, to = { 3, 3, 0.08 } }
    local scenes = {
      box = limax.scenes.land { boxes = wide },
      sphere = limax.scenes.land { spheres = { center = { 0.42, 0.1, 0 }, radius = 0.12 } },
    }
    for what, around in pairs(scenes) do
      local film = motion.of(walked_in(around), { 0 })
      for _, name in ipairs(view.names) do
        local count = colors_of(film, name)
        t:ok(pixels_of(count, world.hex) > 200, ("%s from %s: %d pixels"):format(what, name,
          pixels_of(count, world.hex)))
      end
    end
    local plain = motion.of(walked_in(limax.scenes.land()), { 0 })
    local count = colors_of(plain, "side")
    t:ok(pixels_of(count, world.hex) < 20)
    -- a wall behind the body is seen, one before it is a veil through which the body is
    local function walled(side)
      local far = -math.huge
      for _, p in ipairs(plain.poses[1].points) do far = math.max(far, -side * p[2]) end
      plain.world = { up = { 0, 0, 1 }, ground = 0, boxes = {}, spheres = {},
        planes = { { normal = { 0, side, 0 }, offset = -far - 0.02 } } }
      plain.stage = stage.new(plain.world, AXES)
      local seen = colors_of(plain, "side")
      return pixels_of(seen, world.hex), body_pixels(seen, plain)
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
    local film = motion.of(walked_in(limax.scenes.land {
      boxes = { from = { -1, low, 0 }, to = { 1.5, high, 0.5 } } }), { 0 })
    local count = colors_of(film, "side")
    return body_pixels(count, film), pixels_of(count, world.hex)
  end
  local before, box = seen(0.23, 0.5)
  t:ok(before > 5000 and box > 2000, ("%d of the body, %d of the box"):format(before, box))
  local behind = seen(-0.2, -0.03)
  t:ok(behind < 0.2 * before, ("%d pixels of %d show behind the box"):format(behind, before))
end)

suite:test("what cannot hide a robot takes no pixel of it", { limit = 20 }, function(t)
  -- wherever the eye is, what lies lower than a body's feet, or in front of which it stands, is
  -- behind it
  local plain = motion.of(walked_in(limax.scenes.land()), { 0 })
  local count, frame = colors_of(plain, "side")
  local share = body_pixels(count, plain) / frame.scale ^ 2
  for name, around in pairs {
    steps = limax.scenes.land { ground = { height = -0.1 },
      boxes = { from = { -2, -2, -0.1 }, to = { 2, 2, 0 } } },
    terrain = limax.scenes.land { ground = false, terrain = { spacing = 0.3, origin = { -3, -3, 0 },
      heights = { { 0, 0 }, { 0, 0 } } } },
    floor = limax.scenes.land { ground = false, planes = true },
    wall = limax.scenes.land { planes = { normal = { 0, -1, 0 }, offset = -0.22 } },
  } do
    local film = motion.of(walked_in(around), { 0 })
    count, frame = colors_of(film, "side", 600)
    -- lines between faces take more pixels of a smaller picture
    t:near(body_pixels(count, film) / frame.scale ^ 2, share, { rtol = 0.1 })
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
      local film = motion.of(walked_in(limax.scenes.land { ground = false, terrain = {
        spacing = 0.05, origin = { -1, -1, 0 }, heights = heights } }), { 0 })
      -- along x whatever its first steps were
      local count = colors_of(film, "side")
      return body_pixels(count, film)
    end
    local before, behind = seen(0.22, 0.4), seen(-0.2, -0.03)
    t:ok(before > 5000, ("%d pixels before the ridge"):format(before))
    t:ok(behind < 0.3 * before, ("%d pixels of %d behind it"):format(behind, before))
  end)

suite:test("a slope is seen as one: up is against gravity", { limit = 20 }, function(t)
  local film = motion.of(walked_in(limax.scenes.slope { angle = math.rad(10) }), { 0 })
  t:near(math.deg(world.slope(film.world)), 10, { atol = 1e-9 })
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

suite:test("a simulation that goes on is drawn as it is, its block too", function(t)
  local moving = limax.robot { voxels = VOXELS }:begin { duration = 1, settle = 0,
    scene = limax.scenes.land { block = { position = { 0.5, 0, 0 }, velocity = { 1, 0, 0 } } } }
  local function block_now()
    local film = motion.now(moving.finished(), moving:positions():table(), moving.time)
    t:ok(next((colors_of(film, "side"))))
    return film.poses[1].block[1][1]
  end
  local before = block_now()
  moving:go(0.1)
  t:ok(block_now() > before + 0.02, "the block has moved")
end)

suite:test("the paper's materials are told apart in grey", function(t)
  local list = limax.robot { voxels = VOXELS }.materials:table().materials
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

suite:test("the film strip tells what is there, and that a block was not recorded", { limit = 20 },
  function(t)
    local land = limax.scenes.land { spheres = { center = { 1, 0, 0 }, radius = 0.1 },
      boxes = { { from = { 2, 0, 0 }, to = { 3, 1, 1 } },
        { from = { 4, 0, 0 }, to = { 5, 1, 1 } } },
      block = { position = { 0.5, 0, 0 } } }
    local robot = limax.robot { voxels = VOXELS }
    local svg = film_strip.svg(walked_in(land))
    t:ok(svg:find(">ground, 2 boxes, 1 sphere<", 1, true), "what is there")
    t:ok(svg:find(">obstacle<", 1, true) and svg:find(">block<", 1, true))
    local without = robot:simulate { scene = land, duration = 0.2, record = { position = 20 } }
    svg = film_strip.svg(without)
    t:ok(svg:find("the block is not drawn: its way was not recorded", 1, true))
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
    local count = colors_of(film, "side")
    t:ok(body_pixels(count, film) > 3000, name)
    if expected[name] then
      t:ok(pixels_of(count, expected[name]) > 100, ("%s: %d pixels"):format(name,
        pixels_of(count, expected[name])))
    end
    local svg = film_strip.svg(walked)
    t:ok(not svg:lower():find("nan", 1, true) and not svg:find("inf", 1, true), name)
    t:note(("%s: %s, %d bytes"):format(name, world.words(film.world), #svg))
  end
end)

suite:test("what anchors hold is marked", { limit = 20 }, function(t)
  -- the second layer from below, as far as x = 0.1 m
  local walked = walked_in { gravity = true, damping = true, actuation = true,
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
  local plain = motion.of(walked_in(limax.scenes.land()), { 0 })
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
    local walked = walked_in(around, 0.1)
    local film = motion.of(walked, { 0, 0.1 })
    for _, from in ipairs(view.names) do
      local count, frame = colors_of(film, from, 200)
      t:ok(frame.height > 20 and frame.height < 2000, ("%s: %d px"):format(name, frame.height))
      t:ok(next(count), name)
    end
    local svg = film_strip.svg(walked)
    t:ok(not svg:lower():find("nan", 1, true) and not svg:find("inf", 1, true), name)
    t:ok(#svg < 600e3, ("%s: %d bytes"):format(name, #svg))
  end
  t:equal(#stage.pieces(stage.new(world.of {}, AXES), SLAB, view.of.side.sight).sides, 0)
end)

return suite
