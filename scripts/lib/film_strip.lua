--- film_strip.lua: a robot's walk as one self-contained SVG: six poses from the side, and below
--- them the whole way with the path of the centre of mass. No browser and no display. Points are
--- { along the way, away from the eye, up } in metres before they meet the page.

local block_picture = require "limax.block_picture"
local engine = require "limax.engine"
local host = require "limax.host"
local motion = require "limax.motion"
local skin = require "limax.skin"
local svg = require "limax.svg"

local film_strip = {}

local POSES = 6

-- The page, px: 11 px are 8.25 pt.
local page = { width = 1000, margin = 24, text = 11, gap = 8, head = 50, strip = 190, below = 40,
  track = 176, ruler = 22, foot = 44 }
local ink = { text = "#2b2b2b", faint = "#8a8a8a", ground = "#efece6", line = "#6b655b",
  trail = "#c0392b", frame = "#fbfaf8", ghost = "#7d8b99" }

-- Six moments from t = 0 to the end, s.
local function evenly(duration)
  local times = {}
  for k = 1, POSES do times[k] = (k - 1) / (POSES - 1) * duration end
  return times
end

-- ---- drawing ------------------------------------------------------------------------------------

-- What all panels share: the scale (px/m), and how far the body reaches from its middle (m).
local function frame_of(poses, ground)
  local reach, low, high, near, far = 0, math.huge, -math.huge, 0, 0
  for _, pose in ipairs(poses) do
    local base = ground and 0 or pose.middle[3]
    for _, p in ipairs(pose.points) do
      local away = p[2] - pose.middle[2]
      local up = p[3] + skin.recede_y * away - base
      reach = math.max(reach, math.abs(p[1] - pose.middle[1] + skin.recede_x * away))
      low, high = math.min(low, up), math.max(high, up)
      near, far = math.min(near, away), math.max(far, away)
    end
  end
  if ground then low = math.min(low, ground + skin.recede_y * near) end
  local wide, tall = 1.15 * 2 * reach, 1.08 * (high - low)
  local panel = (page.width - 2 * page.margin - (POSES - 1) * page.gap) / POSES
  local scale = math.min(panel / wide, (page.strip - 12) / tall)
  return { scale = scale, panel = panel, strip = math.ceil(tall * scale + 12), low = low,
    near = near, far = far }
end

-- A panel's own coordinates: the pose's middle stands in the panel's middle, its feet at the
-- bottom.
local function panel_of(k, pose, film, frame)
  local left = page.margin + (k - 1) * (frame.panel + page.gap)
  local bottom = page.head + frame.strip - 6
  local base = film.ground and 0 or pose.middle[3]
  local panel = { left = left, right = left + frame.panel, center = left + frame.panel / 2 }
  function panel.point(along, away, up)
    return { panel.center + (along - pose.middle[1] + skin.recede_x * away) * frame.scale,
      bottom - (up - base + skin.recede_y * away - frame.low) * frame.scale }
  end
  function panel.project(p)
    local point = panel.point(p[1], p[2] - pose.middle[2], p[3])
    return point[1], point[2]
  end
  return panel
end

-- The ground as a band, with a line across it every 0.1 m and a darker one every 0.5 m: they make
-- the way visible. The body's shadow falls straight down.
local function draw_ground(out, panel, pose, film, frame)
  local near, far, middle = frame.near - 0.04, frame.far + 0.06, pose.middle[1]
  local low, high = panel.point(middle, near, film.ground), panel.point(middle, far, film.ground)
  out:add('<rect x="%.1f" y="%.1f" width="%.1f" height="%.1f" fill="%s"/>', panel.left, high[2],
    frame.panel, low[2] - high[2], ink.ground)
  local half = frame.panel / frame.scale / 2 + skin.recede_x * math.max(far, -near)
  for k = math.ceil((middle - half) * 10), math.floor((middle + half) * 10) do
    local strong = k % 5 == 0
    out:line(panel.point(k / 10, near, film.ground), panel.point(k / 10, far, film.ground),
      strong and "#b9b2a4" or "#dcd7cc", strong and 1 or 0.7)
  end
  out:line({ panel.left, low[2] }, { panel.right, low[2] }, ink.line, 1.2)
  local function drop_shadow(points)
    local shadow = {}
    for k, p in ipairs(points) do
      shadow[k] = panel.point(p[1], p[2] - pose.middle[2], film.ground)
    end
    out:polygon(skin.outline(shadow), 'fill="#000000" fill-opacity="0.13"')
  end
  if #pose.block > 0 then drop_shadow(pose.block) end
  drop_shadow(pose.points)
end

