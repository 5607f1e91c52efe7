--- repl.lua: `limax repl`: a prompt for Lua. Reads lines from the terminal, or a script from a pipe
--- or file.

local failure = require "limax.failure"
local host = require "limax.host"

local exit_failed, exit_interrupted = 1, 130

-- What is typed sees the locked globals, and may add its own names, which no module sees. `limax`
-- is there at once.
local function new_environment()
  return setmetatable({}, {
    __index = function(names, name)
      local value = rawget(_G, name)
      if value == nil and name == "limax" then
        value = require "limax"
        rawset(names, name, value)
      end
      if value == nil then error(("undefined name '%s'"):format(tostring(name)), 2) end
      return value
    end,
  })
end

-- a chunk that ends where its text should go on
local function is_incomplete(message) return message:match "near '?<eof>'?$" ~= nil end

-- The chunk of a text: as an expression first, so that its value is shown. Otherwise nil, message,
-- incomplete.
local function compile(text, environment)
  local chunk, as_expression = loadstring("return " .. text, "=input")
  local as_statement
  if chunk then
    -- a call after `return` is a tail call, whose errors would lose their line
    -- (the line break: for a text that ends in a comment)
    chunk = loadstring("(...)(" .. text .. ")", "=input")
      or loadstring("(...)(" .. text .. "\n)", "=input") or chunk
  else
    chunk, as_statement = loadstring(text, "=input")
  end
  if not chunk then
    return nil, as_statement, is_incomplete(as_expression) or is_incomplete(as_statement)
  end
  -- compiled traces check no hook: at the prompt Ctrl-C must always come through
  jit.off(chunk, true)
  return setfenv(chunk, environment)
end

local function show(...)
  local count = select("#", ...)
  if count == 0 then return end
  local texts = {}
  for i = 1, count do
    local value = select(i, ...)
    texts[i] = type(value) == "string" and ("%q"):format(value) or tostring(value)
  end
  io.write(table.concat(texts, "\t"), "\n")
end

local function read_line(prompt)
  io.write(prompt)
  io.flush()
  return io.read "*l"
end

local function report(value, trace)
  io.stdout:flush()
  io.stderr:write(failure.status(value) and value or trace, "\n")
end

-- Runs one chunk and shows its values. False after an error; the interrupt is passed on as it is.
local function evaluate(chunk)
  local fine, value, trace = host.protect(function() show(chunk(show)) end)
  if fine then return true end
  if value == host.interrupt then return false, value end
  report(value, trace)
  return false
end

local function talk(environment)
  print(("limax %s. Ctrl-D ends, Ctrl-C stops what runs."):format(host.version))
  local text
  while true do
    local fine, line = host.protect(read_line, text and ".. " or "> ")
    if not fine then
      -- Ctrl-C at the prompt drops what was typed
      host.signal.rearm()
      text = nil
      io.write("\n")
    elseif line == nil then
      io.write("\n")
      return 0
    else
      text = text and text .. "\n" .. line or line
      local chunk, message, incomplete = compile(text, environment)
      if chunk then
        local _, interrupt = evaluate(chunk)
        if interrupt then
          io.stderr:write("interrupted\n")
          host.signal.rearm()
        end
        text = nil
      elseif not incomplete then
        report(message, message)
        text = nil
      end
    end
  end
end

-- without a terminal: no banner, no prompt, and the first error ends it
local function read_all(environment)
  local text
  for line in io.lines() do
    text = text and text .. "\n" .. line or line
    local chunk, message, incomplete = compile(text, environment)
    if chunk then
      local fine, interrupt = evaluate(chunk)
      if not fine then return interrupt and exit_interrupted or exit_failed end
      text = nil
    elseif not incomplete then
      report(message, message)
      return exit_failed
    end
  end
  if text then
    io.stderr:write("input: the last statement is not complete\n")
    return exit_failed
  end
  return 0
end

return {
  summary = "a prompt for Lua",
  usage = "limax repl",
  text = "Type an expression to see its value, or any statement; one that is not complete goes on\n"
    .. "after `..`. Names need no `local` here. From a pipe: no prompt, and the first error ends\n"
    .. "with status 1.",
  options = {},
  run = function()
    local environment = new_environment()
    if host.terminal().stdin then return talk(environment) end
    return read_all(environment)
  end,
}
