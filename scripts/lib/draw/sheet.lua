--- sheet.lua: pictures of a robot: poses side by side with their times, a scale bar, wind and
--- current, and below a legend of the colours. Film strips have a heading and the whole path too.

local block_picture = require "limax.draw.block_picture"
local canvases = require "limax.draw.canvas"
local engine = require "limax.engine"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local scene = require "limax.draw.picture.scene"
local track = require "limax.draw.picture.track"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local sheet = {}

-- Heights in capitals: above what is drawn in a panel, for the scale bar; below, for each line of
-- its caption; a line of the legend; the heading.
local HEAD, CAPTION, LINE, HEADING = 2.6, 2, 2.2, 4
-- of the legend, in capitals: side of a square of colour, length of a line, room after them, and
-- between two entries
local SQUARE, DASH, AFTER, BETWEEN = 1.3, 2.4, 0.7, 2.2
local PANEL = "#fbfaf8"
-- px of a film strip: its width, a capital, and a row of poses at most
local STRIP = { width = 1000, text = 8, row = 190 }

--- Poses of a film strip.
sheet.POSES = 6

---@class limax.sheet
---@field width integer px
---@field height integer px
---@field frame limax.picture.frame
---@field description string what the picture shows, in words

---@class limax.sheet.options
---@field view limax.picture.view
---@field width integer px
---@field panels integer|nil side by side, as many as poses if left out
---@field strip { title: string, facts: string }|nil heading of a film strip at the left and at the
--- right; a strip has the whole path and the distances of its poses too

--- `count` moments from 0 to the end, s.
function sheet.evenly(duration, count)
  local times = {}
  for k = 1, count do times[k] = (k - 1) / (count - 1) * duration end
  return times
end

-- The entries of the legend: { square or line colour, text }; those without a colour come last. The
-- second result describes the world in words.
local function entries_of(film, width, size)
  local entries, words = {}, world.words(film.world)
  for _, material in ipairs(film.materials) do
    if film.used[material.letter] then
      table.insert(entries, { square = film.colors[material.letter].hex, text = material.name })
    end
  end
  if #film.poses[1].blocks > 0 then
    table.insert(entries, { square = block_picture.hex, text = block_picture.letter })
  end
  if world.has_solids(film.world) then
    table.insert(entries, { square = world.hex, text = world.word })
  end
  if #film.world.targets > 0 then
    table.insert(entries, { square = world.target_hex, text = "target" })
  end
  table.insert(entries, { line = scene.trail, width = 1.6, text = "centre of mass" })
  if next(film.held) then
    table.insert(entries, { line = scene.held, width = 2.4, text = "held" })
  end
  if film.poses[1].tints then
    table.insert(entries, { text = "light muscles: activation above 0, dark: below" })
  end
  for _, line in ipairs(words ~= "" and canvases.wrapped(words, { size = size }, width) or {}) do
    table.insert(entries, { text = line })
  end
  return entries, words
end

-- Adds a place to each entry: x and the number of its line. Returns the number of lines.
local function place_entries(entries, left, right, text, size)
  local x, line = left, 1
  for _, entry in ipairs(entries) do
    local mark = entry.square and SQUARE or entry.line and DASH
    entry.mark = mark and (mark + AFTER) * text or 0
    local wide = entry.mark + canvases.text_width(entry.text, { size = size })
    if x + wide > right and x > left then x, line = left, line + 1 end
    entry.x, entry.at = x, line
    x = x + wide + BETWEEN * text
  end
  return line
end

--- Lays out a picture of a film.
function sheet.new(film, options)
  local self = { film = film, options = options, width = options.width }
  local panels = options.panels or #film.poses
  local text = options.strip and STRIP.text
    or math.min(math.max(math.floor(options.width / panels / 32), 8), 14)
  local margin = math.ceil(text)
  local room = options.width - 2 * margin
  local frame = scene.frame(film, options.view, room, panels,
    { text = text, gap = math.ceil(text / 2), head = HEAD })
  frame.left, frame.top = margin, 0
  if options.strip then
    frame.top = math.ceil(HEADING * text)
    scene.rescale(frame, math.min(frame.scale, (STRIP.row - frame.head * text) / frame.tall))
  end
  self.text, self.margin, self.frame, self.size = text, margin, frame, text / frame.capital
  local top = frame.top + frame.height + (options.strip and 2 or 1) * CAPTION * text
  if options.strip then
    self.track_top = top + text
    self.track = track.layout(film, room, 2 * frame.scale)
    top = self.track_top + self.track.height
  end
  self.entries, self.description = entries_of(film, room, self.size)
  self.legend_top = top + text
  local lines = place_entries(self.entries, margin, options.width - margin, text, self.size)
  self.height = math.ceil(self.legend_top + lines * LINE * text + text / 2)
  return self
