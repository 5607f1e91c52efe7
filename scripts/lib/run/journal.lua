--- journal.lua: journal.jsonl of a run folder, which only grows: a line for each process that began
--- to write, each generation, each cut and each end, with a hash of its own (base/sealed.lua). A
--- generation exists once a line names it, with size and hash of all that it wrote. The process
--- that writes the folder holds a lock of this file as long as it lives.

local host = require "limax.host"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"

---@class limax.journal
---@field path string of the file
---@field bytes integer of whole lines
---@field last table|nil the newest line that is whole
---@field config string name of the configuration in force
---@field config_hash string|nil
---@field generations table<integer, table[]> lines of each repetition, of generation 0 first
---@field begins table[] lines of the processes that wrote the folder
---@field begin_of table<table, table> by the line of a generation: the process that wrote it
---@field damage limax.run.damage[]
---@field transcript integer bytes that transcript.jsonl has at least
---@field next table<integer, integer> the generation that is expected next, of each repetition
local Journal = {}
Journal.__index = Journal

local journal = {}

journal.FILE = "journal.jsonl"

-- How a line of base/sealed.lua begins.
local OPENING = '{"hash":"'

local rules = {}
for kind, rows in pairs(records.journal) do rules[kind] = record_rules.rule(rows) end

---@class limax.run.damage
---@field file string below the folder
---@field reason string
---@field repetition integer|nil that it belongs to
---@field generation integer|nil
---@field unreadable boolean|nil is it there, but could not be read?

local function damaged(self, number, reason, repetition, generation)
  table.insert(self.damage, { file = ("%s, line %d"):format(journal.FILE, number), reason = reason,
    repetition = repetition, generation = generation })
end

local visit = {}

function visit.begin(self, line)
  self.config, self.config_hash = line.config, line.config_hash
  table.insert(self.begins, line)
  self.transcript = math.max(self.transcript, line.transcript or 0)
end

function visit.generation(self, line, number)
  local r, g = line.repetition, line.generation
  local list, expected = self.generations[r] or {}, self.next[r] or 0
  self.generations[r] = list
  if g < expected then
    return damaged(self, number, ("is of generation %d of repetition %d, and %d was expected")
      :format(g, r, expected), r, g)
  elseif g > expected then
    -- a damaged line before this one had it
    for k, each in ipairs(self.damage) do
      if each.unplaced then table.remove(self.damage, k) break end
    end
    damaged(self, number, ("follows a line that is missing or damaged, of generation %d of"
      .. " repetition %d"):format(expected, r), r, expected)
  end
  self.next[r] = g + 1
  -- lines beyond a gap do not count
  if #list == g then list[g + 1], self.begin_of[line] = line, self.begins[#self.begins] end
  self.transcript = math.max(self.transcript, line.transcript or 0)
end

function visit.cut(self, line)
  for _, r in ipairs(line.repetitions) do
    local list = self.generations[r] or {}
    for k = #list, line.from + 2, -1 do list[k] = nil end
    self.next[r] = math.min(self.next[r] or 0, line.from + 1)
    for k = #self.damage, 1, -1 do
      local each = self.damage[k]
      if each.repetition == r and each.generation > line.from then table.remove(self.damage, k) end
    end
  end
  -- the transcript is rewritten
  self.transcript = 0
end

visit["end"] = function() end

-- The generation of a damaged line, if its text still names the one that was expected.
local function guess(self, text)
  local r = tonumber(text:match '"repetition":(%d+)')
  local g = tonumber(text:match '"generation":(%d+)')
  if not r or g ~= (self.next[r] or 0) then return nil end
  self.next[r] = g + 1
  return r, g
end

-- Reads a line, which ends in a line break.
local function take(self, text, number)
  local line, reason = sealed.open(text)
  local rule = line and rules[line.kind]
  local problem = rule and select(2, rule(line, ""))
  if rule and line.kind ~= "begin" and not self.begins[1] then
    problem = "no process has begun to write"
  elseif rule and line.at and line.at ~= self.bytes then
    reason = "does not follow the lines that were before it"
  end
  if line and not rule then reason = "has a kind that limax does not know" end
  if problem then reason = "is invalid: " .. problem:gsub("%c", "?") end
  if reason then
    local r, g = guess(self, text)
    damaged(self, number, reason, r, g)
    self.damage[#self.damage].unplaced = not r or nil
    return
  end
  self.last = line
  visit[line.kind](self, line, number)
end

--- Reads the journal of a folder. Ignores a last line without its end.
---@return limax.journal|nil
---@return string|nil message
---@return boolean|nil missing
function journal.read(folder)
  local path = folder .. "/" .. journal.FILE
  local text, message, missing = source.read_own(path)
  if not text then return nil, message, missing end
  local self = setmetatable({ path = path, bytes = 0, config = "config.json", generations = {},
    begins = {}, begin_of = {}, damage = {}, next = {}, transcript = 0 }, Journal)
  local number = 0
  for line, last in text:gmatch "([^\n]*\n)()" do
    number = number + 1
    take(self, line, number)
    self.bytes = last - 1
  end
  local torn, newest = text:sub(self.bytes + 1), 0
  if torn ~= "" and torn:sub(1, #OPENING) ~= OPENING:sub(1, #torn) then
    for _, following in pairs(self.next) do newest = math.max(newest, following) end
    damaged(self, number + 1, "is not a line that limax began", nil, newest)
  end
  return self
end

--- Adds a line and returns its text.
---@param state? string JSON of the field `state`
---@return string text
---@return integer bytes of it before the state
function Journal:add(line, state)
  local json = host.json.encode(line)
  if state then json = ('%s,"state":%s}'):format(json:sub(1, -2), (state:gsub("\n$", ""))) end
  local text = sealed.add(json) .. "\n"
  self.bytes, self.last = self.bytes + #text, line
  visit[line.kind](self, line, 0)
  return text, #text - #(state or "")
end

--- The line of a generation; nil if there is none.
function Journal:entry(repetition, generation)
  return (self.generations[repetition] or {})[generation + 1]
end

--- The newest generation of a repetition; -1 where it has none.
function Journal:newest(repetition) return #(self.generations[repetition] or {}) - 1 end

--- The state of the run: "running" while a process holds the lock, else how the last one ended,
--- "stopped" if it was killed.
---@return "running"|"done"|"stopped"|"failed"
---@return string|nil message why it failed
function Journal:state()
  if host.file.is_locked(self.path) then return "running" end
  local last = self.last or {}
  if last.kind == "end" then return last.state, last.message end
  return "stopped"
end

return journal
