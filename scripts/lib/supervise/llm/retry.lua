--- retry.lua: which failed attempts are repeated and after how long (the rules of openai-python),
--- and the breaker: for how many generations a dead endpoint is not asked. Times in seconds.

local retry = {}

-- ---- attempts -----------------------------------------------------------------------------------

local MOST = 2 -- retries after the first attempt
local FIRST = 0.5 -- the wait before the first retry; it doubles
local SHORTENED = 0.25 -- by up to this share at random, so that clients do not retry together
local LONGEST_ASKED = 120 -- a longer wait that a server asks for is a failure
local LEAST_ATTEMPT = 1 -- with less time left an attempt could only fail

-- Statuses, with 500 and above, and kinds of failure of host.http. A certificate, an encoding or a
-- size would fail again.
local REPEATED = { [408] = true, [409] = true, [429] = true, resolve = true, connect = true,
  connect_timeout = true, timeout = true, reset = true, partial = true, tls = true }

-- A decimal number; not "0x10", "inf" or "nan", which tonumber would take.
local function decimal(text)
  return text and text:find "^%s*[-+]?[%d.]+[eE]?[-+]?%d*%s*$" and tonumber(text) or nil
end

-- Seconds that the server asks to wait; nil where it does not ask.
local function asked(headers)
  local milliseconds = decimal(headers["retry-after-ms"])
  local seconds = milliseconds and milliseconds / 1000 or decimal(headers["retry-after"])
  return seconds and seconds > 0 and seconds < math.huge and seconds or nil
end

local function is_repeated(outcome)
  local should_retry, class = outcome.headers["x-should-retry"], outcome.class
  if should_retry == "true" then return true end
  if should_retry == "false" or class == "quota" or class == "context" then return false end
  if outcome.kind then return REPEATED[outcome.kind] end
  return class ~= "envelope" and (REPEATED[outcome.status] or outcome.status >= 500)
end

--- How long to wait before a failed attempt is repeated; nil if it is not, and perhaps why.
---@param outcome { class: string, kind: string|nil, status: integer|nil,
--- headers: table<string, string> }
---@param made { retries: integer, timeouts: integer } so far
---@param left number seconds of the budget
---@param random number from 0 to 1
---@return number|nil seconds
---@return string|nil reason
function retry.wait(outcome, made, left, random)
  if not is_repeated(outcome) then return nil end
  if made.retries == MOST then return nil, ("%d attempts failed"):format(MOST + 1) end
  -- each takes the whole time limit of an attempt
  if made.timeouts == 2 then return nil, "two attempts timed out" end
  local seconds = asked(outcome.headers)
    or FIRST * 2 ^ made.retries * (1 - SHORTENED * random)
  if seconds > LONGEST_ASKED then
    return nil, ("the server asks to wait %.0f s, more than %d"):format(seconds, LONGEST_ASKED)
  end
  if seconds + LEAST_ATTEMPT > left then return nil, "no time is left for another attempt" end
  return seconds
end

-- ---- the breaker --------------------------------------------------------------------------------

-- After so many failed generations in a row an endpoint is not asked for 5 generations, then 10,
-- 20, 40 and 80; between them one short probe is sent. Time is counted in generations of everyone
-- who asks, since the repetitions of an experiment may share a breaker.
local PATIENCE = 3
local FIRST_PAUSE, LONGEST_PAUSE = 5, 80

---@class limax.llm.breaker plain values
---@field tick integer generations seen
---@field failures integer generations in a row that failed
---@field length integer generations of the last pause; 0: the breaker is closed
---@field probe_at integer tick of the next probe
---@field failed_at integer tick of the last failure

function retry.breaker()
  return { tick = 0, failures = 0, length = 0, probe_at = 0, failed_at = 0 }
end

--- Another client begins: an open breaker sends its probe at once.
function retry.begin(breaker)
  if breaker.length > 0 then breaker.probe_at = math.min(breaker.probe_at, breaker.tick + 1) end
end

--- Enters a generation, `passed` after the last one; 0 for another question of the same.
---@param passed integer
---@return "closed"|"open"|"probe"
---@return integer left generations until the probe
function retry.enter(breaker, passed)
  breaker.tick = breaker.tick + passed
  if breaker.length == 0 then return "closed", 0 end
  if breaker.tick >= breaker.probe_at then return "probe", 0 end
  return "open", breaker.probe_at - breaker.tick
end

--- The endpoint failed in this generation; several failures in one generation count once.
function retry.failed(breaker)
  if breaker.failed_at == breaker.tick then return end
  breaker.failed_at = breaker.tick
  breaker.failures = breaker.failures + 1
  if breaker.failures < PATIENCE then return end
  breaker.length = math.min(math.max(2 * breaker.length, FIRST_PAUSE), LONGEST_PAUSE)
  breaker.probe_at = breaker.tick + breaker.length + 1
end

--- The endpoint answered.
function retry.succeeded(breaker)
  breaker.failures, breaker.length, breaker.probe_at = 0, 0, 0
end

return retry
