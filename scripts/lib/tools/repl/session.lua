--- session.lua: the prompt: reads lines, runs them, and shows values or errors. Without a terminal
--- there is no banner and no prompt, and the first error ends it.

local chunk = require "limax.tools.repl.chunk"
local failure = require "limax.base.failure"
local follow = require "limax.tools.repl.follow"
local help = require "limax.tools.repl.help"
local host = require "limax.host"
local show = require "limax.tools.repl.show"
local tokens = require "limax.tools.repl.tokens"

local session = {}

local exit_failed, exit_interrupted = 1, 130

---@class limax.repl.session
---@field names limax.repl.names
---@field text string|nil the beginning of an incomplete statement
local Session = {}
Session.__index = Session

-- The line of a text that a message is about, if there are several; `first` is the first number.
local function line_of(text, message, name, first)
  local number = text:find("\n", 1, true)
    and tostring(message):match("^" .. name:sub(2) .. ":(%d+):")
  if not number then return "" end
  local at = first
  for line in (text .. "\n"):gmatch "([^\n]*)\n" do
    if at == tonumber(number) then return ("\n  %d | %s"):format(at, line) end
    at = at + 1
  end
  return ""
end

-- An explanation of some messages of Lua.
local function hint_of(message)
  if message == "stack overflow" then return ": a recursion does not end" end
  if message:find("local 'self'", 1, true) then
    return "; methods are called with a colon, as in robot:simulate()"
  end
  return ""
end

-- The frames of a traceback outside of limax, or all if limax itself failed.
local function frames_of(first, rest)
  if failure.bare(first) ~= first then return rest end
  return (rest:gsub("\n  ([^\n]*)", function(frame)
    return failure.bare(frame:gsub(": in ", ": ", 1)) ~= frame:gsub(": in ", ": ", 1) and "" or nil
  end))
end

local function report(text, message, trace, line)
  io.stdout:flush()
  local first, rest = (failure.first_trace(message) or trace):match "^([^\n]*)(.*)$"
  io.stderr:write(first, hint_of(first), line_of(text, message, "=input", line or 1),
    frames_of(first, rest), "\n")
end

--- Runs a chunk and shows its values. False after an error, with the interrupt if it was one.
---@param first integer|nil number of its first line
---@return boolean fine
---@return any interrupt
function Session:evaluate(compiled, text, first)
  self.names:declare(compiled.names)
  local function take(...)
    local count = select("#", ...)
    if count == 0 then return end
    if (...) ~= nil then self.names:remember((...)) end
    if not compiled.muted then io.write(show.values(count, ...), "\n") end
  end
  local fine, value, trace = host.protect(function() take(compiled.call(take)) end)
  if fine then return true end
  if value == host.interrupt then return false, value end
  report(text, value, trace, first)
  return false
end

--- Runs a text as if it were typed: false after an error, nil if it is incomplete.
---@param first integer|nil number of its first line, 1 if left out
---@return boolean|nil fine
---@return any interrupt
function Session:take(text, first)
  follow.refresh()
  local topic = text:match "^%s*%?(.*)$"
  if topic then
    local fine, value, trace = host.protect(help.show, topic, self.names)
    if not fine and value ~= host.interrupt then report(text, value, trace) end
    return fine, value == host.interrupt and value or nil
  end
  local compiled, message, incomplete = chunk.compile(text, self.names.environment, "=input",
    first)
  if compiled then return self:evaluate(compiled, text, first) end
  if incomplete then return nil end
  report(text, message, message, first)
  return false
end

-- Runs a changed script while the prompt is idle.
local function idle()
  if not follow.has_changed() then return false end
  io.write "\n"
  follow.refresh()
  io.flush()
  return true
end

-- A line of the terminal, nil at its end.
function Session:read(prompt)
  local editor = host.line_editor
  local facts = host.terminal()
  if editor and facts.stdout then return editor.read(prompt, self.complete, idle) end
  io.write(prompt)
  io.flush()
  return io.read "*l"
end

-- Adds a complete statement to the history.
function Session:remember(text)
  if self.history:add(text) and host.line_editor then host.line_editor.remember(text) end
end

function Session:begin()
  print(("limax %s. ? for help, Ctrl-D ends, Ctrl-C interrupts."):format(host.version))
  if not host.line_editor then
    print("Built without libedit: lines cannot be edited (try rlwrap limax repl)")
  end
  self.history = require("limax.tools.repl.history").open(function(text)
    io.stderr:write("limax: ", text, "\n")
  end)
  self.complete = function(before)
    local text = self.text and self.text .. "\n" .. before or before
    return require("limax.tools.repl.complete").edit(text, self.names)
  end
  if not host.line_editor then return end
  for _, entry in ipairs(self.history:entries()) do host.line_editor.remember(entry) end
end

--- The prompt, to its end.
---@return integer status
function Session:talk()
  self:begin()
  while true do
    local fine, line = host.protect(self.read, self, self.text and ".. " or "> ")
    if not fine then
      if line ~= host.interrupt then error(line, 0) end
      -- Ctrl-C at the prompt discards the statement
      host.signal.rearm()
      self.text = nil
      io.write("\n")
    elseif line == nil then
      io.write("\n")
      return 0
    else
      local text = self.text and self.text .. "\n" .. line or line
      self.text = text
      local done, interrupt = self:take(text)
      if interrupt then
        io.stderr:write("interrupted\n")
        host.signal.rearm()
      end
      if done ~= nil then
        self:remember(text)
        self.text = nil
      end
    end
  end
end

-- Tracks the depth of a statement of many lines: it is compiled only when all blocks and brackets
-- are closed, and not after each line.
local function depth_of(before, text, line)
  -- the content of a long string or comment is not code
  if not before or before.open then
    local depth, open = tokens.depth(text)
    return { depth = depth, open = open }
  end
  local depth, open = tokens.depth(line)
  return { depth = before.depth + depth, open = open }
end

--- Runs lines as if they were typed; the first error ends it.
---@param lines fun(): string|nil
---@return integer status
function Session:take_all(lines)
  local text, depth
  local number, first = 0, 1
  for line in lines do
    number = number + 1
    -- a byte order mark
    if number == 1 then line = line:gsub("^\239\187\191", "") end
    if not text then first = number end
    local began = text ~= nil
    text = began and text .. "\n" .. line or line
    depth = began and depth_of(depth, text, line) or nil
    if not (depth and depth.depth > 0) then
      local fine, interrupt = self:take(text, first)
      if fine == false then return interrupt and exit_interrupted or exit_failed end
      if fine then text = nil end
    end
  end
  if text then
    -- an error may precede the end
    if self:take(text, first) == false then return exit_failed end
    io.stderr:write(("input:%d: the statement that begins here is not complete\n"):format(first))
    return exit_failed
  end
  return 0
end

--- Runs a file: its top-level names remain defined, and its return value is `_`.
function Session:run_file(path)
  local value = follow.run(path, self.names)
  if value ~= nil then self.names:remember(value) end
end

--- A prompt with these names.
function session.new(names) return setmetatable({ names = names }, Session) end

return session
