--- repl.lua: `limax repl`: a prompt for Lua. Reads lines from the terminal, or a script from a pipe
--- or file.

local failure = require "limax.base.failure"
local follow = require "limax.tools.repl.follow"
local host = require "limax.host"
local names = require "limax.tools.repl.names"
local session = require "limax.tools.repl.session"
local words = require "limax.tools.repl.words"

-- The file that runs before the first prompt, if there is one.
local function startup_file()
  local given = os.getenv "XDG_CONFIG_HOME"
  local home = os.getenv "HOME"
  local folder = given and given:sub(1, 1) == "/" and given or home and home .. "/.config"
  local path = folder and folder .. "/limax/repl.lua"
  return path and host.file.exists(path) == "file" and path or nil
end

local function run_startup_file(known)
  local path = startup_file()
  if not path then return end
  local fine, value, trace = host.protect(follow.run, path, known)
  if fine then return end
  if value == host.interrupt then error(value, 0) end
  -- a prompt without it is better than none
  io.stderr:write(failure.status(value) and tostring(value) or trace, "\n")
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
  text = "Type an expression to see its value, or any statement; one that is not complete goes on\n"
    .. "after `..`. A trailing ; mutes. Names need no `local` here, and one that has it stays.\n"
    .. "`_` is the last value, `_1` the one before. `limax` is loaded; ?name tells what something\n"
    .. "is, ? alone what there is. Tab completes. Files run first; their names stay, and what the\n"
    .. "last one returns is `_`. Ctrl-C stops what runs.\n\n"
    .. "From a pipe: no prompt, and the first error ends with status 1. History is kept in\n"
    .. "limax/history below $XDG_STATE_HOME (~/.local/state); limax/repl.lua below\n"
    .. "$XDG_CONFIG_HOME (~/.config) runs before the first prompt.",
  options = {
    { name = "execute", short = "e", argument = "CODE", many = true,
      text = "take CODE as if it were typed, and end" },
    { name = "load", short = "l", argument = "MODULE", many = true,
      text = "require a module first, under its own name" },
    { name = "interactive", short = "i", text = "prompt after -e too" },
    { name = "bare", text = "leave the start-up file out" },
  },
  positional = { name = "FILE.lua" },
  run = function(arguments)
    -- modules of the folder that one works in
    package.path = "./?.lua;./?/init.lua"
    local known
    known = names.new(words.of(function() return known end))
    local prompt = session.new(known)
    local terminal = host.terminal().stdin
    local ends = #arguments.execute > 0 and not arguments.interactive
    if terminal and not ends and not arguments.bare then run_startup_file(known) end
    for _, module in ipairs(arguments.load) do
      known.environment[module:match "[^.]*$"] = require(module)
    end
    for _, file in ipairs(arguments) do prompt:run_file(file) end
    for _, code in ipairs(arguments.execute) do
      local status = prompt:take_all(once(code))
      if status ~= 0 then return status end
    end
    if ends then return 0 end
    if terminal then return prompt:talk() end
    return prompt:take_all(io.lines())
  end,
}
