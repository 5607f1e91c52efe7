--- install.lua: the files that `cmake --install` copies run from their new place.

local host = require "limax.host"
local process = require "support.process"

local suite = require("limax.test").suite "install"

suite:test("an installed limax runs an experiment with its own scripts", function(t)
  local build = host.executable:match "^(.*)/"
  if not host.file.exists(build .. "/cmake_install.cmake") then t:skip "not a build folder" end
  local folder = t:folder()
  local function run(line, ...)
    local output = process.output(("cd %s && %s 2>&1; echo $?")
      :format(process.quote(folder), line:format(...)))
    t:ok(output:find "\n0\n$", output)
    return output
  end
  run("cmake --install %s --prefix %s", process.quote(build), process.quote(folder .. "/usr"))
  local program = "env -u LIMAX_HOME usr/bin/limax"
  t:ok(run(program .. " --version"):find("limax " .. host.version, 1, true))
  t:ok(run(program .. " doctor"):find(folder .. "/usr/share/limax", 1, true))
  run(program .. " new mine && " .. program .. " run mine.lua --quiet --set generations=1"
    .. " --set population=4 --set simulation.duration=0.1")
end)
