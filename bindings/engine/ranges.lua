--- ranges.lua: work over many robots, split into calls short enough for Ctrl-C. The split does not
--- affect results.

local host = require "limax.host"
local abi = require "limax.engine.abi"
local schema = require "limax.engine.schema"

-- seconds that one call should take, well below 50 ms
local AIM = 0.015

--- Calls `work(first, count)` (first from 0) over robots first .. first + count - 1; it returns a
--- status of the engine.
---@param what string for messages
---@param total integer robots there are
---@param first integer|nil from 1
---@param count integer|nil the rest if left out
---@param work fun(first: integer, count: integer): integer
local function in_ranges(what, total, first, count, work)
  first = schema.demand(schema.whole(1, math.max(total, 1), 1), first, what .. ": first")
  local rest = total - first + 1
  count = schema.demand(schema.whole(0, rest, rest), count, what .. ": count")
  local at, stop, size = first - 1, first - 1 + count, 8
  while at < stop do
    host.raise_if_interrupted()
    local now = math.min(size, stop - at)
    local started = host.clock()
    abi.check(work(at, now), what)
    local took = host.clock() - started
    at = at + now
    if took < AIM / 2 then
      size = size * 2
    elseif took > AIM then
      size = math.max(1, math.floor(size / 2))
    end
  end
end

return in_ranges
