--- film_strip.lua: a robot's walk as one self-contained SVG: six poses from the side, and below
--- them the whole way with the path of the centre of mass. No browser and no display. Points are
--- { along the way, away from the eye, up } in metres before they meet the page.

local block_picture = require "limax.draw.block_picture"
local engine = require "limax.engine"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local scene = require "limax.draw.picture.scene"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local svg = require "limax.draw.svg"
local vectors = require "limax.draw.picture.vectors"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local film_strip = {}

local POSES = 6
-- capitals of a panel's text above a body, for the scale bar
local HEAD = 3

-- The page, px: 11 px are 8.25 pt.
local page = { width = 1000, margin = 24, text = 11, gap = 8, head = 50, strip = 190, below = 40,
  track = 176, ruler = 22, foot = 44, line = 16 }
-- px, about the width of a letter
local LETTER = 6.4
local ink = { text = "#2b2b2b", faint = "#767676", line = "#6b655b", trail = "#c0392b",
  frame = "#fbfaf8", ghost = "#7d8b99" }

-- Six moments from t = 0 to the end, s.
local function evenly(duration)
  local times = {}
  for k = 1, POSES do times[k] = (k - 1) / (POSES - 1) * duration end
  return times
end

-- ---- drawing ------------------------------------------------------------------------------------

-- What all panels share; as wide as the page, or as high as a strip may be.
local function frame_of(film)
  local frame = scene.frame(film, view.of.side, page.width - 2 * page.margin, POSES,
    { gap = page.gap, foot = 0, head = HEAD })
  local rest = frame.head * frame.text
  if frame.height > page.strip then
    scene.rescale(frame, frame.scale * (page.strip - rest) / (frame.height - rest), frame.text)
  end
  frame.left, frame.top = page.margin, page.head
  return frame
end

local function draw_panel(out, canvas, k, pose, film, frame)
  local left = scene.left(frame, k)
  out:add('<rect x="%.1f" y="%d" width="%.1f" height="%d" fill="%s"/>', left, page.head,
    frame.panel, frame.height, ink.frame)
  scene.draw(canvas, film, frame, pose, k)
  canvas:close()
  local below, center = page.head + frame.height, left + frame.panel / 2
  out:text(center, below + 15, ("%.2f s"):format(pose.time),
    'text-anchor="middle" font-weight="bold"')
  out:text(center, below + 29, ("%+.2f m"):format(pose.middle[1] - film.start),
    ('text-anchor="middle" fill="%s"'):format(ink.faint))
end

local function draw_scale_bar(out, x, y, scale, room)
  local length = motion.round_length(room / scale)
  local stop = x + length * scale
  out:line({ x, y }, { stop, y }, ink.text, 1.6)
  out:line({ x, y - 4 }, { x, y + 4 }, ink.text, 1.2)
  out:line({ stop, y - 4 }, { stop, y + 4 }, ink.text, 1.2)
  out:text(stop + 7, y + 4, ("%g m"):format(length))
end

-- Numbers along the way, in metres from the start, about every 90 px: along the ground, or below.
local function draw_ruler(out, film, way, place)
  local step = motion.round_length(90 / way.scale)
  local first, last = (way.left - film.start) / step, (way.right - film.start) / step
  for k = math.ceil(first), math.floor(last) do
    local at = place(film.start + k * step, way.low)
    out:line(at, { at[1], at[2] + 4 }, ink.line, 1)
    -- + 0: no "-0 m"
    out:text(at[1], at[2] + 16, ("%g m"):format(k * step + 0),
      ('text-anchor="middle" fill="%s"'):format(ink.faint))
  end
end

-- The least and most that points reach along, away and up.
local function span_of(film)
  local low, high = { math.huge, math.huge, math.huge }, { -math.huge, -math.huge, -math.huge }
  local function reach(points)
    for _, p in ipairs(points) do
      for c = 1, 3 do low[c], high[c] = math.min(low[c], p[c]), math.max(high[c], p[c]) end
    end
  end
  for _, pose in ipairs(film.poses) do
    reach(pose.points)
    reach(pose.block)
  end
  reach(film.path)
  return low, high
end

-- What the track shows, in metres, and its scale (px/m): as wide as the page, but no larger than
-- `most`, so that a short way is a short figure in the middle.
local function way_of(film, most)
  local low, high = span_of(film)
  local margin = (world.has_obstacles(film.world) and 0.1 or 0.04) * (high[1] - low[1])
  local left, right = low[1] - margin, high[1] + margin
  local middle = (low[2] + high[2]) / 2
  for _, along in ipairs { left, right } do
    local height = stage.ground_height(film.stage, along, middle)
    if height then low[3], high[3] = math.min(low[3], height), math.max(high[3], height) end
  end
  local room = page.width - 2 * page.margin
  local scale = math.min(room / (right - left), page.track / (high[3] - low[3]), most)
  return { left = left, right = right, low = low[3], high = high[3], near = low[2], far = high[2],
    scale = scale, height = math.ceil((high[3] - low[3]) * scale) + page.ruler }
end

