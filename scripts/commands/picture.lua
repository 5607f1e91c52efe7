--- picture.lua: `limax picture ROBOT|RUN --out FILE`: stills, film strips and animations: PNG, SVG
--- or PDF, or frames as GIF or MP4. It needs no display.

local earlier = require "limax.tools.report.earlier"
local failure = require "limax.base.failure"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local output = require "limax.base.output"
local sheet = require "limax.draw.sheet"
local shell = require "limax.base.shell"
local source = require "limax.base.source"
local view = require "limax.draw.picture.view"

local command = {
  summary = "draw a robot: still, film strip or animation",
  usage = "limax picture ROBOT|RUN --out FILE.png|.svg|.pdf|.gif|.mp4 [options]",
  text = [[
Draws a robot file, or the champion of a run folder, simulated again as its file describes. One
time gives a still, several a film strip; .gif and .mp4 show all of the simulation, or the part
between the first and the last time. .mp4 needs ffmpeg. --robot draws any robot of a run, such as
one of its archive, by the id in the report and in the population files.]],
  positional = { least = 1, most = 1, name = "ROBOT|RUN" },
  options = {
    { name = "out", argument = "FILE", text = "the picture; its ending sets the format" },
    { name = "view", argument = "NAME", choices = view.names, value = "side",
      text = "side, top or iso" },
    { name = "times", argument = "LIST",
      text = "seconds, such as 0,0.5,1 [six, evenly spaced]" },
    { name = "width", argument = "PX", kind = "integer", minimum = 50, maximum = 5000,
      text = "of the picture [1200 for a strip, 480 for an animation, else 800]" },
    { name = "transparent", text = "transparent background" },
    { name = "robot", argument = "ID", kind = "integer", minimum = 1, maximum = 2 ^ 53,
      text = "of a run folder: this robot [the champion]" },
    { name = "trial", argument = "N", kind = "integer", minimum = 1, maximum = 1e6,
      text = "of a robot that was judged in several trials [1]" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "cpu",
      text = "for the simulation" },
  },
}

-- px if --width is left out
local WIDTHS = { strip = 1200, still = 800, animation = 480 }
-- Frames per second of an animation. GIF stores hundredths of a second.
local FRAMES = 25
-- px, of one pose
local MIN_PANEL_WIDTH = 20
-- bytes of a picture, or of all frames of a GIF
local MAX_BYTES = 8e8

local STILLS = { png = true, svg = true, pdf = true }
local ANIMATIONS = { gif = true, mp4 = true }

local function usage(text, ...) failure.raise(2, text:format(...)) end

-- Checks the options, and returns the ending of --out.
local function ending_of(arguments)
  if not arguments.out then usage "--out FILE is missing" end
  local ending = (arguments.out:match "%.(%w+)$" or ""):lower()
  if not STILLS[ending] and not ANIMATIONS[ending] then
    usage("--out %s: its name must end in .png, .svg, .pdf, .gif or .mp4", arguments.out)
  end
  if ending == "mp4" and arguments.transparent then
    usage "--transparent: an .mp4 cannot be transparent; .gif and .png can"
  end
  if ending == "mp4" and os.execute "command -v ffmpeg >/dev/null 2>&1" ~= 0 then
    failure.raise(1, "an .mp4 needs ffmpeg, which is not installed; a .gif does not")
  end
  return ending
end

-- The times of `--times`; nil if it is left out.
local function times_of(text, duration)
  if not text then return nil end
  local times = {}
  for word in (text .. ","):gmatch "([^,]*)," do
    local time = tonumber(word)
    if not time or time ~= time or time < 0 or time > duration then
      usage('--times: "%s": expected seconds from 0 to %.6g', word, duration)
    end
    times[#times + 1] = time
  end
  return times
end

-- The times of an animation's frames, between the first and the last of `times`.
local function frame_times(times, duration)
  local first, last, list = 0, duration, {}
  if times then first, last = math.min(unpack(times)), math.max(unpack(times)) end
  -- 1e-6: rounding may put the last frame just beyond the end
  for k = 0, math.floor((last - first) * FRAMES + 1e-6) do list[k + 1] = first + k / FRAMES end
  return list
end

-- Refuses pictures that are too small to show anything, or too large for the memory.
local function check_size(drawn, panels, frames_at_once)
  local panel, bytes = drawn.frame.panel, 4 * drawn.width * drawn.height * frames_at_once
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
local function each_frame(arguments, drawn, frames, take)
  for k = 1, frames do
    host.raise_if_interrupted()
    take(sheet.render(drawn, "pixels", { transparent = arguments.transparent }, k))
  end
end

local function write_gif(arguments, drawn, frames)
  local list = {}
  each_frame(arguments, drawn, frames, function(bytes) list[#list + 1] = bytes end)
  source.write(arguments.out, host.image.gif(drawn.width, drawn.height, list, 100 / FRAMES))
end

-- ffmpeg reads the frames from a pipe and writes a file beside, which is then renamed.
local function write_mp4(arguments, drawn, frames)
  local part = arguments.out .. ".part.mp4"
  -- fails early if the folder cannot be written
  source.write(part, "")
  -- if ffmpeg fails its file is removed, and `cat` reads the remaining frames
  local pipe = assert(io.popen(("ffmpeg -y -loglevel error -f rawvideo -pix_fmt rgba -s %dx%d -r %d"
    .. " -i - -pix_fmt yuv420p -movflags +faststart %s || rm -f %s; cat >/dev/null"):format(
    drawn.width, drawn.height, FRAMES, shell.quoted(part), shell.quoted(part)), "w"))
  each_frame(arguments, drawn, frames, function(bytes) pipe:write(bytes) end)
  pipe:close()
  local done, message = host.file.rename(part, arguments.out)
  if not done then failure.raise(1, "ffmpeg failed: " .. message) end
end

function command.run(arguments)
  local ending = ending_of(arguments)
  local walker, name = earlier.named(arguments[1], arguments.robot)
  local trials = #(walker.description.trials or { walker.description })
  if arguments.trial and arguments.trial > trials then
    usage("--trial %d: %s has %d", arguments.trial, name, trials)
  end
  local walked, message = motion.simulate(walker, { device = arguments.device,
    trial = arguments.trial })
  if not walked then failure.raise(1, message) end
  local duration, animated = walked:duration(), ANIMATIONS[ending]
  local times = times_of(arguments.times, duration)
  if animated then times = frame_times(times, duration) end
  local film = motion.of(walked, times or sheet.evenly(duration, sheet.POSES))
  local panels = animated and 1 or #film.poses
  local width = arguments.width
    or WIDTHS[animated and "animation" or panels > 1 and "strip" or "still"]
  local drawn = sheet.new(film, { view = view.of[arguments.view], panels = panels, width = width })
  if animated then
    -- the sides of a video must be even
    drawn.width, drawn.height = drawn.width - drawn.width % 2, drawn.height + drawn.height % 2
  end
  check_size(drawn, panels, ending == "gif" and #film.poses or 1)
  if animated then
    local write = ending == "gif" and write_gif or write_mp4
    write(arguments, drawn, #film.poses)
  else
    source.write(arguments.out, sheet.render(drawn, ending, { title = arguments[1],
      transparent = arguments.transparent }))
  end
  output.write(("%s: %d x %d pixels of %s\n"):format(shell.path(arguments.out), drawn.width,
    drawn.height, name))
  return 0
end

return command
