--- new.lua: `limax new NAME`: writes an experiment, or a suite of tests, with comments, to be
--- changed.

local failure = require "limax.base.failure"
local host = require "limax.host"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local command = {
  summary = "write an experiment with comments, to be changed",
  usage = "limax new NAME [options]",
  text = "Writes NAME.lua, which runs as it is; NAME may begin with a folder. A file that is\n"
    .. "there stays as it is.",
  positional = { name = "NAME", least = 1, most = 1 },
  options = {
    { name = "suite", text = "a suite of regressions for limax test instead" },
  },
}

--- Runs the command.
---@param arguments table
function command.run(arguments)
  local given = arguments[1]:gsub("%.lua$", "")
  local folder, name = given:match "^(.*/)([^/]*)$"
  folder, name = folder or "", name or given
  if not name:match "^[%w_][%w_%-]*$" then
    failure.raise(2, ("%q is no name for a run folder: use letters, digits, _ and -"):format(name))
  end
  local path = folder .. name .. ".lua"
  if host.file.exists(path) then
    failure.raise(2, ("%s is there already; name another, or remove it"):format(path))
  end
  if folder ~= "" and host.file.exists(folder) ~= "folder" then
    failure.raise(2, ("there is no folder %s"):format(folder))
  end
  local kind = arguments.suite and "suite" or "experiment"
  local text, message =
    source.read(("%s/scripts/lib/tools/new/%s.lua"):format(host.home, kind))
  if not text then failure.raise(1, message) end
  text = text:gsub("%f[%w]NAME%f[%W]", name)
  local fine
  fine, message = host.file.write_atomic(path, text)
  if not fine then failure.raise(1, message) end
  local words = arguments.suite and "test %s --update-golden" or "run %s"
  print(("%s is written; %s %s"):format(path, shell.program(),
    words:format(shell.quoted(path))))
end

return command
