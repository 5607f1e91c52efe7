--- scoring.lua: calls a user's fitness function and handles its errors. In the first generation an
--- error or a value that is not a number stops the run: the script is wrong. In later ones, and for
--- NaN or infinity always, only that robot fails; more than a tenth of a generation stops the run.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local record_rules = require "limax.settings.record_rules"
local schema = require "limax.engine.schema"

local scoring = {}

--- Share of a generation that may fail in the fitness before the run stops.
scoring.most_failed = 0.1

-- NaN is not equal to itself
local function is_finite(value)
  return value == value and math.abs(value) <= record_rules.LARGEST_SCORE
end

-- Shows a number that is not finite, or too large to be summed, and explains how a script gets it.
local function refused(value)
  if value ~= value then
    return "nan, not a number: a division 0/0, or math.sqrt or math.log of a negative number"
  elseif math.abs(value) == math.huge then
    return tostring(value) .. ": a division by 0"
  end
  return tostring(value) .. ", which is beyond 1e150"
end

-- Describes the problem of an entry of a fitness's second result, which has `count` cases; nil if
-- it has none.
local function fault(key, number, count)
  local is_case = type(key) == "number"
  local problem, excusable
  if is_case and (key < 1 or key > count or key ~= math.floor(key)) then
    problem = (" is beyond its %d cases: a list has no gaps"):format(count)
  elseif not is_case and not tostring(key):find "^[%a_][%w_]*$" then
    problem = ": a name has only letters, digits and _"
  elseif type(number) ~= "number" then
    problem = (" is %s, expected a number"):format(schema.show(number))
  elseif not is_finite(number) then
    problem, excusable = " is " .. refused(number), true
  else
    return nil
  end
  local what = is_case and ("case %s"):format(key) or ("measure %s"):format(schema.show(key))
  return ("the fitness's %s%s"):format(what, problem), excusable
end

-- Describes the problem of a fitness's results; nil if they have none. NaN and infinity are
-- `excusable`: they come from a robot, not from the script.
local function complaint(value, extra)
  if value == nil then
    return "the fitness returned nil, expected a number; does every path of it end in `return`?"
  elseif type(value) ~= "number" then
    return "the fitness returned " .. schema.show(value) .. ", expected a number"
  elseif not is_finite(value) then
    return "the fitness returned " .. refused(value), true
  elseif extra ~= nil and type(extra) ~= "table" then
    return "the fitness's second result is " .. schema.show(extra)
      .. ", expected a table of cases (a list of numbers) and measures (numbers with names);"
      .. " parentheses keep only the first: return (robot:strain())"
  end
  if extra == nil then return nil end
  -- sorted, so that the first message is the same in every process
  for _, key in ipairs(choice.sorted_keys(extra)) do
    local message, excusable = fault(key, extra[key], #extra)
    if message then return message, excusable end
  end
end

--- The parts of a fitness's second result: the list of cases and the named measures; nil for an
--- empty one.
function scoring.parts(extra)
  if not extra then return nil, nil end
  local cases, measures = {}, {}
  for key, number in pairs(extra) do
    if type(key) == "number" then cases[key] = number else measures[key] = number end
  end
  return #cases > 0 and cases or nil, next(measures) and measures or nil
end

-- FILE:LINE where a fitness begins.
local function at(call)
  local info = debug.getinfo(call, "S")
  return ("%s:%d"):format(info.short_src, info.linedefined)
end

-- "FILE:LINE: " of a fitness, unless a text begins with a place: a tail call leaves none.
local function place_of(call, text)
  if text:find "^[^%s:]+:%d+: " then return "" end
  return ("in the function at %s: "):format(at(call))
end

--- Calls a fitness for one robot: its two results, or `nil, nil, message, excusable`. The message
--- of an error comes with its traceback as fifth result.
---@param state table|nil of the run's scripts
---@param ours? boolean is it one of the library, which takes no time?
function scoring.call(call, robot, state, ours)
  local ok, value, extra
  if ours then
    ok, value, extra = failure.attempt(call, robot)
  else
    ok, value, extra = failure.attempt_watched("the fitness", call, robot, state)
  end
  -- a fitness may simulate, and the device fail
  if not ok and failure.of_machine(value) then error(value, 0) end
  if not ok then
    local text, trace = failure.bare(value), tostring(extra)
    local place = place_of(call, text)
    local message = "the fitness failed: " .. place
    return nil, nil, message .. text, false, message .. trace
  end
  local message, excusable = complaint(value, extra)
  if message then
    return nil, nil, ("%s (%s)"):format(message, at(call)), excusable
  end
  return value, extra
end

---@class scoring.request
---@field call function the fitness
---@field ours boolean is it one of the library?
---@field robots table[] objects handed to the fitness
---@field rows limax.row[] theirs; fitness, cases, measures, status and reason are written here
---@field wanted integer[] robots to score, in order
---@field count integer robots of the generation
---@field generation integer
---@field state table|nil of the run's scripts
---@field measure? fun(robot: table, row: limax.row): string|nil, boolean|nil, string|nil adds to
--- the row what an archive or a survival needs; message, excusable and trace of a failure

---@class scoring.failure
---@field index integer of the robot
---@field id integer
---@field message string
---@field excusable boolean|nil does it come from the robot, not from the script?
---@field trace string|nil

-- Must the run stop at a failure in the fitness, the n-th of a generation?
local function is_fatal(failed, n, generation, robots)
  return generation == 0 and not failed.excusable or n > scoring.most_failed * robots
end

--- Scores the robots that ended well, until the run must stop.
---@return scoring.failure[] failures for `scoring.judge`
function scoring.score(request)
  local failures = {}
  for _, i in ipairs(request.wanted) do
    local row = request.rows[i]
    if row.status == "done" then
      local value, extra, message, excusable, trace =
        scoring.call(request.call, request.robots[i], request.state, request.ours)
      row.fitness = value
      row.cases, row.measures = scoring.parts(extra)
      local reason = "fitness"
      if not message and request.measure then
        reason, message, excusable, trace = "measure", request.measure(request.robots[i], row)
      end
      if message then
        row.status, row.reason, row.fitness = "failed", reason, nil
        local failed = { index = i, id = row.id, message = message, excusable = excusable,
          trace = trace }
        failures[#failures + 1] = failed
        if is_fatal(failed, #failures, request.generation, request.count) then break end
      end
    end
  end
  return failures
end

--- Reports robots that failed in the fitness. Raises a failure with status 1 where the run must
--- stop.
---@param count integer robots of the generation
---@param say fun(text: string, key: string) called for every robot that fails; `key` is the part of
--- the text that names no robot and no generation
function scoring.judge(failures, count, generation, say)
  for n, failed in ipairs(failures) do
    local id, message = failed.id, failed.message
    local fatal = is_fatal(failed, n, generation, count)
    if fatal and generation == 0 and not failed.excusable then
      failure.raise(1, ("robot %s of the first generation: %s"):format(id, failed.trace or message))
    end
    say(("robot %s of generation %d gets no score: %s"):format(id, generation, message), message)
    if fatal then
      failure.raise(1, ("more than a tenth of generation %d (%d of %d robots so far) failed in"
        .. " the fitness, the first was robot %s, the last robot %s: %s"):format(generation, n,
        count, failures[1].id, id, message))
    end
  end
end

return scoring
