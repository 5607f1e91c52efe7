--- track.lua: the whole path of a robot from the side, true to scale: the world, outlines of its
--- poses, and the path of its centre of mass.

local block_picture = require "limax.draw.block_picture"
local canvases = require "limax.draw.canvas"
local motion = require "limax.draw.motion"
local polygon = require "limax.draw.picture.polygon"
local scene = require "limax.draw.picture.scene"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local track = {}

local GHOST, LINE = "#7d8b99", "#6b655b"
-- px: most of its height, and room below for the ruler
local MOST, RULER = 176, 22
-- px between the ruler's numbers, about
local STEP = 90
-- patches of terrain along the path
local PATCHES = 30

-- The least and most that points reach along, away and up.
local function span_of(film)
  local low, high, add = polygon.bounds(3)
  for _, pose in ipairs(film.poses) do
    for _, p in ipairs(pose.points) do add(p) end
    for _, block in ipairs(pose.blocks) do
      for _, p in ipairs(block) do add(p) end
    end
  end
  for _, p in ipairs(film.path) do add(p) end
  return low, high
end

--- The extent of a track: as wide as there is room, at a scale of at most `scale` px/m, so that a
--- short path is a short figure.
---@param room number px, its width
---@param scale number px/m
---@return { low: number[], high: number[], scale: number, height: integer } m; px/m; px
function track.layout(film, room, scale)
  local low, high = span_of(film)
  local margin = (world.has_obstacles(film.world) and 0.1 or 0.04) * (high[1] - low[1])
  low[1], high[1] = low[1] - margin, high[1] + margin
  for _, along in ipairs { low[1], high[1] } do
    local height = stage.ground_height(film.stage, along, (low[2] + high[2]) / 2)
    if height then low[3], high[3] = math.min(low[3], height), math.max(high[3], height) end
  end
  scale = math.min(room / (high[1] - low[1]), MOST / (high[3] - low[3]), scale)
  return { low = low, high = high, scale = scale, patches = PATCHES,
    height = math.ceil((high[3] - low[3]) * scale) + RULER }
end

-- The corners of a moving box or sphere at a time.
local function corners_at(film, shape, time)
  local corners = {}
  for _, side in ipairs(stage.sides(film.stage, world.moved(shape, time))) do
    for _, p in ipairs(side.points) do corners[#corners + 1] = p end
  end
  return corners
end

-- The ground and numbers along it, in metres from the start.
local function draw_ruler(canvas, film, layout, place, size)
  local middle = (layout.low[2] + layout.high[2]) / 2
  local function at(along)
    return place { along, middle, stage.ground_height(film.stage, along, middle) }
  end
  canvas:line(at(layout.low[1]), at(layout.high[1]), LINE, 1.2)
  local step = motion.round_length(STEP / layout.scale)
  local first, last = (layout.low[1] - film.start) / step, (layout.high[1] - film.start) / step
  for k = math.ceil(first), math.floor(last) do
    local mark = at(film.start + k * step)
    canvas:line(mark, { mark[1], mark[2] + 4 }, LINE, 1)
    -- + 0: no "-0 m"
    canvas:text(mark[1], mark[2] + 5 + size, ("%g m"):format(k * step + 0),
      { size = size, anchor = "middle", fill = canvases.faint })
  end
end

--- Draws a track around the middle of the page.
---@param layout table from track.layout
---@param top number px
---@param size number px of texts
function track.draw(canvas, film, layout, top, size)
  local along, away = (layout.low[1] + layout.high[1]) / 2, (layout.low[2] + layout.high[2]) / 2
  local function place(p)
    local x, y = view.of.profile.project { p[1] - along, p[2] - away, p[3] - layout.low[3] }
    return { canvas.width / 2 + x * layout.scale, top + layout.height - RULER - y * layout.scale }
  end
  local function ghost(corners, k, color)
    local points = {}
    for m, p in ipairs(corners) do points[m] = place(p) end
    canvas:polygon(skin.outline(points), { fill = color, fill_opacity = 0.06 + 0.035 * k,
      stroke = color, width = 0.8 })
  end
  if world.has_obstacles(film.world) then
    local half = (layout.high[1] - layout.low[1]) / 2 * layout.scale
    canvas:clip(canvas.width / 2 - half, top - 1, canvas.width / 2 + half,
      top + layout.height - RULER + 1)
    scene.draw_solids(canvas, film, layout, view.of.profile, place, 0.5)
    for k, pose in ipairs(film.poses) do
      for _, shape in ipairs(film.stage.moving) do
        ghost(corners_at(film, shape, pose.time), k, world.hex)
      end
    end
    canvas:clip()
  end
  if film.stage.ground then draw_ruler(canvas, film, layout, place, size) end
  for k, pose in ipairs(film.poses) do
    for _, block in ipairs(pose.blocks) do ghost(block, k, block_picture.hex) end
    ghost(pose.points, k, GHOST)
  end
  local trail = {}
  for s, p in ipairs(film.path) do trail[s] = place(p) end
  canvas:path(trail, { stroke = scene.trail, width = 1.3 })
  for _, pose in ipairs(film.poses) do
    canvas:circle(trail[pose.sample], 2.6, { fill = scene.trail, stroke = "#ffffff", width = 0.9 })
  end
end

return track
