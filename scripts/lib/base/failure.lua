--- failure.lua: errors that are the user's to read, not a defect's trace. They are plain strings,
--- raised with `error`, whose exit status is remembered here: 2 for usage and configuration, 1 for
--- everything else that ends a command.

local host = require "limax.host"

local failure = {}

-- message -> exit status of every failure raised so far
local statuses = {}

--- Where the caller's caller stands, as "FILE:LINE: "; empty where there is no such line (a C
--- function, the end of the stack).
---@param level integer 1 is the function that calls `place`
---@return string
function failure.place(level)
  local info = debug.getinfo(level + 1, "Sl")
  if not info or info.currentline < 1 then return "" end
  return ("%s:%d: "):format(info.short_src, info.currentline)
end

--- Raises a failure. `level` as for `error`: 2 names the caller's line; 0 or nil names none.
---@param status integer exit status of a command that this ends: 2 usage or configuration, else 1
---@param message string
---@param level? integer
function failure.raise(status, message, level)
  -- one further: `raise` itself stands between
  if level and level > 0 then message = failure.place(level + 1) .. message end
  statuses[message] = status
  error(message, 0)
end

--- The exit status of a failure; nil for any other error value, which is a defect of a script.
---@param value any
---@return integer|nil
function failure.status(value)
  return type(value) == "string" and statuses[value] or nil
end

-- message -> what failed on this machine
local machine = {}

--- Remembers that an error is the machine's: "memory" that it has not, a "device" that is not to be
--- had or that failed, a "disk" that takes no more, a "defect" of the engine. nil: it is not.
---@param message string
---@param what "memory"|"device"|"disk"|"defect"|nil
function failure.note_machine(message, what) machine[message] = what end

--- What failed on this machine; nil for an error that script or input are to blame for.
---@param value any
---@return "memory"|"device"|"disk"|"defect"|nil
function failure.of_machine(value)
  return type(value) == "string" and machine[value] or nil
end

-- Is a path or a frame of a traceback in limax's own code? That tells a user nothing.
local function is_ours(text)
  for _, folder in ipairs { "/bindings/", "/scripts/lib/", "/scripts/commands/" } do
    if text:find(host.home .. folder, 1, true) then return true end
  end
  return false
end

--- A message without the "FILE:LINE: " that `error` put before it where that place is a file of
--- limax itself, which tells a user nothing.
---@param message any
---@return string
function failure.bare(message)
  local text = tostring(message)
  local file, rest = text:match "^([^\n:]+):%d+: (.*)$"
  if file and is_ours(file) then return rest end
  return text
end

local function trace(value)
  if value == host.interrupt then return { value = value } end
  local lines = { failure.bare(value) }
  for frame in debug.traceback("", 2):gmatch "\n(\t[^\n]+)" do
    if not frame:match "^%s*%[C%]" and not is_ours(frame) then lines[#lines + 1] = frame end
  end
  return { value = value, trace = table.concat(lines, "\n") }
end

local function finish(ok, ...)
  if ok then return true, ... end
  local caught = ...
  -- an error inside the handler itself (out of memory, say) arrives bare
  if type(caught) ~= "table" then return false, caught, tostring(caught) end
  if caught.value == host.interrupt then error(caught.value, 0) end
  return false, caught.value, caught.trace
end

--- pcall that an interrupt passes through: what a user's function may throw is caught, Ctrl-C is
--- not. The error value of a failed call comes with the traceback of the place where it was raised
--- as third result.
---@param call function
---@param ... any
---@return boolean ok
---@return any result_or_error
---@return any ...
function failure.attempt(call, ...)
  return finish(xpcall(call, trace, ...))
end

--- The same for a function that must come back: after so many seconds it is stopped, which counts
--- as an error.
---@param seconds number
---@param call function
---@param ... any
---@return boolean ok
---@return any result_or_error
---@return any ...
function failure.attempt_within(seconds, call, ...)
  return finish(host.within(seconds, trace, call, ...))
end

-- message -> the traceback of where it was raised first
local traces = {}

--- Raises what `failure.attempt` caught, with the traceback that it had.
---@param value any
---@param traceback string|nil
function failure.raise_again(value, traceback)
  if type(value) == "string" then traces[value] = traceback end
  error(value, 0)
end

--- The first traceback of an error that was raised again; nil for others.
---@param value any
---@return string|nil
function failure.first_trace(value) return type(value) == "string" and traces[value] or nil end

return failure
