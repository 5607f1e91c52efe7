--- shell.lua: words of commands for a shell.

local host = require "limax.host"
local ranks = require "limax.base.ranks"
local terminal = require "limax.base.terminal"

local shell = {}

--- A word, quoted if a shell needs it.
function shell.quoted(word)
  if word:find "^[%w%._/=%-]+$" then return word end
  return "'" .. word:gsub("'", "'\\''") .. "'"
end

-- A word of a command that is printed. Control characters do not reach a terminal as they are, so
-- they are written as bash, zsh and POSIX of 2024 read them.
local function printed(word)
  if not word:find "%c" and terminal.shown(word) == word then return shell.quoted(word) end
  word = word:gsub("['\\]", "\\%0"):gsub("[%c\128-\255]", function(character)
    return ("\\x%02x"):format(character:byte())
  end)
  return "$'" .. word .. "'"
end

--- A path for a message, relative if it is below the working directory, quoted if a shell needs it.
function shell.path(path)
  local here = host.file.absolute "."
  if path:sub(1, #here + 1) == here .. "/" then path = path:sub(#here + 2) end
  return printed(path)
end

--- The program as the user can call it: by name if it is on the PATH.
function shell.program()
  local executable = host.executable
  for folder in (os.getenv "PATH" or ""):gmatch "[^:]+" do
    if host.file.absolute(folder .. "/limax") == executable then return "limax" end
  end
  local path = shell.path(executable)
  return path:find("/", 1, true) and path or "./" .. path
end

--- The program, on as many ranks as now.
function shell.same_ranks()
  local launcher = ranks.count > 1 and ("mpirun -n %d "):format(ranks.count) or ""
  return launcher .. shell.program()
end

--- The command that continues the run in a folder, ready to be pasted into a shell.
function shell.resume_command(path)
  return ("%s run --resume %s"):format(shell.same_ranks(), printed(path))
end

return shell
