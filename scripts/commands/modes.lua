--- modes.lua: `limax modes ROBOT|RUN`: the natural frequencies of a robot, beside the frequency of
--- its muscles.

local earlier = require "limax.tools.report.earlier"
local failure = require "limax.base.failure"
local modes = require "limax.robot.modes"
local output = require "limax.base.output"
local terminal = require "limax.base.terminal"

local command = {
  summary = "natural frequencies of a robot beside that of its muscles",
  usage = "limax modes ROBOT|RUN [options]",
  text = [[
Prints the natural frequencies and damping ratios of a robot file, or of the champion of a run
folder: of the free body, or with --standing at rest in its scene. The amplitude is how far the
muscles move a mass in a mode at their frequency, the amplification how much farther than slow
muscles would; a gait rides a resonance if that is at least 2 and no mode moves farther slowly.]],
  positional = { least = 1, most = 1, name = "ROBOT|RUN" },
  options = {
    { name = "count", argument = "N", kind = "integer", minimum = 1, maximum = 1000, value = 6,
      text = "modes, the lowest frequencies first" },
    { name = "standing", text = "at rest in its scene, on the ground or held by anchors" },
    { name = "robot", argument = "ID", kind = "integer", minimum = 1, maximum = 2 ^ 53,
      text = "of a run folder: this robot [the champion]" },
    { name = "trial", argument = "N", kind = "integer", minimum = 1, maximum = 1e6,
      text = "of a robot that was judged in several trials [1]" },
  },
}

function command.run(arguments)
  local robot, path = earlier.named(arguments[1], arguments.robot)
  local fine, all = failure.attempt(modes.of, robot, arguments.count,
    { standing = arguments.standing, trial = arguments.trial })
  if not fine then failure.raise(1, failure.bare(all)) end
  output.write(("%s, %s\n"):format(path, modes.words(all)))
  local columns, rows = modes.table(all)
  output.write(terminal.table(columns, rows, terminal.style()), "\n")
  return 0
end

return command
