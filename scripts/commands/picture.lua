--- picture.lua: `limax picture ROBOT|RUN --out FILE`: stills, film strips and animations, drawn by
--- the CPU without a display.

local failure = require "limax.base.failure"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local pixels = require "limax.draw.picture.pixels"
local robot = require "limax.robot.robot"
local runs = require "limax.tools.report.runs"
local scene = require "limax.draw.picture.scene"
local shell = require "limax.base.shell"
local vectors = require "limax.draw.picture.vectors"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local command = {
  summary = "draw a robot: still, film strip or animation",
  usage = "limax picture ROBOT|RUN --out FILE.png|.svg|.gif|.mp4 [options]",
  text = [[
ROBOT is a robot file, RUN a run folder: its last champion is drawn. The robot is simulated again as
its file says. One time makes a still, several a film strip; .gif and .mp4 show the whole walk, or
the part between the first and the last time. .mp4 needs ffmpeg.]],
  positional = { least = 1, most = 1, name = "ROBOT|RUN" },
  options = {
    { name = "out", argument = "FILE", text = "its ending says what is made" },
    { name = "view", argument = "NAME", choices = view.names, value = "side",
      text = "from where: side, top or iso" },
    { name = "times", argument = "LIST",
      text = "seconds with commas, 0,0.5,1 [six over the walk]" },
    { name = "width", argument = "PX", kind = "integer", minimum = 50, maximum = 5000,
      text = "of the whole picture [1200 of a strip, 480 of an animation, else 800]" },
    { name = "dpi", argument = "N", kind = "number", minimum = 1, maximum = 10000,
      text = "noted in a .png: dots per inch on paper" },
    { name = "transparent", text = "without a white ground" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "cpu",
      text = "that simulates" },
  },
}

-- Frames per second of an animation: GIF counts in hundredths of a second.
local FRAMES = 25
local POSES = 6
-- px if --width is left out
local WIDTHS = { strip = 1200, still = 800, animation = 480 }

-- px: a panel that is narrower shows nothing
local NARROWEST = 20
-- px that a picture may have: it is drawn at nine times as many, of four bytes
local MOST_PIXELS = 2e7
-- bytes of all frames of a GIF together, which are there at once
local MOST_BYTES = 8e8

local function usage(text, ...) failure.raise(2, text:format(...)) end

