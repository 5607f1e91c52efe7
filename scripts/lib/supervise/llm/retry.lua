--- retry.lua: which failures are tried again, and after how long: the table of openai-python, in
--- one layer. Pure functions; times in seconds.

local retry = {}

retry.MOST = 2 -- retries after the first attempt
retry.MOST_AFTER_TIMEOUT = 1 -- each costs the whole time limit of an attempt
local FIRST, LONGEST = 0.5, 8 -- waits double between these
local SHORTENED = 0.25 -- by up to this share, so that many clients do not come back at once
local LONGEST_ASKED = 120 -- a server that asks for more is not waited for

-- 408 request timeout, 409 conflict, 429 too many requests; all from 500 on too
local STATUSES = { [408] = true, [409] = true, [429] = true }

-- Of what bindings/host/http.cpp calls failures. A certificate, an encoding or a size will be the same
-- the next time.
local KINDS = { resolve = true, connect = true, connect_timeout = true, timeout = true,
  reset = true, partial = true, tls = true }

local MONTHS = { jan = 1, feb = 2, mar = 3, apr = 4, may = 5, jun = 6, jul = 7, aug = 8, sep = 9,
  oct = 10, nov = 11, dec = 12 }

-- Days from 1970-01-01 to a day of the Gregorian calendar, years beginning in March.
local function days(year, month, day)
  if month <= 2 then year, month = year - 1, month + 12 end
  return 365 * year + math.floor(year / 4) - math.floor(year / 100) + math.floor(year / 400)
    + math.floor((153 * (month - 3) + 2) / 5) + day - 1 - 719468
end

--- Seconds since 1970 of a date of HTTP, in any of its three forms (RFC 9110, section 5.6.7); nil
--- for anything else.
---@param text string
---@return number|nil
function retry.date(text)
  local day, month, year, clock =
    text:match "^%a+, (%d%d) (%a%a%a) (%d%d%d%d) (%d%d:%d%d:%d%d) GMT$"
  if not day then
    day, month, year, clock = text:match "^%a+, (%d%d)%-(%a%a%a)%-(%d%d) (%d%d:%d%d:%d%d) GMT$"
    if year then year = (tonumber(year) < 70 and 2000 or 1900) + tonumber(year) end
  end
  if not day then
    month, day, clock, year = text:match "^%a+ (%a%a%a) +(%d+) (%d%d:%d%d:%d%d) (%d%d%d%d)$"
  end
  month = month and MONTHS[month:lower()]
  if not month then return nil end
  local hours, minutes, seconds = clock:match "(%d+):(%d+):(%d+)"
  return days(tonumber(year), month, tonumber(day)) * 86400 + hours * 3600 + minutes * 60 + seconds
end

-- A decimal number; not "0x10", "inf" or "nan", which tonumber would take.
local function decimal(text)
  if not text or not text:find "^%s*[-+]?[%d.]+[eE]?[-+]?%d*%s*$" then return nil end
  return tonumber(text)
end

--- Seconds that the server asks to wait; nil where it says nothing that can be read, or a time that
--- is over.
---@param headers table<string, string>
---@param wall number seconds since 1970
---@return number|nil
function retry.asked(headers, wall)
  local milliseconds = decimal(headers["retry-after-ms"])
  local seconds = milliseconds and milliseconds / 1000
  local text = headers["retry-after"]
  if not seconds and text then
    seconds = decimal(text)
    if not seconds then
      local date = retry.date(text)
      seconds = date and date - wall
    end
  end
  if seconds and seconds > 0 and seconds < math.huge then return seconds end
  return nil
end

--- Whether a failed attempt may be tried again at all.
---@param failure { class: string, kind: string|nil, status: integer|nil,
--- headers: table<string, string> }
---@return boolean
function retry.wanted(failure)
  local said = failure.headers["x-should-retry"]
  if said == "true" then return true end
  if said == "false" or failure.class == "quota" or failure.class == "context" then return false end
  if failure.kind then return KINDS[failure.kind] == true end
  local status = failure.status or 0
  return failure.class ~= "envelope" and (STATUSES[status] == true or status >= 500)
end

--- How long to wait before the retry of this number; nil, and why, where the server asks for too
--- much.
---@param number integer 1 for the first retry
---@param headers table<string, string>
---@param wall number seconds since 1970
---@param random number from 0 to 1
---@return number|nil seconds
---@return string|nil reason
function retry.wait(number, headers, wall, random)
  local asked = retry.asked(headers, wall)
  if asked and asked > LONGEST_ASKED then
    return nil, ("the server asks to wait %.0f s, more than %d"):format(asked, LONGEST_ASKED)
  end
  if asked then return asked end
  return math.min(FIRST * 2 ^ (number - 1), LONGEST) * (1 - SHORTENED * random)
end

return retry
