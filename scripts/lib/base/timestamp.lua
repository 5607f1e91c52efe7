--- timestamp.lua: times such as "2026-11-21T10:15:03Z", as `limax.host.time` writes them.

local timestamp = {}

--- Seconds since 1970, by the civil calendar; nil for any other text. Years are counted from March,
--- so that a leap day is the last day of its year.
function timestamp.seconds(text)
  local year, month, day, hour, minute, second =
    tostring(text):match "^(%d%d%d%d)-(%d%d)-(%d%d)T(%d%d):(%d%d):(%d%d)Z$"
  if not year then return nil end
  year, month = tonumber(year), tonumber(month)
  if month <= 2 then year, month = year - 1, month + 12 end
  local days = 365 * year + math.floor(year / 4) - math.floor(year / 100) + math.floor(year / 400)
    + math.floor((153 * (month - 3) + 2) / 5) + day - 1 - 719468
  return ((days * 24 + hour) * 60 + minute) * 60 + second
end

return timestamp
