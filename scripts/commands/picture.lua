--- picture.lua: `limax picture ROBOT|RUN --out FILE`: stills, film strips and animations. It needs
--- no display.

local earlier = require "limax.tools.report.earlier"
local failure = require "limax.base.failure"
local motion = require "limax.draw.motion"
local picture_file = require "limax.draw.picture_file"
local sheet = require "limax.draw.sheet"
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
    picture_file.OUT,
    { name = "view", argument = "NAME", choices = view.names, value = "side",
      text = "side, top or iso" },
    { name = "times", argument = "LIST",
      text = "seconds, such as 0,0.5,1 [six, evenly spaced]" },
    picture_file.width "1200 for a strip, 480 for an animation, else 800",
    picture_file.DPI, picture_file.TRANSPARENT,
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

local function usage(text, ...) failure.raise(2, text:format(...)) end

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
  for k = 0, math.floor((last - first) * picture_file.FRAMES + 1e-6) do
    list[k + 1] = first + k / picture_file.FRAMES
  end
  return list
end

function command.run(arguments)
  local ending = picture_file.check(arguments)
  local walker, path = earlier.named(arguments[1], arguments.robot)
  local trials = #(walker.description.trials or { walker.description })
  if arguments.trial and arguments.trial > trials then
    usage("--trial %d: %s has %d", arguments.trial, path, trials)
  end
  local walked, message = motion.simulate(walker, { device = arguments.device,
    trial = arguments.trial })
  if not walked then failure.raise(1, message) end
  local duration, animated = walked:duration(), picture_file.is_animation(ending)
  local times = times_of(arguments.times, duration)
  if animated then times = frame_times(times, duration) end
  local film = motion.of(walked, times or sheet.evenly(duration, sheet.POSES))
  local panels = animated and 1 or #film.poses
  local width = arguments.width
    or WIDTHS[animated and "animation" or panels > 1 and "strip" or "still"]
  local drawn = sheet.new({ film }, { view = view.of[arguments.view], panels = panels,
    width = width })
  picture_file.write(arguments, drawn, { name = path, title = arguments[1],
    frames = animated and #film.poses or 1, panels = panels })
  return 0
end

return command
