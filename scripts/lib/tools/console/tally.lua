--- tally.lua: the best robots of a run, and how many robots failed and why.

local choice = require "limax.base.choice"

local tally = {}

---@class limax.tally
local Tally = {}
Tally.__index = Tally

-- Rows of the table of best robots.
local most_rows = 5

---@return limax.tally
function tally.new()
  return setmetatable({ best = {}, listed = {}, counts = {}, robots = 0, failed = 0 }, Tally)
end

local function better(a, b)
  if a.fitness ~= b.fitness then return a.fitness > b.fitness end
  if a.repetition ~= b.repetition then return a.repetition < b.repetition end
  return a.id < b.id
end

-- How a robot failed: "invalid (no muscle)", "by fitness".
local function failure_of(record)
  if record.status == "failed" then return "by " .. record.reason end
  return ("%s (%s)"):format(record.status, record.reason)
end

--- Keeps the first message of a fitness that failed from the warnings of a run.
function Tally:add_warning(text)
  self.fitness_message = self.fitness_message or text:match "gets no score: ([^\n]+)"
end

--- Adds one generation's records. An elite was counted when it was bred.
function Tally:add(repetition, records)
  for _, record in ipairs(records) do
    if record.origin ~= "elite" then self.robots = self.robots + 1 end
    if record.status ~= "done" and record.reason then
      local reason = failure_of(record)
      self.failed = self.failed + 1
      self.counts[reason] = (self.counts[reason] or 0) + 1
    end
    local name = repetition .. ":" .. record.id
    local row = self.listed[name]
    if record.fitness and row then
      -- scored again under other materials: the newest score counts
      row.fitness = record.fitness
    elseif record.fitness then
      row = { repetition = repetition, id = record.id, generation = record.generation,
        fitness = record.fitness, body = record.body }
      self.listed[name] = row
      self.best[#self.best + 1] = row
    end
  end
  table.sort(self.best, better)
  for k = #self.best, most_rows + 1, -1 do
    self.listed[self.best[k].repetition .. ":" .. self.best[k].id] = nil
    self.best[k] = nil
  end
end

local function materials_text(counts)
  local parts = {}
  for _, name in ipairs(choice.sorted_keys(counts)) do
    if counts[name] > 0 and name ~= "empty" then parts[#parts + 1] = counts[name] .. " " .. name end
  end
  return table.concat(parts, ", ")
end

--- The tally as text: the best robots, then what failed and why.
---@return string
function Tally:text()
  local lines = { "The best robots:",
    "  fitness     repetition  generation  robot   size    mass (kg)  voxels" }
  for _, row in ipairs(self.best) do
    lines[#lines + 1] = ("  %-10.5g  %10d  %10d  %5d   %dx%dx%d  %9.4g  %s"):format(row.fitness,
      row.repetition, row.generation, row.id, row.body.size[1], row.body.size[2], row.body.size[3],
      row.body.mass, materials_text(row.body.counts))
  end
  local parts = {}
  for k, reason in ipairs(choice.sorted_keys(self.counts)) do
    local message = reason == "by fitness" and self.fitness_message
    parts[k] = ("%d %s%s"):format(self.counts[reason], reason,
      message and (" (first: %s)"):format(message) or "")
  end
  lines[#lines + 1] = #parts == 0 and ("None of %d robots failed."):format(self.robots)
    or ("%d of %d robots failed: %s."):format(self.failed, self.robots, table.concat(parts, ", "))
  return table.concat(lines, "\n") .. "\n"
end

return tally
