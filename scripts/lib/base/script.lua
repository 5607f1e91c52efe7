--- script.lua: runs a user's file. Its `require` searches its folder; a syntax error gives one
--- message.

local failure = require "limax.base.failure"
local host = require "limax.host"

local source = require "limax.base.source"

local script = {}

local exit_failed, exit_usage = 1, 2

-- The end of the compiler's message: what is probably missing.
local function missing(what)
  if what:find "near '<eof>'$" then return "" end
  return what:find "^'[})]' expected" and "; a comma may be missing before it"
    or what:find "^'end' expected" and "; an `end` is missing before it" or ""
end

--- A message of the compiler with the line of the text that it is about.
---@param file string its name: Lua shortens long ones in messages
function script.syntax_error(file, text, message)
  local number, what = message:match "^[^\n]-:(%d+): (.*)$"
  if not number then return message end
  local line = source.lines_of(text, tonumber(number), tonumber(number))
  return ("%s:%s: %s%s%s"):format(file, number, what, missing(what),
    line:find "%S" and ("\n  %s | %s"):format(number, line) or "")
end

--- The compiled file.
function script.compile(file)
  local chunk, message = loadfile(file)
  if chunk then return chunk end
  local text = source.read(file) or ""
  if text:find "[%z\1-\8\14-\26\28-\31]" then
    failure.raise(exit_usage, file .. " is not a Lua script: it has bytes that are not text")
  end
  if text:find '"limax.robot/1"' then
    failure.raise(exit_usage, ("%s is a robot file, not a script: in a script, limax.robot %q reads"
      .. " it; limax modes and limax picture take the file"):format(file, file))
  end
  failure.raise(exit_failed, (file:match "%.lua$" and "" or file .. " is not a Lua script: ")
    .. script.syntax_error(file, text, message))
end

--- The compiled file. From now on `require` also finds Lua files in its folder.
function script.load(file)
  local kind = host.file.exists(file)
  if not kind or kind == "folder" then
    local what = kind and "%s is a folder, not a script" or "there is no file %s"
    failure.raise(exit_usage, what:format(file))
  end
  local chunk = script.compile(file)
  local folder = file:match "^(.*)/[^/]*$" or "."
  package.path = ("%s/?.lua;%s/?/init.lua"):format(folder, folder)
  return chunk
end

-- The value that a file returns; more would be ignored.
local function only_one(file, value, more)
  if more ~= nil then
    failure.raise(exit_usage,
      ("%s returns several values: return one experiment, and put others into files of their own")
      :format(file))
  end
  return value
end

--- Runs a file with `...` as its arguments, also in the global `arg`.
---@return any what the file returns
function script.run(file, ...)
  local chunk = script.load(file)
  rawset(_G, "arg", { [0] = file, ... })
  return only_one(file, chunk(...))
end

return script
