--- script.lua: runs a user's file. Its `require` searches its folder; a syntax error gives one
--- message.

local failure = require "limax.base.failure"
local host = require "limax.host"

local script = {}

local exit_failed, exit_usage = 1, 2

--- The compiled file. From now on `require` also finds Lua files in its folder.
---@return function chunk
function script.load(file)
  local kind = host.file.exists(file)
  if not kind or kind == "folder" then
    local what = kind and "%s is a folder, not a script" or "there is no file %s"
    failure.raise(exit_usage, what:format(file))
  end
  local chunk, message = loadfile(file)
  if not chunk then
    -- Lua shortens long paths in messages
    local line, what = message:match "^[^\n]-:(%d+): (.*)$"
    failure.raise(exit_failed, line and ("%s:%s: %s"):format(file, line, what) or message)
  end
  local folder = file:match "^(.*)/[^/]*$" or "."
  package.path = ("%s/?.lua;%s/?/init.lua"):format(folder, folder)
  return chunk
end

--- Runs a file with `...` as its arguments, also in the global `arg`.
---@param ... string
---@return any ... what the file returns
function script.run(file, ...)
  local chunk = script.load(file)
  rawset(_G, "arg", { [0] = file, ... })
  return chunk(...)
end

return script