local function draw_panel(out, k, pose, film, frame)
  local panel = panel_of(k, pose, film, frame)
  local box = ('x="%.1f" y="%d" width="%.1f" height="%d"')
    :format(panel.left, page.head, frame.panel, frame.strip)
  out:add('<clipPath id="panel%d"><rect %s/></clipPath>', k, box)
  out:add('<g clip-path="url(#panel%d)"><rect %s fill="%s"/>', k, box, ink.frame)
  if film.ground then draw_ground(out, panel, pose, film, frame) end
  out:add '<g stroke="#ffffff" stroke-opacity="0.55" stroke-width="0.6" stroke-linejoin="round">'
  local points, faces = motion.skin(film, pose)
  for _, face in ipairs(skin.visible(faces, points, film.colors, panel.project)) do
    out:polygon(face.points, ('fill="%s"'):format(face.fill))
  end
  out:add "</g>"
  -- the path so far, as it lies in the plane through the body's middle
  local trail, last = {}, film.path[pose.sample]
  for s = 1, pose.sample do
    local p = film.path[s]
    trail[s] = panel.point(pose.middle[1] + p[1] - last[1], 0, p[3])
  end
  out:path(trail, "#ffffff", 2.6, 0.7)
  out:path(trail, ink.trail, 1.3)
  out:dot(trail[#trail], 3, ink.trail)
  out:add "</g>"
  local below = page.head + frame.strip
  out:text(panel.center, below + 15, ("%.2f s"):format(pose.time),
    'text-anchor="middle" font-weight="bold"')
  out:text(panel.center, below + 29, ("%+.2f m"):format(pose.middle[1] - film.start),
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

-- The ground line of the whole way, in metres from the start, a number about every 90 px.
local function draw_ruler(out, film, way, place)
  local step = motion.round_length(90 / way.scale)
  out:line(place(way.left, film.ground), place(way.right, film.ground), ink.line, 1.2)
  local first, last = (way.left - film.start) / step, (way.right - film.start) / step
  for k = math.ceil(first), math.floor(last) do
    local at = place(film.start + k * step, film.ground)
    out:line(at, { at[1], at[2] + 4 }, ink.line, 1)
    -- + 0: no "-0 m"
    out:text(at[1], at[2] + 16, ("%g m"):format(k * step + 0),
      ('text-anchor="middle" fill="%s"'):format(ink.faint))
  end
end

-- What the track shows, in metres, and its scale (px/m): as wide as the page, but no larger than
-- `most`, so that a short way is a short figure in the middle.
local function way_of(film, most)
  local left, right, low, high = math.huge, -math.huge, film.ground or math.huge, -math.huge
  local function reach(points)
    for _, p in ipairs(points) do
      left, right = math.min(left, p[1]), math.max(right, p[1])
      low, high = math.min(low, p[3]), math.max(high, p[3])
    end
  end
  for _, pose in ipairs(film.poses) do
    reach(pose.points)
    reach(pose.block)
  end
  reach(film.path)
  local margin = 0.04 * (right - left)
  left, right = left - margin, right + margin
  local room = page.width - 2 * page.margin
  local scale = math.min(room / (right - left), page.track / (high - low), most)
  return { left = left, right = right, low = low, scale = scale,
    height = math.ceil((high - low) * scale) + page.ruler }
end

-- The whole way, true to scale: outlines of the six poses, and the path through them.
local function draw_track(out, film, way, top)
  local middle = (way.left + way.right) / 2
  local function place(along, up)
    return { page.width / 2 + (along - middle) * way.scale,
      top + way.height - page.ruler - (up - way.low) * way.scale }
  end
  if film.ground then
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
  for _, material in ipairs(film.materials) do
    if film.used[material.letter] then
      out:add('<rect x="%.1f" y="%.1f" width="12" height="12" rx="2" fill="%s"/>', x, y - 10,
        film.colors[material.letter].hex)
      out:text(x + 17, y, material.name)
      -- a letter is about 6.4 px wide
      x = x + 17 + 6.4 * #material.name + 18
    end
  end
  if #film.poses[1].block > 0 then
    out:add('<rect x="%.1f" y="%.1f" width="12" height="12" rx="2" fill="%s"/>', x, y - 10,
      block_picture.hex)
    out:text(x + 17, y, block_picture.letter)
    x = x + 17 + 6.4 * #block_picture.letter + 18
  end
  out:line({ x, y - 4 }, { x + 20, y - 4 }, ink.trail, 1.6)
  out:text(x + 26, y, "centre of mass")
end

-- ---- the figure ---------------------------------------------------------------------------------

--- The SVG text of a simulated robot whose "position" was recorded.
---@param robot limax.scored_robot
---@param options? { title?: string }
---@return string
function film_strip.svg(robot, options)
  local film = motion.of(robot, evenly(robot:duration()))
  local frame = frame_of(film.poses, film.ground)
  local track = page.head + frame.strip + page.below
  local way = way_of(film, 2 * frame.scale)
  local foot = track + way.height
  local title = options and options.title or "robot"
  local out = svg.page(page.width, foot + page.foot, title, page.text, ink.text)
  out:text(page.margin, 30, title, 'font-size="16" font-weight="bold"')
  local speed = robot:speed()
  local said = ("%.3f m in %.4g s: %.3f m/s, %.2f body lengths per second"):format(robot:distance(),
    robot:duration(), speed, speed / robot:length())
  out:text(page.width - page.margin, 30, said, 'text-anchor="end" font-size="12"')
  for k, pose in ipairs(film.poses) do draw_panel(out, k, pose, film, frame) end
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