-- The world that the way leads through, seen from beside.
local function draw_profile(out, film, way, place)
  local slab = { low = { way.left, way.near, way.low }, high = { way.right, way.far, way.high } }
  local canvas = vectors.over(out, "track")
  if world.has_obstacles(film.world) then
    local from, to = place(way.left, way.high), place(way.right, way.low)
    canvas:clip(from[1], from[2] - 1, to[1], to[2] + 1)
  end
  for _, piece in ipairs(stage.profile(film.stage, slab)) do
    local points = {}
    for k, p in ipairs(piece) do points[k] = place(p[1], p[3]) end
    if piece.open then
      canvas:path(points, ink.line, 1.2)
    else
      out:polygon(skin.outline(points), ('fill="%s" stroke="%s" stroke-width="0.8"'):format(
        world.hex, world.ink))
    end
  end
  canvas:close()
end

-- The whole way, true to scale: outlines of the six poses, and the path through them.
local function draw_track(out, film, way, top)
  local middle = (way.left + way.right) / 2
  local function place(along, up)
    return { page.width / 2 + (along - middle) * way.scale,
      top + way.height - page.ruler - (up - way.low) * way.scale }
  end
  draw_profile(out, film, way, place)
  if film.stage.ground then
    draw_ruler(out, film, way, place)
  else
    draw_scale_bar(out, page.margin + 8, top + 14, way.scale, 110)
  end
  local function ghost(corners, k, color)
    local points = {}
    for m, p in ipairs(corners) do points[m] = place(p[1], p[3]) end
    local style = 'fill="%s" fill-opacity="%.2f" stroke="%s" stroke-width="0.8"'
    out:polygon(skin.outline(points), style:format(color, 0.06 + 0.035 * k, color))
  end
  for k, pose in ipairs(film.poses) do
    if #pose.block > 0 then ghost(pose.block, k, block_picture.hex) end
    ghost(pose.points, k, ink.ghost)
  end
  local trail = {}
  for s, p in ipairs(film.path) do trail[s] = place(p[1], p[3]) end
  out:path(trail, ink.trail, 1.3)
  for _, pose in ipairs(film.poses) do out:dot(trail[pose.sample], 2.6, ink.trail) end
end

local function draw_legend(out, film, y)
  local x = page.margin
  local function entry(hex, name)
    out:add('<rect x="%.1f" y="%.1f" width="12" height="12" rx="2" fill="%s"/>', x, y - 10, hex)
    out:text(x + 17, y, name)
    x = x + 17 + LETTER * #name + 18
  end
  for _, material in ipairs(film.materials) do
    if film.used[material.letter] then entry(film.colors[material.letter].hex, material.name) end
  end
  if #film.poses[1].block > 0 then entry(block_picture.hex, block_picture.letter) end
  if world.has_solids(film.world) then entry(world.hex, world.word) end
  local function line(color, width, name)
    out:line({ x, y - 4 }, { x + 20, y - 4 }, color, width)
    out:text(x + 26, y, name)
    x = x + 26 + LETTER * #name + 18
  end
  line(ink.trail, 1.6, "centre of mass")
  if next(film.held) then line(scene.held, 2.4, "held") end
  local words = world.words(film.world)
  if film.note then words = words == "" and film.note or words .. "; " .. film.note end
  -- below the colours where they leave no room beside them
  if x + LETTER * #words > page.width - page.margin then y = y + page.line end
  out:text(page.width - page.margin, y, words, ('text-anchor="end" fill="%s"'):format(ink.faint))
end

-- ---- the figure ---------------------------------------------------------------------------------

--- The SVG text of a simulated robot whose "position" was recorded.
---@param robot limax.scored_robot
---@param options? { title?: string }
---@return string
function film_strip.svg(robot, options)
  local film = motion.of(robot, evenly(robot:duration()))
  local frame = frame_of(film)
  local track = page.head + frame.height + page.below
  local way = way_of(film, 2 * frame.scale)
  local foot = track + way.height
  local title = options and options.title or "robot"
  local out = svg.page(page.width, foot + page.foot, title, page.text, ink.text,
    { description = world.words(film.world) })
  out:text(page.margin, 30, title, 'font-size="16" font-weight="bold"')
  local speed = robot:speed()
  local said = ("%.3f m in %.4g s: %.3f m/s, %.2f body lengths per second"):format(robot:distance(),
    robot:duration(), speed, speed / robot:length())
  out:text(page.width - page.margin, 30, said, 'text-anchor="end" font-size="12"')
  local canvas = vectors.over(out, "panel")
  for k, pose in ipairs(film.poses) do draw_panel(out, canvas, k, pose, film, frame) end
  scene.flows(canvas, film, frame)
  canvas:close()
  draw_scale_bar(out, page.margin + 8, page.head + 14, frame.scale, frame.panel / 3)
  draw_track(out, film, way, track)
  draw_legend(out, film, foot + 22)
  return out:finish()
end

--- Simulates a robot with its positions recorded and writes the figure. `nil, message` where the
--- robot comes to no good end: there is nothing to draw.
---@param path string
---@param robot limax.robot
---@param options? limax.motion.options
---@return limax.scored_robot|nil
---@return string|nil message
function film_strip.write(path, robot, options)
  local walked, reason = motion.simulate(robot, options)
  if not walked then return nil, reason end
  local ok, message = host.file.write_atomic(path, film_strip.svg(walked, options))
  if not ok then engine.fail(message) end
  return walked
end

return film_strip
