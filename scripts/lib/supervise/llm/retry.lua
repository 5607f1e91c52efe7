--- retry.lua: which failed attempts are repeated and after how long (the rules of openai-python),
--- and for how many generations a dead endpoint is not asked. Times in seconds.

local source = require "limax.base.source"

local retry = {}

-- ---- attempts -----------------------------------------------------------------------------------

retry.MOST = 2 -- retries after the first attempt
retry.MOST_AFTER_TIMEOUT = 1 -- each takes the whole time limit of an attempt
local FIRST, LONGEST = 0.5, 8 -- waits double between these
local SHORTENED = 0.25 -- by up to this share at random, so that clients do not retry together
local LONGEST_ASKED = 120 -- a longer wait that a server asks for is a failure

-- 408 request timeout, 409 conflict, 429 too many requests; 500 and above as well
local STATUSES = { [408] = true, [409] = true, [429] = true }

-- Kinds of failure of host.http. A certificate, an encoding or a size would fail again.
local KINDS = { resolve = true, connect = true, connect_timeout = true, timeout = true,
  reset = true, partial = true, tls = true }

local MONTHS = { Jan = 1, Feb = 2, Mar = 3, Apr = 4, May = 5, Jun = 6, Jul = 7, Aug = 8, Sep = 9,
  Oct = 10, Nov = 11, Dec = 12 }

-- Days from 1970-01-01 to a day of the Gregorian calendar, years beginning in March.
local function days(year, month, day)
  if month <= 2 then year, month = year - 1, month + 12 end
  return 365 * year + math.floor(year / 4) - math.floor(year / 100) + math.floor(year / 400)
    + math.floor((153 * (month - 3) + 2) / 5) + day - 1 - 719468
end

-- Seconds since 1970 of a date of HTTP (RFC 9110, IMF-fixdate); nil for anything else.
local function seconds_of_date(text)
  local day, month, year, hours, minutes, seconds =
    text:match "^%a+, (%d%d) (%a%a%a) (%d%d%d%d) (%d%d):(%d%d):(%d%d) GMT$"
  if not MONTHS[month] then return nil end
  return days(tonumber(year), MONTHS[month], tonumber(day)) * 86400 + hours * 3600 + minutes * 60
    + seconds
end

-- A decimal number; not "0x10", "inf" or "nan", which tonumber would take.
local function decimal(text)
  return text and text:find "^%s*[-+]?[%d.]+[eE]?[-+]?%d*%s*$" and tonumber(text) or nil
end

-- Seconds that the server asks to wait; nil where it does not ask, or for a time that is past.
local function asked(headers, now)
  local milliseconds, text = decimal(headers["retry-after-ms"]), headers["retry-after"]
  local seconds = milliseconds and milliseconds / 1000 or decimal(text)
  if not seconds and text then
    local date = seconds_of_date(text)
    seconds = date and date - now
  end
  return seconds and seconds > 0 and seconds < math.huge and seconds or nil
end

--- Whether a failed attempt may be repeated at all.
---@param failure { class: string, kind: string|nil, status: integer|nil,
--- headers: table<string, string> }
function retry.wanted(failure)
  local should_retry = failure.headers["x-should-retry"]
  if should_retry == "true" then return true end
  if should_retry == "false" or failure.class == "quota" or failure.class == "context" then
    return false
  end
  if failure.kind then return KINDS[failure.kind] == true end
  local status = failure.status or 0
  return failure.class ~= "envelope" and (STATUSES[status] == true or status >= 500)
end

--- How long to wait before a retry; nil and a reason where the server asks for too much.
---@param number integer 1 for the first retry
---@param headers table<string, string>
---@param now number seconds since 1970
---@param random number from 0 to 1
---@return number|nil seconds
---@return string|nil reason
function retry.wait(number, headers, now, random)
  local seconds = asked(headers, now)
  if seconds and seconds > LONGEST_ASKED then
    return nil, ("the server asks to wait %.0f s, more than %d"):format(seconds, LONGEST_ASKED)
  end
  return seconds or math.min(FIRST * 2 ^ (number - 1), LONGEST) * (1 - SHORTENED * random)
end

-- ---- the breaker --------------------------------------------------------------------------------

-- After so many failed generations in a row an endpoint is not asked for 5 generations, then 10,
-- 20, 40 and 80; between them one short probe is sent. Time is counted in generations of everyone
-- who asks, since the repetitions of an experiment may share a breaker.
local PATIENCE = 3
local FIRST_PAUSE, LONGEST_PAUSE = 5, 80

---@class limax.llm.breaker.state
---@field tick integer generations seen
---@field failures integer generations in a row that failed
---@field length integer generations of the last pause; 0: the breaker is closed
---@field probe_at integer tick of the next probe
---@field failed_at integer tick of the last failure
---@field generation integer|nil the last one seen

---@class limax.llm.breaker
---@field values limax.llm.breaker.state
---@field asker table|nil who entered last
local Breaker = {}
Breaker.__index = Breaker

---@return limax.llm.breaker
function retry.breaker()
  return setmetatable({ values = { tick = 0, failures = 0, length = 0, probe_at = 0,
    failed_at = 0 } }, Breaker)
end

--- Enters a generation. Several questions may belong to one; without a number each question is its
--- own. Generations of another asker are different ones, even with equal numbers.
---@param generation integer|nil
---@param asker? table
---@return "closed"|"open"|"probe"
---@return integer left generations until the probe
function Breaker:enter(generation, asker)
  local values = self.values
  local same = self.asker == nil or self.asker == asker
  if generation == nil or generation ~= values.generation or not same then
    local passed = same and generation and values.generation and generation - values.generation or 1
    -- a client that serves several repetitions begins again at 0
    values.tick = values.tick + (passed > 0 and passed or 1)
    values.generation = generation
  end
  self.asker = asker
  if values.length == 0 then return "closed", 0 end
  if values.tick >= values.probe_at then return "probe", 0 end
  return "open", values.probe_at - values.tick
end

--- The endpoint failed in this generation; several failures in one generation count once.
function Breaker:failed()
  local values = self.values
  if values.failed_at == values.tick then return end
  values.failed_at = values.tick
  values.failures = values.failures + 1
  if values.failures < PATIENCE then return end
  values.length = values.length == 0 and FIRST_PAUSE or math.min(2 * values.length, LONGEST_PAUSE)
  values.probe_at = values.tick + values.length + 1
end

--- The endpoint answered.
function Breaker:succeeded()
  self.values.failures, self.values.length, self.values.probe_at = 0, 0, 0
end

--- Another repetition begins: an open breaker sends its probe at once.
function Breaker:begin()
  local values = self.values
  if values.length > 0 then values.probe_at = math.min(values.probe_at, values.tick + 1) end
end

--- Plain values, for a checkpoint.
---@return limax.llm.breaker.state
function Breaker:state() return source.copy(self.values) end

---@param state limax.llm.breaker.state
function Breaker:restore(state) self.values = source.copy(state) end

return retry
