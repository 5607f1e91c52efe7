--- vibration.lua: pictures of natural modes, side by side, exaggerated: both extremes one below the
--- other, or the frames of one vibration.

local motion = require "limax.draw.motion"
local picture_file = require "limax.draw.picture_file"
local sheet = require "limax.draw.sheet"

local vibration = {}

-- The largest displacement, as a share of the body's longest side; frames of an animation, one
-- vibration a second.
local SIZE, FRAMES = 0.15, picture_file.FRAMES

local function captions_of(k, mode)
  local list = { ("%d: %.4g Hz"):format(k, mode.frequency),
    ("damping ratio %.3g"):format(mode.damping_ratio) }
  if mode.ratio then
    list[3] = ("%.3g times the drive"):format(mode.ratio)
    list[4] = ("amplified %.3g times"):format(mode.amplification)
  end
  return list
end

-- The body displaced along a mode.
local function displaced(rest, shape, by)
  local positions = {}
  for m, place in ipairs(rest) do
    local move = shape[m]
    positions[m] = { place[1] + by * move[1], place[2] + by * move[2], place[3] + by * move[3] }
  end
  return positions
end

--- A picture of modes.
---@param all limax.robot.modes
---@param body table what modes.of gives beside
---@param options { animated: boolean, view: limax.picture.view, width: integer, text?: number }
---@return limax.sheet
---@return integer frames of as many poses as there are modes
function vibration.sheet(all, body, options)
  local rest, shapes, films = all.pose:table(), {}, {}
  for k, mode in ipairs(all) do shapes[k] = mode.shape:table() end
  local length = body.context.options.edge * math.max(unpack(body.body.size))
  local function poses(list, phase)
    local by = SIZE * length * math.cos(phase)
    for k, mode in ipairs(all) do
      list[#list + 1] = { positions = displaced(rest, shapes[k], by),
        captions = captions_of(k, mode) }
    end
    return list
  end
  local frames, names = 1, nil
  if options.animated then
    local list = {}
    for frame = 0, FRAMES - 1 do poses(list, 2 * math.pi * frame / FRAMES) end
    films[1], frames = motion.around(body, rest, list), FRAMES
  else
    for k, phase in ipairs { 0, math.pi } do
      films[k] = motion.around(body, rest, poses({}, phase))
    end
    names = { "one extreme", "half a period later" }
  end
  return sheet.new(films, { view = options.view, width = options.width, text = options.text,
    panels = #all, names = names }), frames
end

return vibration
