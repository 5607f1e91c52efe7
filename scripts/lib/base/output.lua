--- output.lua: writes to the standard streams. What limax prints may contain names and texts from
--- files of other people, so no control character reaches a terminal from here. Scripts that print
--- by themselves are free to.

local host = require "limax.host"
local terminal = require "limax.base.terminal"

local output = {}

--- Writes to the standard output.
function output.write(...)
  io.stdout:write(terminal.shown(table.concat { ... }, host.terminal().color))
end

--- Writes to the standard error: progress, warnings, failures.
function output.warn(...)
  io.stderr:write(terminal.shown(table.concat { ... }, host.terminal().color_stderr))
end

return output
