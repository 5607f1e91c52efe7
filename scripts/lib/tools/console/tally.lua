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

function Tally:count(reason, robots)
  self.failed = self.failed + robots
  self.counts[reason] = (self.counts[reason] or 0) + robots
end

-- Keeps the best robots.
local function rank(self, repetition, records)
  for _, record in ipairs(records) do
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

--- Adds one generation's records. An elite was counted when it was bred.
function Tally:add(repetition, records)
  for _, record in ipairs(records) do
    if record.origin ~= "elite" then self.robots = self.robots + 1 end
    if record.status ~= "done" and record.reason then self:count(failure_of(record), 1) end
  end
  rank(self, repetition, records)
end

--- Adds the generations of a repetition that were done before a resume: numbers of failures from
--- their metrics, and robots from the generations of the best champions only.
---@param each fun(visit: fun(line: table)) over those of metrics.jsonl
---@param read fun(generation: integer): table[] records
function Tally:add_earlier(repetition, each, read)
  local first, seen = {}, {}
  each(function(line)
    self.robots = self.robots + line.evaluations
    for name, robots in pairs(line.failed) do
      if robots > 0 then self:count(name == "fitness" and "by fitness" or name, robots) end
    end
    local champion = line.champion.id
    if not seen[champion] then
      seen[champion] = true
      first[#first + 1] = { best = line.best, generation = line.generation }
    end
  end)
  table.sort(first, function(a, b)
    if a.best ~= b.best then return a.best > b.best end
    return a.generation < b.generation
  end)
  for k = 1, math.min(#first, most_rows) do
    rank(self, repetition, read(first[k].generation))
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
