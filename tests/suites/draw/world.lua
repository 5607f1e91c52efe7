--- world.lua: the world around a robot in pictures.

local canvases = require "limax.draw.canvas"
local host = require "limax.host"
local limax = require "limax"
local motion = require "limax.draw.motion"
local palette = require "limax.draw.palette"
local pictures = require "limax.draw.picture.scene"
local polygon = require "limax.draw.picture.polygon"
local sheet = require "limax.draw.sheet"
local stage = require "limax.draw.picture.stage"
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

-- The pixels of a film's first pose, four bytes each.
local function drawn(film, name, width)
  local frame = pictures.frame(film, view.of[name], width or 300, 1,
    { text = 9, gap = 0, head = 2 })
  local canvas = canvases.new("pixels", frame.panel, frame.height)
  pictures.draw(canvas, film, frame, film.poses[1], 1)
  pictures.flows(canvas, film, frame)
  return canvas:finish(), frame
end

-- The number of pixels of each colour, as "#rrggbb", in a film's first pose.
local function colors_of(film, name, width)
  local bytes, frame = drawn(film, name, width)
  local count = {}
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

suite:test("terrain has the engine's heights, and continues beyond its border", function(t)
  local terrain = { spacing = 0.5, origin = { -1, 2, 0.25 }, heights = { { 0, 1 }, { 2, 5 } } }
  t:equal(world.height(terrain, -1, 2), 0.25)
  t:equal(world.height(terrain, -0.5, 2.5), 5.25)
  -- bilinear: the mean of four in the middle
  t:equal(world.height(terrain, -0.75, 2.25), 2.25)
  t:equal(world.height(terrain, 100, -100), 2.25)
end)

suite:test("muscles are tinted by their activation, and the target is a ball", function(t)
  local scene = limax.scenes.land { actuation = false, target = { position = { 0.15, -0.06, 0.1 } },
    control = { signal = "a = place.x;", rate = 20 } }
  local walked = walked_in(scene)
  local film = motion.of(walked, { 0, 0.2 })
  local before, after = film.poses[1].tints, film.poses[2].tints
  for f, face in ipairs(film.faces) do
    t:equal(before[f], 1)
    -- three voxels along x at -2/3, 0, 2/3
    t:near(after[f], face.letter:find "[ec]" and 1 + 0.35 * (face.voxel[1] - 2) * 2 / 3 or 1,
      { rtol = 1e-6 })
  end
  local plain = colors_of(film, "side")
  film.poses[1].tints = after
  local tinted = colors_of(film, "side")
  t:ok(pixels_of(plain, world.target_hex) > 10)
  local differ = 0
  for color, count in pairs(plain) do differ = differ + math.abs(count - (tinted[color] or 0)) end
  t:ok(differ > 100, differ)
  t:ok(sheet.film_strip(walked):find("target at (0.15, -0.06, 0.1) m", 1, true))
end)

suite:test("what moves is drawn where it is at the time of the pose", function(t)
  local function shapes(forwards)
    local x = 0.05 + 0.4 * forwards
    return { { from = { x, -0.04, 0 }, to = { x + 0.1, -0.02, 0.1 } } },
      { { center = { x, 0.1, 0.28 }, radius = 0.03 } }
  end
  local boxes, spheres = shapes(0)
  for _, each in ipairs { boxes[1], spheres[1] } do
    each.velocity, each.turns = { 0.4, 0, 0 }, 0.2
  end
  local scene = limax.scenes.land { moving_boxes = boxes, moving_spheres = spheres }
  local walked = walked_in(scene, 0.5)
  local film = motion.of(walked, { 0, 0.15, 0.3, 0.5 })
  local poses, moving, back = film.poses, film.stage, film.stage.back
  for k, forwards in ipairs { 0, 0.15, 0.1, 0.1 } do -- s
    film.poses, film.stage = { poses[k] }, moving
    local found = drawn(film, "side")
    boxes, spheres = shapes(forwards)
    film.stage = stage.new(world.of { ground = { height = 0 }, boxes = boxes, spheres = spheres },
      { back { 1, 0, 0 }, back { 0, 1, 0 }, back { 0, 0, 1 } })
    t:ok(found == drawn(film, "side"), poses[k].time)
  end
  t:ok(sheet.film_strip(walked):find("ground, 1 moving box, 1 moving sphere", 1, true))
end)

suite:test("ground has the colours of the patches that cover it", function(t)
  local around = world.of { ground = { height = 0 }, patches = {
    { from = { 0, -9, -9 }, to = { 9, 9, 9 }, factor = 0.1 },
    { from = { -9, 0, -9 }, to = { 9, 9, 9 }, factor = 20 },
    { from = { -9, -9, 1 }, to = { 9, 9, 9 }, factor = 0 } } } -- above the ground
  local areas = {}
  for _, part in ipairs(stage.ground_parts(stage.new(around),
    { low = { -1, -1, -1 }, high = { 1, 1, 1 } })) do
    local normal = polygon.quad_normal(part.points)
    areas[part.look.fill] = (areas[part.look.fill] or 0) + normal[3] / 2
  end
  t:equal(areas, { [world.soil] = 1, [world.slippery] = 1, [world.rough] = 2 })
end)

suite:test("any world makes a picture", function(t)
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
    water = limax.scenes.water(),
  }
  for name, scene in pairs(scenes) do
    local walked = walked_in(scene, 0.1)
    local film = motion.of(walked, { 0, 0.1 })
    for _, from in ipairs(view.names) do
      local count, frame = colors_of(film, from, 200)
      t:ok(frame.height > 20 and frame.height < 2000, ("%s: %d px"):format(name, frame.height))
      t:ok(name == "within" or body_pixels(count, film) > 100, name)
    end
    local svg = sheet.film_strip(walked)
    t:ok(host.xml(svg) and not svg:lower():find "nan" and not svg:find "inf", name)
    t:ok(#svg < 600e3, ("%s: %d bytes"):format(name, #svg))
  end
end)
