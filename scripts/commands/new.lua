--- new.lua: `limax new NAME`: writes an experiment, or a suite of tests, with comments, as a
--- starting point.

local failure = require "limax.base.failure"
local host = require "limax.host"
local output = require "limax.base.output"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local command = {
  summary = "write an experiment with comments, as a starting point",
  usage = "limax new NAME [options]",
  text = "Writes NAME.lua, which runs as it is. NAME may include a folder. Nothing is overwritten.",
  positional = { name = "NAME", least = 1, most = 1 },
  options = {
    { name = "suite", text = "a suite of tests for limax test instead" },
  },
}

--- Runs the command.
function command.run(arguments)
  local base = arguments[1]:gsub("%.lua$", "")
  local folder, name = base:match "^(.*/)([^/]*)$"
  folder, name = folder or "", name or base
  if not name:match "^[%w_][%w_%-]*$" then
    failure.raise(2, ("%q cannot name a run folder: use letters, digits, _ and -"):format(name))
  end
  local path = folder .. name .. ".lua"
  if host.file.exists(path) then
    failure.raise(2, ("%s exists already; choose another name, or remove it"):format(path))
  end
  if folder ~= "" and host.file.exists(folder) ~= "folder" then
    failure.raise(2, ("there is no folder %s"):format(folder))
  end
  local kind = arguments.suite and "suite" or "experiment"
  local text, message =
    source.read(("%s/scripts/lib/tools/new/%s.lua"):format(host.home, kind))
  if not text then failure.raise(1, message) end
  text = text:gsub("%f[%w]NAME%f[%W]", name)
  source.write(path, text)
  local words = arguments.suite and "test %s --update-golden" or "run %s"
  output.write(("wrote %s; next: %s %s\n"):format(path, shell.program(),
    words:format(shell.quoted(path))))
end

return command
