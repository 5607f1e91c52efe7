--- scene.lua: poses side by side on a canvas (pixels.lua or vectors.lua): the body with its ground,
--- shadow and trail, the time of each, and one scale bar.

local motion = require "limax.motion"
local skin = require "limax.skin"

local scene = {}

local ink = { text = "#2b2b2b", ground = "#efece6", fine = "#dcd7cc", strong = "#b9b2a4",
  line = "#6b655b", trail = "#c0392b", edge = "#ffffff" }

---@class limax.picture.frame what all panels share
---@field view limax.picture.view
---@field scale number px/m
---@field panel integer px, width of one
---@field height integer px
---@field text number px, height of a capital
---@field low number[] right and up, m, of the lowest corner seen from a pose's middle
---@field top number|nil px, where its panels begin; 0 if absent
---@field ground number[]|nil least and most of along and away around the middle, m

-- A point seen from a pose's middle; its height counts from the ground where there is one.
local function from_middle(film, pose, p)
  return { p[1] - pose.middle[1], p[2] - pose.middle[2],
    p[3] - (film.ground or pose.middle[3]) }
end

--- A frame that holds every pose, `width` px for all panels together.
---@param film limax.motion.film
---@param view limax.picture.view
---@param width integer
---@param count integer panels side by side
---@return limax.picture.frame
function scene.frame(film, view, width, count)
  local left, right, low, high = math.huge, -math.huge, math.huge, -math.huge
  local reach = { math.huge, -math.huge, math.huge, -math.huge }
  for _, pose in ipairs(film.poses) do
    for _, p in ipairs((motion.skin(film, pose))) do
      local at = from_middle(film, pose, p)
      local x, y = view.project(at)
      left, right, low, high = math.min(left, x), math.max(right, x), math.min(low, y),
        math.max(high, y)
      reach = { math.min(reach[1], at[1]), math.max(reach[2], at[1]), math.min(reach[3], at[2]),
        math.max(reach[4], at[2]) }
    end
  end
  local ground
  if film.ground then
    local room = 0.06 * (reach[2] - reach[1]) + 0.02
    ground = { reach[1] - room, reach[2] + room, reach[3] - room, reach[4] + room }
    for _, along in ipairs { ground[1], ground[2] } do
      for _, away in ipairs { ground[3], ground[4] } do
        local x, y = view.project { along, away, 0 }
        left, right, low, high = math.min(left, x), math.max(right, x), math.min(low, y),
          math.max(high, y)
      end
    end
  end
  local panel = math.floor(width / count)
  local text = math.max(7, math.floor(panel / 32))
  local room = 0.03 * (right - left)
  local scale = panel / (right - left + 2 * room)
  return { view = view, scale = scale, panel = panel, text = text, ground = ground,
    height = math.ceil((high - low + 2 * room) * scale + 3.2 * text),
    low = { (left + right) / 2, low - room } }
end

--- Another scale and text for a frame; its height follows.
---@param frame limax.picture.frame
---@param scale number px/m
---@param text number px
function scene.rescale(frame, scale, text)
  frame.height = math.ceil((frame.height - 3.2 * frame.text) / frame.scale * scale + 3.2 * text)
  frame.scale, frame.text = scale, text
end

-- The ground as a sheet with a line across the way every 0.1 m and a darker one every 0.5 m: they
-- make the way visible.
local function draw_ground(canvas, frame, film, pose, place)
  local g, middle = frame.ground, pose.middle
  local function at(along, away)
    return place { middle[1] + along, middle[2] + away, film.ground }
  end
  canvas:polygon({ at(g[1], g[3]), at(g[2], g[3]), at(g[2], g[4]), at(g[1], g[4]) }, ink.ground)
  for k = math.ceil((middle[1] + g[1]) * 10), math.floor((middle[1] + g[2]) * 10) do
    local strong = k % 5 == 0
    canvas:line(at(k / 10 - middle[1], g[3]), at(k / 10 - middle[1], g[4]),
      strong and ink.strong or ink.fine, strong and 1.2 or 0.8)
  end
  canvas:line(at(g[1], g[3]), at(g[2], g[3]), ink.line, 1.2)
end

local function draw_shadow(canvas, film, points, place)
  local shadow = {}
  for k, p in ipairs(points) do shadow[k] = place { p[1], p[2], film.ground } end
  canvas:polygon(skin.outline(shadow), "#000000", 0.13)
end

-- The path up to a pose, where the body was in space.
local function draw_trail(canvas, film, pose, place, frame)
  local before
  for s = 1, pose.sample do
    local at = place(film.path[s])
    if before then canvas:line(before, at, ink.trail, math.max(1.2, frame.panel / 300)) end
    before = at
  end
  canvas:dot(before, math.max(2.5, frame.panel / 130), ink.trail)
end

--- Draws one pose as panel `k` from the left.
---@param canvas limax.picture.pixels|limax.picture.vectors
---@param film limax.motion.film
---@param frame limax.picture.frame
---@param pose limax.motion.pose
---@param k integer
function scene.draw(canvas, film, frame, pose, k)
  local view, left = frame.view, (k - 1) * frame.panel
  local top = frame.top or 0
  local bottom = top + frame.height - 2.2 * frame.text
  local function place(p)
    local x, y = view.project(from_middle(film, pose, p))
    return { left + frame.panel / 2 + (x - frame.low[1]) * frame.scale,
      bottom - (y - frame.low[2]) * frame.scale }
  end
  canvas:clip(left, top, left + frame.panel, top + frame.height)
  if frame.ground then
    draw_ground(canvas, frame, film, pose, place)
    if view.shadow then
      draw_shadow(canvas, film, pose.points, place)
      if #pose.block > 0 then draw_shadow(canvas, film, pose.block, place) end
    end
  end
  local points, faces = motion.skin(film, pose)
  local function project(p)
    local at = place(p)
    return at[1], at[2]
  end
  local thin = math.max(0.5, frame.panel / 600)
  for _, face in ipairs(skin.visible(faces, points, film.colors, project, view.sight)) do
    canvas:polygon(face.points, face.fill)
    for c = 1, 4 do
      canvas:line(face.points[c], face.points[c % 4 + 1], ink.edge, thin, 0.5)
    end
  end
  draw_trail(canvas, film, pose, place, frame)
  canvas:text(left + frame.panel / 2, top + frame.height - 0.6 * frame.text,
    ("%.2f s"):format(pose.time), frame.text, ink.text, "middle")
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
