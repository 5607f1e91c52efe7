--- install.lua: the files that `cmake --install` copies run from their new place.

local host = require "limax.host"
local shell = require "limax.base.shell"

local suite = require("limax.test").suite "install"

suite:test("an installed limax runs an experiment with its own scripts", function(t)
  local build = host.executable:match "^(.*)/"
  if not host.file.exists(build .. "/cmake_install.cmake") then t:skip "not a build folder" end
  local folder = t:folder()
  local function run(line, ...)
    local pipe = io.popen(("cd %s && %s 2>&1; echo $?")
      :format(shell.quoted(folder), line:format(...)))
    local output = pipe:read "*a"
    pipe:close()
    t:ok(output:find "\n0\n$", output)
    return output
  end
  run("cmake --install %s --prefix %s", shell.quoted(build), shell.quoted(folder .. "/usr"))
  local program = "env -u LIMAX_HOME usr/bin/limax"
  t:ok(run(program .. " --version"):find("limax " .. host.version, 1, true))
  t:ok(run(program .. " doctor"):find(folder .. "/usr/share/limax", 1, true))
  run(program .. " new mine && " .. program .. " run mine.lua --quiet --set generations=1"
    .. " --set population=4 --set simulation.duration=0.1")
end)
