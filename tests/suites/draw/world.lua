--- world.lua: the world around a robot in pictures.

local canvases = require "limax.draw.canvas"
local host = require "limax.host"
local limax = require "limax"
local motion = require "limax.draw.motion"
local palette = require "limax.draw.palette"
local pictures = require "limax.draw.picture.scene"
local script = require "limax.base.script"
local sheet = require "limax.draw.sheet"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local suite = require("limax.test").suite "draw_world"

-- A body of every material.
local VOXELS = "ees\nccb\n\nsse\nbbc"

-- A robot that was simulated briefly in this scene.
local function walked_in(scene, duration)
  return assert(motion.simulate(limax.robot { voxels = VOXELS }, { scene = scene,
    duration = duration or 0.2 }))
end

-- The number of pixels of each colour, as "#rrggbb", in a film's first pose.
local function colors_of(film, name, width)
  local frame = pictures.frame(film, view.of[name], width or 300, 1,
    { text = 9, gap = 0, head = 2 })
  local canvas = canvases.new("pixels", frame.panel, frame.height)
  pictures.draw(canvas, film, frame, film.poses[1], 1)
  pictures.flows(canvas, film, frame)
  local bytes, count = canvas:finish(), {}
  for at = 1, #bytes, 4 do
    local color = ("#%02x%02x%02x"):format(bytes:byte(at, at + 2))
    count[color] = (count[color] or 0) + 1
  end
  return count, frame
end

-- The number of pixels of a colour under any light on a flat face.
local function pixels_of(count, hex)
  local sum, seen = 0, {}
  for k = 0, 400 do
    local shade = palette.shade(hex, 0.5 + k / 400 * 0.6)
    if not seen[shade] then sum, seen[shade] = sum + (count[shade] or 0), true end
  end
  return sum
end

-- The number of pixels of a body.
local function body_pixels(count, film)
  local sum = 0
  for letter in pairs(film.used) do
    sum = sum + pixels_of(count, film.colors[letter].hex)
  end
  return sum
end

-- A height field of 41 x 41 heights 0.05 m apart around the origin.
local function field(height_at)
  local heights = {}
  for x = 1, 41 do
    heights[x] = {}
    for y = 1, 41 do heights[x][y] = height_at((x - 21) * 0.05, (y - 21) * 0.05) end
  end
  return limax.scenes.land { ground = false,
    terrain = { spacing = 0.05, origin = { -1, -1, 0 }, heights = heights } }
end

-- Pixels of the body.
local function seen(scene)
  local film = motion.of(walked_in(scene), { 0 })
  return body_pixels(colors_of(film, "side"), film)
end

suite:test("terrain has the engine's heights, and continues beyond its border", function(t)
  local terrain = { spacing = 0.5, origin = { -1, 2, 0.25 }, heights = { { 0, 1 }, { 2, 5 } } }
  t:equal(world.height(terrain, -1, 2), 0.25)
  t:equal(world.height(terrain, -0.5, 2.5), 5.25)
  -- bilinear: the mean of four in the middle
  t:equal(world.height(terrain, -0.75, 2.25), 2.25)
  t:equal(world.height(terrain, 100, -100), 2.25)
end)

suite:test("boxes and ridges hide a robot behind them and not one in front",
  function(t)
    for name, scene_of in pairs {
      box = function(low, high)
        return limax.scenes.land { boxes = { from = { -1, low, 0 }, to = { 1.5, high, 0.5 } } }
      end,
      ridge = function(low, high)
        return field(function(_, y) return y > low and y < high and 0.5 or 0 end)
      end } do
      local before, behind = seen(scene_of(0.23, 0.45)), seen(scene_of(-0.2, -0.03))
      t:ok(before > 5000, ("%s: %d pixels in front of it"):format(name, before))
      t:ok(behind < 0.3 * before, ("%s: %d pixels of %d behind it"):format(name, behind, before))
    end
  end)

suite:test("a slope is seen as one: up is against gravity", function(t)
  local film = motion.of(walked_in(limax.scenes.slope { angle = math.rad(10) }), { 0 })
  t:equal(world.words(film.world), "ground with a slope of 10 degrees")
  local down = film.stage.turn { 1, 0, 0 }
  t:near(math.deg(math.asin(-down[3])), 10, { atol = 1e-9 })
  -- nothing to stand on, or no gravity: z stays up
  t:equal(world.of({ gravity = { acceleration = { 3, 0, -9 } } }).up, { 0, 0, 1 })
  t:equal(world.of({ ground = { height = 0 } }).up, { 0, 0, 1 })
end)

suite:test("held masses are marked", function(t)
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
  local svg = sheet.film_strip(walked)
  t:ok(svg:find(">held<", 1, true), "in the legend")
  t:ok(select(2, svg:gsub('stroke="#26282b" stroke%-width="2"', "")) >= 6, "thick edges")
end)

suite:test("each experiment's world, and any other, makes a picture", function(t)
  local scenes = {
    far = limax.scenes.land { boxes = { from = { 1e5, 1e5, 0 }, to = { 1e6, 1e6, 1e6 } } },
    huge = limax.scenes.land { ground = false,
      spheres = { center = { 0, 0, -100 }, radius = 100 } },
    within = limax.scenes.land { boxes = { from = { -1, -1, -1 }, to = { 1, 1, 1 },
      stiffness = 1 } },
    rough = field(function(x, y) return 0.05 * math.sin(20 * x) * math.cos(40 * y) end),
    gorge = { gravity = true, friction = true, damping = true, planes = {
      { normal = { 0, 1, 1 } }, { normal = { 0, -1, 1 }, offset = -0.2 } } },
    steep = limax.scenes.slope { angle = math.rad(80) },
    crossing = limax.scenes.land { spheres = { { center = { 0.6, 0, 0 }, radius = 0.3 },
      { center = { 0.8, 0, 0 }, radius = 0.3 } },
      boxes = { from = { 0.5, -0.2, 0 }, to = { 0.9, 0.2, 0.2 } } },
  }
  for _, name in ipairs { "stairs", "climb", "grip", "carry", "swim" } do
    scenes[name] = script.run(("%s/scripts/experiments/%s.lua"):format(host.home, name))
      .config.scene
  end
  for name, scene in pairs(scenes) do
    local walked = walked_in(scene, 0.1)
    local film = motion.of(walked, { 0, 0.1 })
    for _, from in ipairs(view.names) do
      local count, frame = colors_of(film, from, 200)
      t:ok(frame.height > 20 and frame.height < 2000, ("%s: %d px"):format(name, frame.height))
      t:ok(name == "within" or body_pixels(count, film) > 100, name)
    end
    local svg = sheet.film_strip(walked)
    t:ok(host.xml(svg) and not svg:lower():find("nan", 1, true) and not svg:find("inf", 1, true),
      name)
    t:ok(#svg < 600e3, ("%s: %d bytes"):format(name, #svg))
  end
end)
