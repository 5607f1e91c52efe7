--- repl.lua: `limax repl`: a prompt for Lua. Reads lines from a terminal, a pipe or files.

local failure = require "limax.base.failure"
local host = require "limax.host"
local load_file = require "limax.tools.repl.load"
local names = require "limax.tools.repl.names"
local output = require "limax.base.output"
local session = require "limax.tools.repl.session"
local user_folder = require "limax.base.user_folder"
require "limax.tools.repl.words"

-- The start-up file, if it exists.
local function startup_file()
  local folder = user_folder "XDG_CONFIG_HOME"
  local path = folder and folder .. "/repl.lua"
  return path and host.file.exists(path) == "file" and path or nil
end

local function run_startup_file()
  local path = startup_file()
  if not path then return end
  local fine, value, trace = host.protect(load_file, path)
  if fine then return end
  if value == host.interrupt then error(value, 0) end
  output.warn(failure.status(value) and tostring(value) or trace, "\n")
end

local function once(text)
  return function()
    local line = text
    text = nil
    return line
  end
end

return {
  summary = "a prompt for Lua",
  usage = "limax repl [options] [FILE.lua ...]",
  text = "Type an expression to see its value, or a statement; an incomplete one continues after\n"
    .. "`..`. A trailing ; mutes. Names need no `local`. `_` is the last value.\n"
    .. "`limax` is loaded; ?name describes a name, ? lists all topics. Tab completes.\n"
    .. "Files run first; their names remain defined, and the return value of the last one is `_`.\n"
    .. "Ctrl-C interrupts.\n\n"
    .. "`limax repl < FILE`, or a pipe, runs lines as if they were typed, without a prompt; the\n"
    .. "first error, named with its line, ends it with status 1. The history is in\n"
    .. "limax/history below $XDG_STATE_HOME (~/.local/state); limax/repl.lua below\n"
    .. "$XDG_CONFIG_HOME (~/.config) runs before the first prompt.",
  options = {
    { name = "execute", short = "e", argument = "CODE", many = true,
      text = "run CODE as if it were typed, and end" },
    { name = "load", short = "l", argument = "MODULE", many = true,
      text = "require a module first, as a name at the prompt" },
    { name = "interactive", short = "i", text = "prompt also after -e" },
    { name = "bare", text = "do not run the start-up file" },
  },
  positional = { name = "FILE.lua" },
  run = function(arguments)
    -- `require` finds modules in the working folder
    package.path = "./?.lua;./?/init.lua"
    local terminal = host.terminal().stdin
    local ends = #arguments.execute > 0 and not arguments.interactive
    if terminal and not ends and not arguments.bare then run_startup_file() end
    for _, module in ipairs(arguments.load) do
      names.environment[module:match "[^.]*$"] = require(module)
    end
    for _, file in ipairs(arguments) do
      local value = load_file(file)
      if value ~= nil then names.remember(value) end
    end
    for _, code in ipairs(arguments.execute) do
      local status = session.take_all(once(code))
      if status ~= 0 then return status end
    end
    if ends then return 0 end
    if terminal then return session.talk() end
    return session.take_all(io.lines())
  end,
}
