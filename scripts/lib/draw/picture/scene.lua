--- scene.lua: poses side by side on a canvas (pixels.lua or vectors.lua): the body in its world,
--- with ground, shadow and trail, the time of each, and for all one scale bar and the flows.

local block_picture = require "limax.draw.block_picture"
local flow = require "limax.draw.picture.flow"
local motion = require "limax.draw.motion"
local order = require "limax.draw.picture.order"
local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local world = require "limax.draw.picture.world"

local scene = {}

local ink = { text = "#2b2b2b", ground = "#efece6", fine = "#dcd7cc", strong = "#b9b2a4",
  line = "#6b655b", trail = "#c0392b" }

-- Room around a body, of its length and of its width: what stands there is part of the picture.
local ROOM, ROOM_FOR_OBSTACLES = { 0.06, 0.06 }, { 0.3, 0.15 }
-- A block counts for the size of a picture as far as this from the body, in reaches of the body.
local MOST_BLOCK = 1
-- capitals below the panels, with the times, and above, with the scale bar
local FOOT, HEAD = 3.2, 2
-- of a wall that is seen from behind
local VEIL = 0.12
--- What the edges between held masses are drawn with, and how thick, of other edges.
scene.held = "#26282b"
local HELD = 4

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
---@field low number[] right and up, m, of the lowest corner seen from a pose's middle
---@field slab limax.picture.slab around the middle, what is shown of the world
---@field foot number capitals below the panels
---@field head number capitals above what is drawn in them
---@field flow_room number capitals of these, the last, for wind and current

-- A point seen from a pose's middle.
local function from_middle(pose, p)
  return { p[1] - pose.middle[1], p[2] - pose.middle[2], p[3] - pose.base }
end

-- How far the bodies of all poses, and the block where it is near, reach around the middle.
local function reach_of(film)
  local low, high = { math.huge, math.huge, math.huge }, { -math.huge, -math.huge, -math.huge }
  local function take(at)
    for c = 1, 3 do low[c], high[c] = math.min(low[c], at[c]), math.max(high[c], at[c]) end
  end
  for _, pose in ipairs(film.poses) do
    for _, p in ipairs(pose.points) do take(from_middle(pose, p)) end
  end
  local most = {}
  for c = 1, 2 do most[c] = MOST_BLOCK * (high[c] - low[c]) end
  for _, pose in ipairs(film.poses) do
    for _, p in ipairs(pose.block) do
      local at = from_middle(pose, p)
      for c = 1, 2 do at[c] = math.min(math.max(at[c], low[c] - most[c]), high[c] + most[c]) end
      take(at)
      if at[3] > high[3] + most[1] then break end
    end
  end
  return low, high
end

--- A frame that holds every pose, `width` px for all panels together.
---@param film limax.motion.film
---@param view limax.picture.view
---@param width integer
---@param count integer panels side by side
---@param options? { gap: number|nil, foot: number|nil, head: number|nil } px between them; capitals
--- below them, for the times, and above what is drawn in them, for the scale bar; flows get more
---@return limax.picture.frame
function scene.frame(film, view, width, count, options)
  options = options or {}
  local gap, foot, flow_room = options.gap or 0, options.foot or FOOT, flow.room(film.stage, view)
  local head = (options.head or HEAD) + flow_room
  local left, right, bottom, top = math.huge, -math.huge, math.huge, -math.huge
  local function hold(p)
    local x, y = view.project(p)
    left, right, bottom, top = math.min(left, x), math.max(right, x), math.min(bottom, y),
      math.max(top, y)
  end
  local low, high = reach_of(film)
  for _, pose in ipairs(film.poses) do
    for _, p in ipairs(pose.points) do hold(from_middle(pose, p)) end
  end
  local obstacles = world.has_obstacles(film.world)
  local slab = { low = {}, high = {} }
  for c = 1, 2 do
    local room = (obstacles and ROOM_FOR_OBSTACLES or ROOM)[c] * (high[c] - low[c]) + 0.02
    slab.low[c], slab.high[c] = low[c] - room, high[c] + room
  end
  local tall = high[3] - low[3] + slab.high[1] - slab.low[1]
  slab.low[3], slab.high[3] = low[3] - tall, high[3] + tall
  if obstacles or film.stage.ground then
    local pose = film.poses[1]
    for _, along in ipairs { slab.low[1], slab.high[1] } do
      for _, away in ipairs { slab.low[2], slab.high[2] } do
        local height = stage.ground_height(film.stage, pose.middle[1] + along,
          pose.middle[2] + away)
        hold { along, away, height and height - pose.base or low[3] }
      end
    end
  end
  for _, pose in ipairs(film.poses) do
    for _, p in ipairs(pose.block) do
      local at = from_middle(pose, p)
      for c = 1, 2 do at[c] = math.min(math.max(at[c], slab.low[c]), slab.high[c]) end
      at[3] = math.min(at[3], high[3])
      hold(at)
    end
  end
  local panel = math.floor((width - (count - 1) * gap) / count)
  local text = math.max(7, math.floor(panel / 32))
  local room = 0.03 * (right - left)
  local scale = panel / (right - left + 2 * room)
  return { view = view, scale = scale, panel = panel, count = count, gap = gap, left = 0, top = 0,
    text = text, slab = slab, foot = foot, head = head, flow_room = flow_room,
    height = math.ceil((top - bottom + 2 * room) * scale + (foot + head) * text),
    low = { (left + right) / 2, bottom - room } }
