--- breaker.lua: after three failed generations in a row the endpoint is left alone for 5
--- generations, then for 10, 20, 40 and from then on 80 at a time; in between one short probe is
--- sent. Time is counted in generations, never in seconds; those of all that ask count, since one
--- breaker may serve the repetitions of an experiment.

local breaker = {}

local PATIENCE = 3 -- failed generations in a row
local FIRST, LONGEST = 5, 80 -- generations; a run of thousands should find an endpoint again

---@class limax.llm.breaker
---@field tick integer generations seen
---@field failures integer generations in a row that failed
---@field length integer generations that it was open the last time; 0: it is closed
---@field probe_at integer tick of the next probe
---@field failed_at integer tick of the last failure
---@field generation integer|nil the last one seen
---@field asker table|nil who entered it
local methods = {}
local class = { __index = methods }

---@return limax.llm.breaker
function breaker.new()
  return setmetatable({ tick = 0, failures = 0, length = 0, probe_at = 0, failed_at = 0 }, class)
end

--- Enters a generation. Several requests may belong to one; without a number each is its own. The
--- generations of another asker are others, whatever their numbers.
---@param generation integer|nil
---@param asker? table
---@return "closed"|"open"|"probe"
---@return integer left generations until the probe
function methods:enter(generation, asker)
  local same = self.asker == nil or self.asker == asker
  if generation == nil or generation ~= self.generation or not same then
    local passed = same and generation and self.generation and generation - self.generation or 1
    -- a client that serves several repetitions begins again at 0
    self.tick = self.tick + (passed > 0 and passed or 1)
    self.generation = generation
  end
  self.asker = asker
  if self.length == 0 then return "closed", 0 end
  if self.tick >= self.probe_at then return "probe", 0 end
  return "open", self.probe_at - self.tick
end

--- The endpoint failed in this generation; several failures in one count once.
function methods:failed()
  if self.failed_at == self.tick then return end
  self.failed_at = self.tick
  self.failures = self.failures + 1
  if self.failures < PATIENCE then return end
  self.length = self.length == 0 and FIRST or math.min(2 * self.length, LONGEST)
  self.probe_at = self.tick + self.length + 1
end

--- The endpoint answered.
function methods:succeeded() self.failures, self.length, self.probe_at = 0, 0, 0 end

--- Somebody else begins to ask: an open breaker probes at once, since a whole repetition should not
--- go by under what another one found.
function methods:begin()
  if self.length > 0 then self.probe_at = math.min(self.probe_at, self.tick + 1) end
end

--- Plain values, for a checkpoint.
---@return table
function methods:state()
  return { tick = self.tick, failures = self.failures, length = self.length,
    probe_at = self.probe_at, failed_at = self.failed_at, generation = self.generation }
end

---@param state table
function methods:restore(state)
  for _, name in ipairs { "tick", "failures", "length", "probe_at", "failed_at" } do
    self[name] = state[name]
  end
  self.generation = state.generation
end

return breaker
