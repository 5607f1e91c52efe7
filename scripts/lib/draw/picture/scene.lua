--- scene.lua: one pose of a robot in its world on a canvas, with ground, shadow and trail.
--- sheet.lua puts poses together.

local block_picture = require "limax.draw.block_picture"
local flow = require "limax.draw.picture.flow"
local order = require "limax.draw.picture.order"
local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local world = require "limax.draw.picture.world"

local scene = {}

-- of the ground's near edge
local EDGE = "#6b655b"
--- Colour of the path of the centre of mass.
scene.trail = "#c0392b"
--- Colour of the edges between held masses, and their thickness relative to other edges.
scene.held = "#26282b"
local HELD = 4

-- Room around a body, of its length and of its width: what is there is part of the picture.
local ROOM, ROOM_FOR_OBSTACLES = { 0.06, 0.06 }, { 0.3, 0.15 }
-- A block counts for the size of a picture as far as this from the body, in lengths of the body.
local MOST_BLOCK = 1
-- of a wall that is seen from behind
local VEIL = 0.12
-- height of a capital, of the size of a text
local CAPITAL = 0.73

---@class limax.picture.frame what all panels share
---@field view limax.picture.view
---@field scale number px/m
---@field panel integer px, width of one
---@field count integer panels side by side
---@field gap number px between panels
---@field left number px, where the first begins
---@field top number px, where its panels begin
---@field height integer px
---@field text number px, height of a capital
---@field capital number height of a capital, of the size of its text
---@field low number[] right and up, m, of the lowest corner seen from a pose's middle
---@field slab limax.picture.slab around the middle, what is shown of the world
---@field head number capitals above what is drawn in the panels, for scale bar and flows
---@field flow_room number capitals of these, the last, for wind and current

-- A point seen from a pose's middle.
local function from_middle(pose, p)
  return { p[1] - pose.middle[1], p[2] - pose.middle[2], p[3] - pose.base }
end

-- Calls `take` for the points of all poses seen from their middles. Those of blocks are moved into
-- a box, without which they are left out.
local function each_point(film, take, low, high)
  for _, pose in ipairs(film.poses) do
    for _, p in ipairs(pose.points) do take(from_middle(pose, p)) end
    for _, block in ipairs(low and pose.blocks or {}) do
      for _, p in ipairs(block) do
        local at = from_middle(pose, p)
        for c = 1, 3 do at[c] = math.min(math.max(at[c], low[c]), high[c]) end
        take(at)
      end
    end
  end
end

-- The extent of the bodies of all poses around the middle, and of blocks that are near.
local function reach_of(film)
  local low, high, take = polygon.bounds(3)
  each_point(film, take)
  local most = MOST_BLOCK * (high[1] - low[1])
  each_point(film, take, { low[1] - most, low[2] - most, low[3] - most },
    { high[1] + most, high[2] + most, high[3] + most })
  return low, high
end

-- The part of the world around a pose's middle that is shown.
local function slab_of(film, low, high)
  local slab = { low = {}, high = {} }
  for c = 1, 2 do
    local share = (world.has_obstacles(film.world) and ROOM_FOR_OBSTACLES or ROOM)[c]
    local room = share * (high[c] - low[c]) + 0.02
    slab.low[c], slab.high[c] = low[c] - room, high[c] + room
  end
  local tall = high[3] - low[3] + slab.high[1] - slab.low[1]
  slab.low[3], slab.high[3] = low[3] - tall, high[3] + tall
  return slab
end

--- A frame that holds every pose, `width` px for all panels together.
---@param count integer panels side by side
---@param options { text: number, gap: number, head: number } px of a capital and between panels;
--- capitals above what is drawn in the panels; flows get more
function scene.frame(film, view, width, count, options)
  local low, high = reach_of(film)
  local slab = slab_of(film, low, high)
  local least, most, take = polygon.bounds(2)
  local function hold(p) take { view.project(p) } end
  each_point(film, hold, slab.low, { slab.high[1], slab.high[2], high[3] })
  if world.has_obstacles(film.world) or film.stage.ground then
    local pose = film.poses[1]
    for _, along in ipairs { slab.low[1], slab.high[1] } do
      for _, away in ipairs { slab.low[2], slab.high[2] } do
        local height = stage.ground_height(film.stage, pose.middle[1] + along,
          pose.middle[2] + away)
        hold { along, away, height and height - pose.base or low[3] }
      end
    end
  end
  local flow_room = flow.room(film.stage)
  local panel = math.floor((width - (count - 1) * options.gap) / count)
  local room = 0.03 * (most[1] - least[1])
  local frame = { view = view, panel = panel, count = count, gap = options.gap, left = 0, top = 0,
    text = options.text, capital = CAPITAL, slab = slab, head = options.head + flow_room,
    flow_room = flow_room, tall = most[2] - least[2] + 2 * room,
    low = { (least[1] + most[1]) / 2, least[2] - room } }
  scene.rescale(frame, panel / (most[1] - least[1] + 2 * room))
  return frame
end

--- Another scale for a frame; its height follows.
---@param scale number px/m
function scene.rescale(frame, scale)
  frame.scale, frame.height = scale, math.ceil(frame.tall * scale + frame.head * frame.text)
