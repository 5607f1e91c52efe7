--- session.lua: the prompt: reads lines, runs them, and shows values or errors. Without a terminal
--- there is no banner and no prompt, and the first error ends it.

local chunk = require "limax.tools.repl.chunk"
local failure = require "limax.base.failure"
local help = require "limax.tools.repl.help"
local host = require "limax.host"
local names = require "limax.tools.repl.names"
local output = require "limax.base.output"
local show = require "limax.tools.repl.show"

local session = {}

local exit_failed = 1

-- The line of a text that a message is about, if there are several; `first` is the first number.
local function line_of(text, message, first)
  local number = text:find("\n", 1, true) and tostring(message):match "^input:(%d+):"
  local at = first
  for line in (number and text .. "\n" or ""):gmatch "([^\n]*)\n" do
    if at == tonumber(number) then return ("\n  %d | %s"):format(at, line) end
    at = at + 1
  end
  return ""
end

local function report(text, message, trace, first_line)
  io.stdout:flush()
  local first, frames = failure.text(message, trace):match "^([^\n]*)(.*)$"
  output.warn(first, line_of(text, message, first_line), frames, "\n")
end

-- Calls a function of a typed text and reports its error: false after one, with the interrupt if it
-- was one.
local function attempt(text, first, call, ...)
  local fine, value, trace = host.protect(call, ...)
  if fine then return true end
  if value == host.interrupt then return false, value end
  report(text, value, trace, first)
  return false
end

-- Runs a chunk and shows its values.
local function evaluate(compiled)
  names.declare(compiled.names)
  compiled.call(function(...)
    local count = select("#", ...)
    if count == 0 then return end
    if (...) ~= nil then names.remember((...)) end
    if not compiled.muted then output.write(show.values(count, ...), "\n") end
  end)
end

--- Runs a text as if it were typed: false after an error, nil if it is incomplete.
---@param first integer number of its first line
local function take(text, first)
  local topic = text:match "^%s*%?(.*)$"
  if topic then return attempt(text, first, help.show, topic) end
  local compiled, message, incomplete = chunk.compile(text, names.environment, "=input", first)
  if compiled then return attempt(text, first, evaluate, compiled) end
  if incomplete then return nil end
  report(text, message, message, first)
  return false
end

-- A line of the terminal, nil at its end; `before` is the beginning of an incomplete statement.
local function read(before)
  local prompt = before and ".. " or "> "
  if host.terminal().stdout then
    local function complete(typed)
      return require("limax.tools.repl.complete").edit(before and before .. "\n" .. typed or typed)
    end
    return host.line_editor.read(prompt, complete)
  end
  output.write(prompt)
  io.flush()
  return io.read "*l"
end

--- The prompt, to its end.
function session.talk()
  local editor, history = host.line_editor, require "limax.tools.repl.history"
  output.write(("limax %s. ? for help, Ctrl-D ends, Ctrl-C interrupts.\n"):format(host.version))
  for _, entry in ipairs(history.open()) do editor.remember(entry) end
  local text
  while true do
    local fine, line = host.protect(read, text)
    if not fine then
      if line ~= host.interrupt then error(line, 0) end
      -- Ctrl-C at the prompt discards the statement
      output.write("\n")
      if not host.signal.rearm() then return host.signal.status() end
      text = nil
    elseif line == nil then
      output.write("\n")
      return 0
    else
      text = text and text .. "\n" .. line or line
      local done, interrupt = take(text, 1)
      if interrupt then
        output.warn("interrupted\n")
        if not host.signal.rearm() then return host.signal.status() end
      end
      if done ~= nil then
        if history.add(text) then editor.remember(text) end
        text = nil
      end
    end
  end
end

--- Runs lines as if they were typed; the first error ends it.
---@param lines fun(): string|nil
function session.take_all(lines)
  local text
  local number, first = 0, 1
  for line in lines do
    number = number + 1
    -- a byte order mark
    if number == 1 then line = line:gsub("^\239\187\191", "") end
    if not text then first = number end
    text = text and text .. "\n" .. line or line
    local fine, interrupt = take(text, first)
    if fine == false then return interrupt and host.signal.status() or exit_failed end
    if fine then text = nil end
  end
  if not text then return 0 end
  output.warn(("input:%d: the statement that begins here is not complete\n"):format(first))
  return exit_failed
end

return session
