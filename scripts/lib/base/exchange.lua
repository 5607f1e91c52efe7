--- exchange.lua: messages between the processes of one run under mpirun, its ranks. All take part
--- in every exchange, and an error of one reaches the others in the next one. Without mpirun there
--- is one rank, and nothing is sent.

local buffer = require "string.buffer"
local ffi = require "ffi"

local failure = require "limax.base.failure"
local fault = require "limax.engine.fault"
local host = require "limax.host"
local ranks = require "limax.base.ranks"

local exchange = {}

--- Number of ranks, and of this one: 0, 1, ... Rank 0 writes the run folder and talks to the user.
exchange.count, exchange.index, exchange.is_first = ranks.count, ranks.index, ranks.index == 0

-- of this rank, for rank 0
local warnings = {}
-- Was an error sent to the other ranks?
local ended = false
-- s that a rank waits for the one that reports an interrupt, which would end with it
local LONGEST_REPORT = 5
local is_interrupted, reports = false, true
-- Does this rank work by itself?
local is_apart = false

local function gather(message)
  local list, problem = {}, nil
  for k, text in ipairs(ranks.gather(buffer.encode(message))) do
    list[k] = k == ranks.index + 1 and message or buffer.decode(text)
    problem = problem or list[k].problem
  end
  ended = problem ~= nil
  return list, problem
end

--- Sends a value to all ranks. Raises the error of a rank that failed instead.
---@param value any numbers, texts, booleans, and tables of these
---@return any[] values by rank, from 1
function exchange.all(value)
  if exchange.count == 1 then return { value } end
  local list, problem = gather { value = value }
  if problem then fault.throw(problem) end
  for k, message in ipairs(list) do list[k] = message.value end
  return list
end

--- A value that rank 0 makes for all.
---@generic T
---@param make fun(): T
---@return T
function exchange.first(make)
  local value
  if exchange.is_first then value = make() end
  local list = exchange.all(value)
  return exchange.is_first and value or list[1]
end

-- Sends an error of this rank to all.
local function tell(value, trace)
  local status = failure.status(value)
  local text = status and tostring(value) or failure.text(value, trace or tostring(value))
  gather { problem = { kind = status and value.kind or "failed", status = status or 1,
    text = ("rank %d: %s"):format(ranks.index, text) } }
end

--- Calls `call`, then `last`, also after an error of any rank, which then is one of all. On several
--- ranks an interrupt leaves out `last`, in which all would have to take part.
function exchange.finally(last, call)
  if exchange.count == 1 then return failure.finally(last, call) end
  exchange.all(true) -- an error from before ends all here, without `last`
  local ok, value, trace = failure.attempt(function()
    call()
    exchange.all(true)
  end)
  if not (ok or ended) then tell(value, trace) end
  ended = false -- a second error is sent as well
  last()
  if not ok then failure.raise_again(value, trace) end
end

--- Adds up the values of all ranks, int64_t[count], in place.
function exchange.sum(values, count)
  exchange.all(true) -- an error of a rank ends all here, and not within the sum
  ranks.sum(values, count)
end

--- Sends items to each rank and receives some from each, as ranks.trade, also this one from
--- itself. All ranks must call it after the same exchange, with nothing in between that may fail.
function exchange.trade(out, sent, into, received, bytes, owner)
  if exchange.count == 1 then return ffi.copy(into, out, sent[1] * bytes) end
  ranks.trade(out, sent, into, received, bytes, owner)
end

--- Completes items in place, as ranks.share, under the same conditions.
function exchange.share(...) ranks.share(...) end

--- Keeps a warning of this rank for the next `take_warnings`; rank 0 shows it.
function exchange.warn(text, key) warnings[#warnings + 1] = { text = text, key = key } end

--- The warnings since the last call, for `all`.
---@return { text: string, key: string }[]
function exchange.take_warnings()
  local list = warnings
  warnings = {}
  return list
end

--- From here on this rank works as if it were the only one: ranks divide the work by locks.
function exchange.work_apart()
  is_apart, exchange.count, exchange.index, exchange.is_first = true, 1, 0, true
end

--- Ends this rank's part in the run. No call may follow.
---@param status integer of the process
---@return integer status
function exchange.finish(status)
  local leaves = is_apart and status ~= 0 -- mpirun ends the others
  if not (leaves or is_interrupted) then host.protect(ranks.finish) end
  if not reports then host.protect(host.wait, LONGEST_REPORT) end
  if leaves or is_interrupted then ranks.stop() end
  return status
end

--- Sends an error of this rank to the others, unless it came from one of them. Then only one rank
--- shows it.
---@return boolean is it this one?
function exchange.shows(value, trace)
  if ranks.count == 1 or is_apart then return true end
  if ended then return exchange.is_first end
  -- also where a rank is lost
  if value == host.interrupt then
    if not is_interrupted then is_interrupted, reports = true, ranks.reports() end
    return reports
  end
  local sent = host.protect(tell, value, trace)
  is_interrupted = not sent
  return exchange.is_first or not sent
end

return exchange
