--- scoring.lua: how a user's fitness function is called, and what becomes of a robot when it goes
--- wrong. In the first generation an error or a value that is no number stops the run: the script
--- is wrong. Later, and for NaN or infinity always, that robot fails; more than a tenth of a
--- generation stops the run too.

local failure = require "limax.failure"
local schema = require "limax.schema"

local scoring = {}

--- Share of a generation that may fail in the fitness before the run stops.
scoring.most_failed = 0.1

local function is_finite(value) return value == value and math.abs(value) < math.huge end

-- What is wrong with a fitness's results; nil when all is well. NaN and infinity are `excusable`:
-- they come from a robot, not from the script.
local function complaint(value, cases)
  if type(value) ~= "number" then
    return "the fitness returned " .. schema.show(value) .. ", expected a number"
  end
  if value ~= value then
    -- the usual cause: Lua 5.1 has no length operator for tables like ours
    return "the fitness returned nan (a trace's length is trace:size(); #trace is 0)", true
  end
  if not is_finite(value) then return "the fitness returned " .. tostring(value), true end
  if cases == nil then return nil end
  local size = schema.list_size(cases)
  if not size then
    return "the fitness's second result, its cases, is " .. schema.show(cases)
      .. ", expected a list of numbers or nothing"
  end
  for i = 1, size do
    if type(cases[i]) ~= "number" then
      return ("the fitness's case %d is %s, expected a number"):format(i, schema.show(cases[i]))
    end
    if not is_finite(cases[i]) then
      return ("the fitness's case %d is %s"):format(i, tostring(cases[i])), true
    end
  end
end

--- Calls a fitness for one robot: fitness and cases, or `nil, nil, message, excusable`. The message
--- of an error comes with its traceback as fifth result.
---@param call function
---@param robot table
---@return number|nil fitness
---@return number[]|nil cases
---@return string|nil message
---@return boolean|nil excusable
---@return string|nil trace
function scoring.call(call, robot)
  local ok, value, cases = failure.attempt(call, robot)
  -- a fitness may simulate: that the device failed is nothing that a robot is to blame for
  if not ok and failure.of_machine(value) then error(value, 0) end
  if not ok then return nil, nil, "the fitness failed: " .. tostring(value), false, cases end
  local message, excusable = complaint(value, cases)
  if message then return nil, nil, message, excusable end
  return value, cases
end

---@class scoring.request
---@field call function the fitness
---@field robots table[] objects handed to the fitness
---@field records table[] their records; fitness, cases, status and reason are written here
---@field wanted boolean[] which robots to score
---@field generation integer
---@field say fun(text: string, message: string) told of every robot that fails; `message` is the
--- part of the text that names no robot and no generation

--- Scores the robots that ended well. Raises a failure with status 1 where the run must stop.
---@param request scoring.request
function scoring.score(request)
  local failed = 0
  for i, record in ipairs(request.records) do
    if request.wanted[i] and record.status == "done" then
      local value, cases, message, excusable, trace = scoring.call(request.call, request.robots[i])
      record.fitness, record.cases = value, cases
      if message then
        if request.generation == 0 and not excusable then
          failure.raise(1, ("robot %s of the first generation: %s"):format(record.id,
            trace and "the fitness failed: " .. trace or message))
        end
        record.status, record.reason = "failed", "fitness"
        failed = failed + 1
        request.say(("robot %s of generation %d gets no score: %s"):format(record.id,
          request.generation, message), message)
        if failed > scoring.most_failed * #request.records then
          failure.raise(1, ("more than a tenth of generation %d (%d robots so far, of %d) failed"
            .. " in the fitness; last: %s"):format(request.generation, failed, #request.records,
            message))
        end
      end
    end
  end
end

return scoring
