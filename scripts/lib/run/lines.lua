--- lines.lua: finds the lines of a run's files that grow by one line for each generation. Only the
--- places of the lines are in memory.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local run_files = require "limax.settings.run_files"
local source = require "limax.base.source"

---@class limax.run.lines
---@field path string of the run folder
---@field offsets table<string, table<integer, integer[]>> by name, repetition and generation + 1
---@field spent table<integer, integer> evaluations of each repetition, as `each_metrics` read them
local Lines = {}
Lines.__index = Lines

local lines = {}

---@param path string of the run folder
---@return limax.run.lines
function lines.new(path)
  return setmetatable({ path = path, offsets = {}, spent = {} }, Lines)
end

--- Notes where the line of a generation begins.
---@param name "metrics"|"ledger"|"timing"|"hashes" of the file
---@param offset integer
function Lines:add(name, repetition, generation, offset)
  local by_repetition = self.offsets[name] or {}
  self.offsets[name] = by_repetition
  by_repetition[repetition] = by_repetition[repetition] or {}
  by_repetition[repetition][generation + 1] = offset
end

local function of(self, name, repetition)
  return self.offsets[name] and self.offsets[name][repetition] or {}
end

--- The newest generation of a repetition; -1 where it has none.
---@return integer
function Lines:last(repetition) return #of(self, "metrics", repetition) - 1 end

local function open(self, name)
  local path = ("%s/%s.jsonl"):format(self.path, name)
  local file, message = source.open(path)
  if not file then failure.raise(1, message) end
  return file, path
end

-- The object of a line, without its schema.
local function read(file, path, offset, name)
  file:seek("set", offset)
  local line = run_files.line(file:read "*l" or "", name, ("%s, byte %d"):format(path, offset))
  line.schema = nil
  return line
end

--- Calls `visit(line)` for the metrics of each generation of a repetition.
---@param visit fun(line: table)
function Lines:each_metrics(repetition, visit)
  local file, path = open(self, "metrics")
  local spent = 0
  for _, offset in ipairs(of(self, "metrics", repetition)) do
    local line = read(file, path, offset, "metrics")
    spent = spent + line.evaluations
    visit(line)
  end
  file:close()
  self.spent[repetition] = spent
end

--- The evaluations of the generations that a repetition had when its folder was opened.
---@return integer
function Lines:evaluations(repetition)
  if not self.spent[repetition] then self:each_metrics(repetition, function() end) end
  return self.spent[repetition]
end

--- The metrics of a generation.
---@return table
function Lines:metrics(repetition, generation)
  local file, path = open(self, "metrics")
  local line = read(file, path, of(self, "metrics", repetition)[generation + 1], "metrics")
  file:close()
  return line
end

--- The ledger's record of a generation.
---@return { supervisor: string, source: string|nil, reason: string|nil, entries: table[] }
function Lines:ledger(repetition, generation)
  local file, path = open(self, "ledger")
  local line = read(file, path, of(self, "ledger", repetition)[generation + 1], "ledger")
  file:close()
  line.repetition, line.generation = nil, nil
  return line
end

-- Calls `visit(offsets, k)` for each line in the order of repetitions and generations.
local function in_order(self, name, visit)
  local by_repetition = self.offsets[name] or {}
  for _, repetition in ipairs(choice.sorted_keys(by_repetition)) do
    for k = 1, #by_repetition[repetition] do visit(by_repetition[repetition], k) end
  end
end

--- Are the lines of a file sorted by repetition and generation?
---@return boolean
function Lines:are_sorted(name)
  local sorted, last = true, -1
  in_order(self, name, function(offsets, k)
    sorted, last = sorted and offsets[k] > last, offsets[k]
  end)
  return sorted
end

--- The text of a file with its lines sorted; the places of the lines are then those in this text.
---@return string
function Lines:sort(name)
  local file, texts, bytes = open(self, name), {}, 0
  in_order(self, name, function(offsets, k)
    file:seek("set", offsets[k])
    local text = file:read "*L"
    texts[#texts + 1], offsets[k] = text, bytes
    bytes = bytes + #text
  end)
  file:close()
  return table.concat(texts)
end

return lines
