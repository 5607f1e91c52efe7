--- user_call.lua: calls of a user's own functions that may not hold up a run: supervisors and the
--- contexts of prompts. They run in the main state, with all that it can do; what they throw is
--- caught, and one that does not come back is stopped.

local failure = require "limax.base.failure"

local user_call = {}

--- Seconds until such a function is stopped: a thousand times what a supervisor takes that looks
--- through a history.
user_call.SECONDS = 5

--- Calls a function as `failure.attempt` does.
---@param call function
---@param ... any
---@return boolean ok
---@return any result_or_error
---@return any ...
function user_call.attempt(call, ...)
  return failure.attempt_within(user_call.SECONDS, call, ...)
end

return user_call