end

--- Another scale and text for a frame; its height follows.
---@param frame limax.picture.frame
---@param scale number px/m
---@param text number px
function scene.rescale(frame, scale, text)
  local rest = frame.foot + frame.head
  frame.height = math.ceil((frame.height - rest * frame.text) / frame.scale * scale + rest * text)
  frame.scale, frame.text = scale, text
end

-- ---- one pose -----------------------------------------------------------------------------------

-- Lines across the way on a flat piece: one every 0.1 m and a darker one every 0.5 m make the way
-- visible.
local function draw_rules(canvas, piece, place)
  local least, most = math.huge, -math.huge
  for _, p in ipairs(piece.points) do
    least, most = math.min(least, p[1]), math.max(most, p[1])
  end
  for k = math.ceil(least * 10), math.floor(most * 10) do
    local from, to = polygon.crossing(piece, { 1, 0, 0 }, k / 10)
    if from and to then
      local strong = k % 5 == 0
      canvas:line(place(from), place(to), strong and ink.strong or ink.fine, strong and 1.2 or 0.8)
    end
  end
end

local function draw_ground(canvas, film, slab, place)
  local function at(along, away)
    return { along, away, stage.ground_height(film.stage, along, away) }
  end
  local sheet = { points = { at(slab.low[1], slab.low[2]), at(slab.high[1], slab.low[2]),
    at(slab.high[1], slab.high[2]), at(slab.low[1], slab.high[2]) },
    edges = { true, true, true, true } }
  local corners = {}
  for k, p in ipairs(sheet.points) do corners[k] = place(p) end
  canvas:polygon(corners, ink.ground)
  draw_rules(canvas, sheet, place)
  canvas:line(corners[1], corners[2], ink.line, 1.2)
end

-- It falls straight down.
local function draw_shadow(canvas, film, points, place)
  local shadow = {}
  for k, p in ipairs(points) do
    shadow[k] = place { p[1], p[2], stage.ground_height(film.stage, p[1], p[2]) }
  end
  canvas:polygon(skin.outline(shadow), "#000000", 0.13)
end

