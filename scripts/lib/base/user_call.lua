--- user_call.lua: calls of user functions that must not stop a run: supervisors and the contexts of
--- prompts. Errors are caught, and a function that runs too long is stopped.

local failure = require "limax.base.failure"

local user_call = {}

--- Seconds until such a function is stopped: a thousand times what a supervisor needs to read a
--- history.
user_call.SECONDS = 5

--- Calls a function like `failure.attempt`.
---@return boolean ok
---@return any result_or_error
---@return any ...
function user_call.attempt(call, ...)
  return failure.attempt_within(user_call.SECONDS, call, ...)
end

return user_call
