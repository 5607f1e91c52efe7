--- shell.lua: words of commands that are printed to be pasted into a shell, and run there as they
--- stand.

local host = require "limax.host"

local shell = {}

--- A word as a shell takes it.
---@param word string
---@return string
function shell.quoted(word)
  if word:find "^[%w%._/=%-]+$" then return word end
  return "'" .. word:gsub("'", "'\\''") .. "'"
end

--- A path as short as it can be said from here, quoted where a shell needs it.
---@param path string
---@return string
function shell.path(path)
  local here = host.file.absolute "."
  if path:sub(1, #here + 1) == here .. "/" then path = path:sub(#here + 2) end
  return shell.quoted(path)
end

--- The program as the user can call it: by name where the name finds it.
---@return string
function shell.program()
  local executable = host.executable
  for folder in (os.getenv "PATH" or ""):gmatch "[^:]+" do
    if host.file.absolute(folder .. "/limax") == executable then return "limax" end
  end
  local said = shell.path(executable)
  return said:find("/", 1, true) and said or "./" .. said
end

return shell
