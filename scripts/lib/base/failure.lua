--- failure.lua: raising and catching limax.error (bindings/engine/fault.lua). An error with an exit
--- status is for the user to read: 2 for usage and configuration, 1 for everything else that ends a
--- command. An error without one is a defect of a script, shown with its traceback.

local fault = require "limax.engine.fault"
local host = require "limax.host"

local failure = {}

-- "FILE:LINE: " of a stack level, 1 being the caller of this function; "" for a C function.
local function place_of(level)
  local info = debug.getinfo(level + 1, "Sl")
  if not info or info.currentline < 1 then return "" end
  return ("%s:%d: "):format(info.short_src, info.currentline)
end

--- Raises a failure.
---@param status integer exit status of a command that this ends: 2 usage or configuration, else 1
---@param place? integer|string a level as for `error`: 2 names the caller's line; or "FILE:LINE: "
function failure.raise(status, message, place)
  if type(place) == "number" then place = place > 0 and place_of(place + 1) or nil end
  fault.throw { kind = status == 2 and "usage" or "failed", status = status, text = message,
    place = place }
end

--- Raises a failure of this machine, with exit status 1.
---@param kind "memory"|"device"|"disk"|"defect"
function failure.raise_machine(kind, message)
  fault.throw { kind = kind, status = 1, text = message }
end

--- Raises a failure of a file that is damaged or not limax's, with exit status 1.
function failure.raise_damaged(message)
  fault.throw { kind = "damaged", status = 1, text = message }
end

--- Calls a function with a value of a file; its errors are reported as damage of the file.
---@param where string file and line
---@param ... any arguments
---@return any ... results
function failure.about(where, call, ...)
  local ok, value = failure.attempt(call, ...)
  if ok then return value end
  if failure.of_machine(value) then error(value, 0) end
  local message = failure.bare(value)
  if message:sub(1, #where) == where then message = message:sub(#where + 3) end
  -- a damaged file may contain anything, but no control character is shown
  failure.raise_damaged(("%s: %s"):format(where, (message:gsub("%c", "?"))))
end

--- Was it raised for a file that is damaged?
function failure.is_damaged(value) return fault.is(value) and value.kind == "damaged" end

--- The exit status of a failure; nil for any other error value.
function failure.status(value) return fault.is(value) and value.status or nil end

local MACHINE = { memory = true, device = true, disk = true, defect = true }

--- The part of this machine that failed: "memory" or "disk" that is full, a "device" that is
--- unavailable or failed, a "defect" of the engine; nil for an error that script or input caused.
function failure.of_machine(value)
  return fault.is(value) and MACHINE[value.kind] and value.kind or nil
end

--- Does a path or a frame of a traceback name a file of limax itself? Lua shortens a long path to
--- its end, ".../limax/scripts/lib/main.lua".
function failure.is_ours(text)
  local home, shortened = host.home, text:match "^%s*%.%.%.([^:]*)" or ""
  for _, folder in ipairs { "/bindings/", "/scripts/lib/", "/scripts/commands/" } do
    local at = shortened:find(folder, 1, true)
    if text:find(home .. folder, 1, true)
      or at and home:sub(#home - at + 2) == shortened:sub(1, at - 1) then
      return true
    end
  end
  return false
end

--- A message without its place where that is a file of limax itself, which does not help a user.
function failure.bare(message)
  if fault.is(message) then
    return failure.is_ours(message.place) and message.text or tostring(message)
  end
  local text = tostring(message)
  local file, rest = text:match "^([^\n:]+):%d+: (.*)$"
  return file and failure.is_ours(file) and rest or text
end

local function trace(value)
  if value == host.interrupt then return { value = value } end
  local lines = { failure.bare(value) }
  for frame in debug.traceback("", 2):gmatch "\n(\t[^\n]+)" do
    -- functions of C and of LuaJIT have no line, and a deep stack is cut in its middle
    local in_lua = not frame:match "^%s*%[C%]" and not frame:match "^%s*%[builtin"
      and frame ~= "\t..."
    if in_lua and not failure.is_ours(frame) then lines[#lines + 1] = frame end
  end
  return { value = value, trace = table.concat(lines, "\n") }
end

local function finish(ok, ...)
  if ok then return true, ... end
  local caught = ...
  -- without enough memory the handler fails, and the error value comes as it is
  if type(caught) ~= "table" then return false, caught, tostring(caught) end
  if caught.value == host.interrupt then error(caught.value, 0) end
  return false, caught.value, caught.trace
end

--- pcall that does not catch an interrupt. The third result of a failed call is the traceback of
--- where the error was raised.
function failure.attempt(call, ...)
  return finish(xpcall(call, trace, ...))
end

--- Calls `call`, then `last`, also after an error or an interrupt, which it then raises.
function failure.finally(last, call)
  local uninterrupted, ok, problem, traceback = host.protect(failure.attempt, call)
  last()
  if not uninterrupted then error(ok, 0) end
  if not ok then failure.raise_again(problem, traceback) end
end

-- user function -> how a message names it
local names = setmetatable({}, { __mode = "k" })

local function named(role, call)
  if not names[call] then
    local info = debug.getinfo(call, "S")
    names[call] = ("%s (%s:%d)"):format(role, info.source:gsub("^@", ""), info.linedefined)
  end
  return names[call]
end

local function unwatched(before, role, ...)
  host.signal.watch(before)
  host.role = role
  return ...
end

--- `attempt` of a user's function that may take long: the host reports one that runs for 5 s, and
--- Ctrl-C names it. It cannot read the clock.
---@param role string "the fitness"
function failure.attempt_watched(role, call, ...)
  local before, role_before = host.signal.watch(named(role, call)), host.role
  host.role = role
  return unwatched(before, role_before, failure.attempt(call, ...))
end

--- The same with a time limit: a function that takes longer is stopped, which counts as an error.
function failure.attempt_within(seconds, call, ...)
  return finish(host.within(seconds, trace, call, ...))
end

--- Seconds until `failure.attempt_user` stops a function: a thousand times what a supervisor needs
--- to read a history.
failure.USER_SECONDS = 5

--- The same for a user's function that must not stop a run, such as a supervisor.
function failure.attempt_user(call, ...)
  return failure.attempt_within(failure.USER_SECONDS, call, ...)
end

--- Raises what `failure.attempt` caught, and keeps its traceback.
function failure.raise_again(value, traceback)
  if fault.is(value) then
    value.traceback = traceback
  elseif type(value) == "string" then
    fault.throw { kind = "script", text = value, traceback = traceback }
  end
  error(value, 0)
end

--- The traceback of an error that was raised again; nil for others.
function failure.first_trace(value) return fault.is(value) and value.traceback or nil end

--- An error's message and traceback, without the frames of limax unless limax itself failed.
---@param traceback string as from `host.protect`
function failure.text(value, traceback)
  local first, frames = (failure.first_trace(value) or traceback):match "^([^\n]*)(.*)$"
  if failure.bare(first) ~= first then return first .. frames end
  return first .. frames:gsub("\n  ([^\n]*)", function(frame)
    local place = frame:gsub(": in ", ": ", 1)
    return failure.bare(place) ~= place and "" or nil
  end)
end

return failure