end

-- Lines across the path on a flat piece: one every 0.1 m and a darker one every 0.5 m show the
-- distance.
local function draw_rules(canvas, piece, place)
  local least, most, take = polygon.bounds(1)
  for _, p in ipairs(piece.points) do take(p) end
  for k = math.ceil(least[1] * 10), math.floor(most[1] * 10) do
    local from, to = polygon.crossing(piece, { 1, 0, 0 }, k / 10)
    if from and to then
      local strong = k % 5 == 0
      canvas:line(place(from), place(to), world.rules[strong and "strong" or "fine"],
        strong and 1.2 or 0.8)
    end
  end
end

local function draw_ground(canvas, film, slab, place)
  local ground = stage.ground_in(film.stage, slab)
  -- the whole first, so that no gaps show between parts
  local parts = #film.stage.patches > 0 and stage.ground_parts(film.stage, slab) or {}
  for _, part in ipairs { ground, unpack(parts) } do
    local corners = {}
    for k, p in ipairs(part.points) do corners[k] = place(p) end
    canvas:polygon(corners, { fill = part.look.fill })
  end
  draw_rules(canvas, ground, place)
  canvas:line(place(ground.points[1]), place(ground.points[2]), EDGE, 1.2)
end

-- Draws a shadow straight below the body.
local function draw_shadow(canvas, film, points, place)
  local shadow = {}
  for k, p in ipairs(points) do
    shadow[k] = place { p[1], p[2], stage.ground_height(film.stage, p[1], p[2]) }
  end
  canvas:polygon(skin.outline(shadow), { fill = "#000000", fill_opacity = 0.13 })
end

-- The path up to a pose, where the body was in space.
local function draw_trail(canvas, film, pose, place, frame)
  local points = {}
  for s = 1, pose.sample do points[s] = place(film.path[s]) end
  canvas:path(points, { stroke = scene.trail, width = math.max(1.2, frame.panel / 300) })
  canvas:circle(points[#points], math.max(2.5, frame.panel / 130),
    { fill = scene.trail, stroke = "#ffffff", width = 0.9 })
end

--- Draws the world in a slab and a pose of the body, the farthest pieces first.
---@param place fun(p: number[]): number[] a point on the canvas, px
---@param thin number px, the lines between faces
---@param pose? limax.motion.pose without one only what does not move is drawn
function scene.draw_solids(canvas, film, slab, view, place, thin, pose)
  local blocks = {}
  for b, corners in ipairs(pose and pose.blocks or {}) do
    blocks[b] = block_picture.spaces(corners)
  end
  local items, veils, faces = stage.pieces(film.stage, slab, pose and pose.time, view.sight,
    blocks, block_picture.hex)
  local function paint(piece, opacity)
    local points = {}
    for k, p in ipairs(piece.points) do points[k] = place(p) end
    canvas:face(points, piece.look.fill, piece.edges, piece.look.ink, thin, opacity)
    for k, edge in ipairs(piece.edges) do
      if edge == "held" then
        canvas:line(points[k], points[k % #points + 1], scene.held, HELD * thin)
      end
    end
    if piece.look.ruled and not opacity then draw_rules(canvas, piece, place) end
  end
  local bodies = pose and skin.visible(film.faces, pose.points, film.colors, view.sight, film.held,
    pose.tints)
  for _, face in ipairs(bodies or {}) do faces[#faces + 1] = face end
  for _, piece in ipairs(order.sorted(items, faces, view.sight)) do paint(piece) end
  for _, veil in ipairs(veils) do paint(veil, VEIL) end
end

--- Draws one pose as panel `k` from the left.
function scene.draw(canvas, film, frame, pose, k)
  local view, left = frame.view, scene.left(frame, k)
  local bottom = frame.top + frame.height
  local function place(p)
    local x, y = view.project(from_middle(pose, p))
    return { left + frame.panel / 2 + (x - frame.low[1]) * frame.scale,
      bottom - (y - frame.low[2]) * frame.scale }
  end
  local slab = { low = {}, high = {} }
  for c, middle in ipairs { pose.middle[1], pose.middle[2], pose.base } do
    slab.low[c], slab.high[c] = frame.slab.low[c] + middle, frame.slab.high[c] + middle
  end
  canvas:clip(left, frame.top, left + frame.panel, bottom)
  if film.stage.ground then
    draw_ground(canvas, film, slab, place)
    if view.shadow then
      draw_shadow(canvas, film, pose.points, place)
      for _, block in ipairs(pose.blocks) do draw_shadow(canvas, film, block, place) end
    end
  end
  scene.draw_solids(canvas, film, slab, view, place, math.max(0.5, frame.panel / 600), pose)
  draw_trail(canvas, film, pose, place, frame)
  canvas:clip()
end

--- px, where panel `k` begins.
function scene.left(frame, k) return frame.left + (k - 1) * (frame.panel + frame.gap) end

--- Draws arrows for wind and current, with their speeds, above what is drawn in the panels.
function scene.flows(canvas, film, frame)
  flow.draw(canvas, film.stage, frame, frame.top + (frame.head - frame.flow_room) * frame.text)
end

return scene
