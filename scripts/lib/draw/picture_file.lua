--- picture_file.lua: writes a sheet as the file that a command names: PNG, SVG or PDF, or its
--- frames as an animation, GIF or MP4.

local failure = require "limax.base.failure"
local host = require "limax.host"
local output = require "limax.base.output"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local picture_file = {}

--- Frames per second of an animation. GIF stores hundredths of a second.
picture_file.FRAMES = 25
-- px, of one pose
local MIN_PANEL_WIDTH = 20
-- bytes of a picture, or of all frames of a GIF
local MAX_BYTES = 8e8

local STILLS = { png = true, svg = true, pdf = true }
local ANIMATIONS = { gif = true, mp4 = true }

-- Options that commands share.
picture_file.OUT = { name = "out", argument = "FILE",
  text = "the picture; its ending sets the format" }
picture_file.DPI = { name = "dpi", argument = "N", kind = "number", minimum = 1, maximum = 10000,
  text = "resolution in a .png: dots per inch on paper" }
picture_file.TRANSPARENT = { name = "transparent", text = "transparent background" }

--- The option of the width; `default` in words.
function picture_file.width(default)
  return { name = "width", argument = "PX", kind = "integer", minimum = 50, maximum = 5000,
    text = ("of the picture [%s]"):format(default) }
end

local function usage(text, ...) failure.raise(2, text:format(...)) end

--- Checks the options, and returns the ending of --out.
---@return string
function picture_file.check(arguments)
  if not arguments.out then usage "--out FILE is missing" end
  local ending = (arguments.out:match "%.(%w+)$" or ""):lower()
  if not STILLS[ending] and not ANIMATIONS[ending] then
    usage("--out %s: its name must end in .png, .svg, .pdf, .gif or .mp4", arguments.out)
  end
  if ending == "mp4" and arguments.transparent then
    usage "--transparent: an .mp4 cannot be transparent; .gif and .png can"
  end
  if arguments.dpi and ending ~= "png" then
    usage("--dpi: only a .png stores it; --out is %s", arguments.out)
  end
  if ending == "mp4" and os.execute "command -v ffmpeg >/dev/null 2>&1" ~= 0 then
    failure.raise(1, "an .mp4 needs ffmpeg, which is not installed; a .gif does not")
  end
  return ending
end

--- Is an ending that of an animation?
function picture_file.is_animation(ending) return ANIMATIONS[ending] ~= nil end

-- Refuses pictures that are too small to show anything, or too large for the memory.
local function check_size(drawn, panels, frames_at_once)
  local panel, bytes = drawn.frames[1].panel, 4 * drawn.width * drawn.height * frames_at_once
  if panel < MIN_PANEL_WIDTH then
    usage("--width: %d poses side by side have %d px each; at least %d are needed", panels, panel,
      MIN_PANEL_WIDTH)
  end
  if bytes > MAX_BYTES then
    usage("%d pictures of %d x %d px are too large; choose a smaller --width, or for a .gif a part"
      .. " (--times)", frames_at_once, drawn.width, drawn.height)
  end
end

-- Calls `take` with the pixels of each frame.
local function each_frame(arguments, drawn, options, take)
  for k = 1, options.frames do
    host.raise_if_interrupted()
    take(drawn:render("pixels", { transparent = arguments.transparent },
      1 + (k - 1) * options.panels))
  end
end

local function gif(arguments, drawn, options)
  local list = {}
  each_frame(arguments, drawn, options, function(bytes) list[#list + 1] = bytes end)
  source.write(arguments.out,
    host.image.gif(drawn.width, drawn.height, list, 100 / picture_file.FRAMES))
end

-- ffmpeg reads the frames from a pipe and writes a file beside, which is then renamed.
local function mp4(arguments, drawn, options)
  local part = arguments.out .. ".part.mp4"
  -- fails early if the folder cannot be written
  source.write(part, "")
  -- if ffmpeg fails its file is removed, and `cat` reads the remaining frames
  local pipe = assert(io.popen(("ffmpeg -y -loglevel error -f rawvideo -pix_fmt rgba -s %dx%d -r %d"
    .. " -i - -pix_fmt yuv420p -movflags +faststart %s || rm -f %s; cat >/dev/null"):format(
    drawn.width, drawn.height, picture_file.FRAMES, shell.quoted(part), shell.quoted(part)), "w"))
  each_frame(arguments, drawn, options, function(bytes) pipe:write(bytes) end)
  pipe:close()
  local done, message = host.file.rename(part, arguments.out)
  if not done then failure.raise(1, "ffmpeg failed: " .. message) end
end

--- Writes the picture that `arguments` name, and prints what it wrote.
---@param arguments { out: string, transparent: boolean|nil, dpi: number|nil } of the command
---@param drawn limax.sheet
---@param options { name: string, title: string, frames: integer, panels: integer } what is drawn;
--- a frame of an animation shows as many poses as panels
function picture_file.write(arguments, drawn, options)
  local ending = picture_file.check(arguments)
  if picture_file.is_animation(ending) then
    -- the sides of a video must be even
    drawn.width, drawn.height = drawn.width - drawn.width % 2, drawn.height + drawn.height % 2
  end
  check_size(drawn, options.panels, ending == "gif" and options.frames or 1)
  if ending == "gif" then
    gif(arguments, drawn, options)
  elseif ending == "mp4" then
    mp4(arguments, drawn, options)
  else
    source.write(arguments.out, drawn:render(ending, { title = options.title, dpi = arguments.dpi,
      transparent = arguments.transparent }))
  end
  output.write(("%s: %d x %d pixels of %s\n"):format(shell.path(arguments.out), drawn.width,
    drawn.height, options.name))
end

return picture_file
