--- tally.lua: counts the failed robots of a run by reason, and the time of its parts.

local choice = require "limax.base.choice"
local source = require "limax.base.source"

local tally = {}

---@class limax.tally
local Tally = {}
Tally.__index = Tally

function tally.new()
  return setmetatable({ counts = {}, robots = 0, failed = 0, seconds = {} }, Tally)
end

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

--- Adds the times of a generation, as in timing.jsonl.
function Tally:add_times(seconds)
  for part, value in pairs(seconds) do self.seconds[part] = (self.seconds[part] or 0) + value end
end

-- Parts of a generation's time, and the fields of the configuration whose functions they call.
local PARTS = { { "simulate", "simulation" }, { "fitness", "fitness", "fitness" },
  { "breed", "selection and breeding", "selection", "survival" }, { "ranks", "other ranks" } }

--- A line with the shares of the time; functions of the script with their place.
function Tally:time_text(config)
  local total, texts = 0, {}
  for _, value in pairs(self.seconds) do total = total + value end
  for _, part in ipairs(PARTS) do
    local places = {}
    for k = 3, #part do places[#places + 1] = source.place(config[part[k]]) end
    local spent = self.seconds[part[1]]
    texts[#texts + 1] = spent and ("%.0f %% %s%s"):format(100 * spent / total, part[2],
      places[1] and " (" .. table.concat(places, ", ") .. ")" or "")
  end
  return total > 0 and ("Time %.3g s: %s.\n"):format(total, table.concat(texts, ", ")) or ""
end

--- The tally as a line.
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
