--- strips.lua: the robots of generation 0 and of the last for print: a row of poses for each, to
--- one scale, and the paths of their middles as numbers.

local block_picture = require "limax.draw.block_picture"
local motion = require "limax.draw.motion"
local scene = require "limax.draw.picture.scene"
local vectors = require "limax.draw.picture.vectors"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local strips = {}

local PX_PER_MM = 96 / 25.4
-- 8 pt text has capitals of this height, px
local CAPITAL = 8 * 96 / 72 * 0.73
-- px above each row, for its name
local HEAD = 18
-- px: a row of the key, and about the width of a letter of 8 pt
local LINE, LETTER = 15, 6.3
-- mm that a pose needs to be made out
local POSE = 21

local function evenly(duration, count)
  local times = {}
  for k = 1, count do times[k] = (k - 1) / (count - 1) * duration end
  return times
end

-- What the colours are and what the world is, as rows that fit: { { hex, name, x }, ... }.
local function key_of(films, width)
  local entries, seen = {}, {}
  local function add(hex, name)
    if name ~= "" and not seen[name] then
      seen[name] = true
      entries[#entries + 1] = { hex = hex, name = name }
    end
  end
  for _, film in ipairs(films) do
    for _, material in ipairs(film.materials) do
      if film.used[material.letter] then
        add(film.colors[material.letter].hex, material.name)
      end
    end
    if #film.poses[1].block > 0 then add(block_picture.hex, block_picture.letter) end
    if world.has_solids(film.world) then add(world.hex, world.word) end
  end
  for _, film in ipairs(films) do
    add(nil, world.words(film.world))
    add(nil, film.note or "")
  end
  local rows, x = { {} }, CAPITAL
  for _, entry in ipairs(entries) do
    local room = 12 + #entry.name * LETTER + 10
    if x + room > width and #rows[#rows] > 0 then
      rows[#rows + 1] = {}
      x = CAPITAL
    end
    entry.x = x
    table.insert(rows[#rows], entry)
    x = x + room
  end
  return rows
end

-- Each world in words, once.
local function description_of(films)
  local list, seen = {}, {}
  for _, film in ipairs(films) do
    local words = world.words(film.world)
    if words ~= "" and not seen[words] then list[#list + 1] = words end
    seen[words] = true
  end
  return table.concat(list, "; ")
end

--- The SVG text of these robots, one below the other.
---@param shown limax.report.shown[]
---@param millimetres number its width
---@param title string
---@return string
function strips.svg(shown, millimetres, title)
  local width = math.floor(millimetres * PX_PER_MM + 0.5)
  local count = math.floor(millimetres / POSE)
  local films, frames, scale, height = {}, {}, math.huge, 0
  for k, each in ipairs(shown) do
    films[k] = motion.of(each.walked, evenly(each.walked:duration(), count))
    frames[k] = scene.frame(films[k], view.of.side, width, count, { head = 0 })
    scale = math.min(scale, frames[k].scale)
  end
  -- the smallest scale of all: sizes may be compared
  for k, frame in ipairs(frames) do
    scene.rescale(frame, scale, CAPITAL)
    frames[k].top = height + HEAD
    height = frames[k].top + frame.height
  end
  local key = key_of(films, width)
  local foot = height
  height = height + #key * LINE + 6
  local canvas = vectors.new(width, height, title, { millimetres = millimetres,
    description = description_of(films) })
  for k, each in ipairs(shown) do
    canvas:clip(0, 0, width, height)
    canvas:text(CAPITAL, frames[k].top - 4, ("%s: %.2f m in %.4g s"):format(each.name,
      each.walked:distance(), each.walked:duration()), CAPITAL, "#2b2b2b")
    for p, pose in ipairs(films[k].poses) do
      scene.draw(canvas, films[k], frames[k], pose, p)
      scene.caption(canvas, frames[k], pose, p)
    end
    scene.flows(canvas, films[k], frames[k])
  end
  canvas:clip(0, 0, width, height)
  scene.scale_bar(canvas, frames[1], { width - frames[1].panel, HEAD / 2 })
  for row, entries in ipairs(key) do
    local y = foot + row * LINE
    for _, entry in ipairs(entries) do
      local x = entry.x
      if entry.hex then
        canvas:polygon({ { x, y - 8 }, { x + 8, y - 8 }, { x + 8, y }, { x, y } }, entry.hex)
      end
      canvas:text(x + (entry.hex and 12 or 0), y, entry.name, CAPITAL, "#2b2b2b")
    end
  end
  return canvas:finish()
end

--- Where the middles of these robots went: along their way, away from the eye, up, m.
---@param shown limax.report.shown[]
---@return string[] columns
---@return table[] rows
function strips.rows(shown)
  local rows = {}
  for _, each in ipairs(shown) do
    local rate = each.walked:trace("position").rate
    for s, at in ipairs(motion.of(each.walked, { 0 }).path) do
      rows[#rows + 1] = { robot = each.name, time = (s - 1) / rate, along = at[1], away = at[2],
        up = at[3] }
    end
  end
  return { "robot", "time", "along", "away", "up" }, rows
end

return strips
