--- tally.lua: how many robots of a run failed, and why.

local choice = require "limax.base.choice"

local tally = {}

---@class limax.tally
local Tally = {}
Tally.__index = Tally

---@return limax.tally
function tally.new() return setmetatable({ counts = {}, robots = 0, failed = 0 }, Tally) end

--- Keeps the first message of a fitness that failed from the warnings of a run.
function Tally:add_warning(text)
  self.fitness_message = self.fitness_message or text:match "gets no score: ([^\n]+)"
end

--- Adds a generation: its entry of the history, or its line of metrics.jsonl.
function Tally:add(line)
  self.robots = self.robots + line.evaluations
  for reason, robots in pairs(line.failed) do
    self.failed = self.failed + robots
    self.counts[reason] = (self.counts[reason] or 0) + robots
  end
end

--- The tally as a line.
---@return string
function Tally:text()
  if self.failed == 0 then return ("None of %d robots failed.\n"):format(self.robots) end
  local parts = {}
  for _, reason in ipairs(choice.sorted_keys(self.counts)) do
    local message = reason == "fitness" and self.fitness_message
    if self.counts[reason] > 0 then
      parts[#parts + 1] = ("%d %s%s"):format(self.counts[reason],
        reason == "fitness" and "by fitness" or reason,
        message and (" (first: %s)"):format(message) or "")
    end
  end
  return ("%d of %d robots failed: %s.\n"):format(self.failed, self.robots,
    table.concat(parts, ", "))
end

return tally