-- The robot file that a word names: itself, or a run's last champion.
local function file_of(word)
  if not runs.is_folder(word) then
    if host.file.exists(word) ~= "file" then
      usage("%s is no robot file and no run folder", word)
    end
    return word
  end
  local folder = runs.read(word)
  if #folder.runs == 0 then failure.raise(1, word .. ": no generation has been scored yet") end
  local leading = runs.leading(folder.runs)
  return runs.champion(leading, leading.lines[#leading.lines])
end

-- The times of `--times`; nil where it is left out.
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

-- Refuses what would be no picture, or more than there is memory for.
local function check_size(frame, count, frames_at_once)
  if frame.panel < NARROWEST then
    usage("--width: %d poses side by side get %d px each; at least %d are needed", count,
      frame.panel, NARROWEST)
  end
  local size = frame.panel * count * frame.height
  if size > MOST_PIXELS then
    usage("--width: a picture of %d x %d px is more than %g million; take a smaller width",
      frame.panel * count, frame.height, MOST_PIXELS / 1e6)
  end
  if 4 * size * (frames_at_once or 1) > MOST_BYTES then
    usage("%d frames of %d x %d px are too many for a .gif; take a part (--times), a smaller"
      .. " --width, or .mp4", frames_at_once, frame.panel, frame.height)
  end
end

local function evenly(duration)
  local times = {}
  for k = 1, POSES do times[k] = (k - 1) / (POSES - 1) * duration end
  return times
end

local function write(path, bytes)
  local written, message = host.file.write_atomic(path, bytes)
  if not written then failure.raise(1, message) end
end

-- ---- kinds of pictures --------------------------------------------------------------------------

local function strip(arguments, film, ending)
  local count = #film.poses
  local width = arguments.width or (count > 1 and WIDTHS.strip or WIDTHS.still)
  local frame = scene.frame(film, view.of[arguments.view], width, count)
  local ground = not arguments.transparent and "#ffffff" or nil
  check_size(frame, count)
  local wide = frame.panel * count
  local canvas = ending == "svg" and vectors.new(wide, frame.height, arguments[1],
    { transparent = arguments.transparent, description = world.words(film.world) })
    or pixels.new(wide, frame.height, ground)
  for k, pose in ipairs(film.poses) do
    scene.draw(canvas, film, frame, pose, k)
    scene.caption(canvas, frame, pose, k)
  end
  scene.flows(canvas, film, frame)
  scene.scale_bar(canvas, frame)
  local drawn = canvas:finish()
  if ending == "png" then
    drawn = host.image.png(wide, frame.height, drawn, arguments.dpi)
  end
  write(arguments.out, drawn)
  return wide, frame.height
end

-- The frames of an animation, each given to `take`, even in both directions.
local function frames(arguments, film, at_once, take)
  local width = arguments.width or WIDTHS.animation
  local frame = scene.frame(film, view.of[arguments.view], width - width % 2, 1)
  frame.height = frame.height + frame.height % 2
  check_size(frame, 1, at_once)
  local ground = not arguments.transparent and "#ffffff" or nil
  for k, pose in ipairs(film.poses) do
    host.raise_if_interrupted()
    local canvas = pixels.new(frame.panel, frame.height, ground)
    scene.draw(canvas, film, frame, pose, 1)
    scene.caption(canvas, frame, pose, 1)
    scene.flows(canvas, film, frame)
    scene.scale_bar(canvas, frame)
    take(canvas:finish(), k, frame)
  end
  return frame.panel, frame.height
end

local function gif(arguments, film)
  local list = {}
  local width, height = frames(arguments, film, #film.poses,
    function(bytes, k) list[k] = bytes end)
  write(arguments.out, host.image.gif(width, height, list, 100 / FRAMES))
  return width, height
end

-- ffmpeg gets the frames through a pipe and writes a file beside, which then takes its place.
local function mp4(arguments, film)
  local part = arguments.out .. ".part.mp4"
  local pipe
  -- where nothing can be written ffmpeg would end and the pipe break
  write(part, "")
  local width, height = frames(arguments, film, 1, function(bytes, _, frame)
    if not pipe then
      -- one that fails leaves nothing, and what it did not read is read by nobody
      pipe = assert(io.popen(("ffmpeg -y -loglevel error -f rawvideo -pix_fmt rgba -s %dx%d -r %d"
        .. " -i - -pix_fmt yuv420p -movflags +faststart %s || rm -f %s; cat >/dev/null"):format(
        frame.panel, frame.height, FRAMES, shell.quoted(part), shell.quoted(part)), "w"))
    end
    pipe:write(bytes)
  end)
  pipe:close()
  local done, message = host.file.rename(part, arguments.out)
  if not done then failure.raise(1, "ffmpeg failed: " .. message) end
  return width, height
end

---@param arguments table
---@return integer status
function command.run(arguments)
  if not arguments.out then usage "--out FILE is missing: where does the picture go?" end
  local ending = (arguments.out:match "%.(%w+)$" or ""):lower()
  local animated = ending == "gif" or ending == "mp4"
  if not animated and ending ~= "png" and ending ~= "svg" then
    usage("--out %s: its name must end in .png, .svg, .gif or .mp4", arguments.out)
  end
  if ending == "mp4" and arguments.transparent then
    usage "--transparent: a video has a ground; .gif and .png can be without"
  end
  if arguments.dpi and ending ~= "png" then
    usage("--dpi: only a .png notes it; --out is %s", arguments.out)
  end
  if ending == "mp4" and os.execute "command -v ffmpeg >/dev/null 2>&1" ~= 0 then
    failure.raise(1, "an .mp4 needs ffmpeg, which is not installed; .gif needs nothing")
  end
  local path = file_of(arguments[1])
  local read, given = failure.attempt(robot, path)
  if not read then failure.raise(1, failure.bare(given)) end
  local walked, message = motion.simulate(given, { device = arguments.device })
  if not walked then failure.raise(1, message) end
  local duration = walked:duration()
  local times = times_of(arguments.times, duration)
  if animated then
    local first, last = 0, duration
    if times then first, last = math.min(unpack(times)), math.max(unpack(times)) end
    times = {}
    -- 1e-6: a last frame that rounding puts just beyond the end
    for k = 0, math.floor((last - first) * FRAMES + 1e-6) do times[k + 1] = first + k / FRAMES end
  end
  local film = motion.of(walked, times or evenly(duration))
  local width, height
  if ending == "gif" then
    width, height = gif(arguments, film)
  elseif ending == "mp4" then
    width, height = mp4(arguments, film)
  else
    width, height = strip(arguments, film, ending)
  end
  io.stdout:write(("%s: %d x %d pixels of %s\n"):format(shell.path(arguments.out), width, height,
    shell.path(path)))
  return 0
end

return command