end

-- A bar of a round length in the upper left corner of a frame. In `iso` it is true along every
-- axis.
local function draw_scale_bar(canvas, frame, size)
  local short, text = frame.view.short, frame.text
  local length = motion.round_length(frame.panel / 3 / frame.scale / short)
  local x, y = frame.left + text, frame.top + 1.5 * text
  local wide = length * frame.scale * short
  canvas:line({ x, y }, { x + wide, y }, canvases.ink, 1.6)
  for _, at in ipairs { x, x + wide } do
    canvas:line({ at, y - text / 2 }, { at, y + text / 2 }, canvases.ink, 1.6)
  end
  canvas:text(x + wide + 0.8 * text, y + text / 2, ("%g m"):format(length), { size = size })
end

local function draw_poses(self, canvas, first)
  local film, frame, text = self.film, self.frame, self.text
  local bottom = frame.top + frame.height
  for k = 1, math.min(frame.count, #film.poses - first + 1) do
    local pose, left = film.poses[first + k - 1], scene.left(frame, k)
    if not canvas.transparent then
      canvas:box(left, frame.top, frame.panel, frame.height, PANEL)
    end
    scene.draw(canvas, film, frame, pose, k)
    local captions = { ("%.2f s"):format(pose.time),
      self.track and ("%+.2f m"):format(pose.middle[1] - film.start) or nil }
    for line, caption in ipairs(captions) do
      canvas:text(left + frame.panel / 2, bottom + (1.8 * line - 0.2) * text, caption,
        { size = self.size, anchor = "middle", bold = line == 1,
          fill = line > 1 and canvases.faint or nil })
    end
  end
  scene.flows(canvas, film, frame)
  draw_scale_bar(canvas, frame, self.size)
end

local function draw_legend(self, canvas)
  local text = self.text
  for _, entry in ipairs(self.entries) do
    local y = self.legend_top + (entry.at - 0.6) * LINE * text
    if entry.square then
      canvas:box(entry.x, y - SQUARE / 2 * text, SQUARE * text, SQUARE * text, entry.square)
    elseif entry.line then
      canvas:line({ entry.x, y }, { entry.x + DASH * text, y }, entry.line, entry.width)
    end
    canvas:text(entry.x + entry.mark, y + text / 2, entry.text,
      { size = self.size, fill = entry.mark == 0 and canvases.faint or nil })
  end
end

--- The file of a picture.
---@param kind "png"|"svg"|"pdf"|"pixels"
---@param first? integer the pose in the first panel, 1
function sheet.render(self, kind, options, first)
  local copy, strip, text = { description = self.description }, self.options.strip, self.text
  for name, value in pairs(options or {}) do copy[name] = value end
  local canvas = canvases.new(kind, self.width, self.height, copy)
  if strip then
    canvas:text(self.margin, 2.8 * text, strip.title, { size = 1.4 * self.size, bold = true })
    canvas:text(self.width - self.margin, 2.8 * text, strip.facts,
      { size = 1.05 * self.size, anchor = "end" })
  end
  draw_poses(self, canvas, first or 1)
  if strip then track.draw(canvas, self.film, self.track, self.track_top, self.size) end
  draw_legend(self, canvas)
  return canvas:finish()
end

--- The SVG text of a simulated robot whose "position" was recorded.
---@param options? { title?: string, facts?: string, prefix?: string, kind?: string } prefix: see
--- canvas.lua; `facts`: to be shown before the distance, without the title, which the caller shows;
--- `kind` as for `render`
function sheet.film_strip(robot, options)
  options = options or {}
  local film = motion.of(robot, sheet.evenly(robot:duration(), sheet.POSES))
  local title, speed = options.title or "robot", robot:speed()
  local facts = ("%.3f m in %.4g s: %.3f m/s, %.2f body lengths per second"):format(
    robot:distance(), robot:duration(), speed, speed / robot:length())
  local drawn = sheet.new(film, { view = view.of.side, width = STRIP.width,
    strip = { title = options.facts or title, facts = facts } })
  return sheet.render(drawn, options.kind or "svg", { title = title, prefix = options.prefix })
end

--- Simulates a robot with its positions recorded and writes its film strip. `nil, message` where
--- the simulation fails: there is nothing to draw.
function sheet.write_film_strip(path, robot, options)
  local walked, reason = motion.simulate(robot, options)
  if not walked then return nil, reason end
  local ok, message = host.file.write_atomic(path, sheet.film_strip(walked, options))
  if not ok then engine.fail(message) end
  return walked
end

return sheet