-- The path up to a pose, where the body was in space.
local function draw_trail(canvas, film, pose, place, frame)
  local points = {}
  for s = 1, pose.sample do points[s] = place(film.path[s]) end
  canvas:path(points, ink.trail, math.max(1.2, frame.panel / 300))
  canvas:dot(points[#points], math.max(2.5, frame.panel / 130), ink.trail)
end

-- Everything that hides and is hidden.
local function draw_solids(canvas, film, pose, slab, place, frame)
  local sight, thin = frame.view.sight, math.max(0.5, frame.panel / 600)
  local block = #pose.block > 0 and block_picture.spaces(pose.block) or nil
  local pieces = stage.pieces(film.stage, slab, sight, block, block_picture.hex)
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
  local sorted = order.new(pieces, sight)
  for _, face in ipairs(skin.visible(film.faces, pose.points, film.colors, sight,
    film.held)) do
    sorted:add(face)
  end
  sorted:each(paint)
  for _, sheet in ipairs(pieces.before) do paint(sheet, VEIL) end
end

--- Draws one pose as panel `k` from the left.
---@param canvas limax.picture.pixels|limax.picture.vectors
---@param film limax.motion.film
---@param frame limax.picture.frame
---@param pose limax.motion.pose
---@param k integer
function scene.draw(canvas, film, frame, pose, k)
  local view, left, top = frame.view, scene.left(frame, k), frame.top
  local bottom = top + frame.height - math.max(0, frame.foot - 1) * frame.text
  local function place(p)
    local x, y = view.project(from_middle(pose, p))
    return { left + frame.panel / 2 + (x - frame.low[1]) * frame.scale,
      bottom - (y - frame.low[2]) * frame.scale }
  end
  local slab = { low = {}, high = {} }
  for c, middle in ipairs { pose.middle[1], pose.middle[2], pose.base } do
    slab.low[c], slab.high[c] = frame.slab.low[c] + middle, frame.slab.high[c] + middle
  end
  canvas:clip(left, top, left + frame.panel, bottom)
  if film.stage.ground then
    draw_ground(canvas, film, slab, place)
    if view.shadow then
      draw_shadow(canvas, film, pose.points, place)
      if #pose.block > 0 then draw_shadow(canvas, film, pose.block, place) end
    end
  end
  draw_solids(canvas, film, pose, slab, place, frame)
  draw_trail(canvas, film, pose, place, frame)
end

--- px, where panel `k` begins.
---@param frame limax.picture.frame
---@param k integer
---@return number
function scene.left(frame, k) return frame.left + (k - 1) * (frame.panel + frame.gap) end

--- The time of a pose below it.
---@param canvas limax.picture.pixels|limax.picture.vectors
---@param frame limax.picture.frame
---@param pose limax.motion.pose
---@param k integer
function scene.caption(canvas, frame, pose, k)
  local start = scene.left(frame, k)
  canvas:clip(start, frame.top, start + frame.panel, frame.top + frame.height)
  canvas:text(start + frame.panel / 2, frame.top + frame.height - 0.6 * frame.text,
    ("%.2f s"):format(pose.time), frame.text, ink.text, "middle")
end

--- Arrows for wind and current, with their speeds, above what is drawn: none where nothing flows.
---@param canvas limax.picture.pixels|limax.picture.vectors
---@param film limax.motion.film
---@param frame limax.picture.frame
function scene.flows(canvas, film, frame)
  if #film.stage.flows == 0 then return end
  local right = frame.left + frame.count * (frame.panel + frame.gap)
  canvas:clip(frame.left, frame.top, right, frame.top + frame.height)
  flow.draw(canvas, film.stage, frame, frame.top + (frame.head - frame.flow_room) * frame.text)
end

--- A bar of a round length in the upper left corner. In `iso` it is true along every axis.
---@param canvas limax.picture.pixels|limax.picture.vectors
---@param frame limax.picture.frame
---@param place? number[] px, its left end; the upper left corner if left out
function scene.scale_bar(canvas, frame, place)
  local short = frame.view.short
  local length = motion.round_length(frame.panel / 3 / frame.scale / short)
  local x, y = unpack(place or { frame.text, 1.4 * frame.text })
  local wide = length * frame.scale * short
  if not place then canvas:clip(0, 0, frame.panel, frame.height) end
  canvas:line({ x, y }, { x + wide, y }, ink.text, 1.6)
  for _, at in ipairs { x, x + wide } do
    canvas:line({ at, y - frame.text / 2 }, { at, y + frame.text / 2 }, ink.text, 1.6)
  end
  canvas:text(x + wide + frame.text, y + frame.text / 2, ("%g m"):format(length), frame.text,
    ink.text)
end

return scene
