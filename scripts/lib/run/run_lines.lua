--- run_lines.lua: the files of a run folder that grow by one line per generation. Lines stand
--- repetition after repetition, also where repetitions advance together: those of a repetition that
--- runs ahead of its turn wait in files of its own. What is whole, the folder's checkpoint says.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local host = require "limax.host"
local source = require "limax.base.source"

local run_lines = {}

local NAMES = { "metrics", "ledger", "timing" }

---@class limax.run_lines
---@field folder limax.run_folder
---@field turn integer|nil the repetition whose lines are next; nil: whichever comes
---@field bytes table<string, integer> sizes of the files of all repetitions, as far as they count
---@field ahead table<integer, table<string, integer>> the same of a repetition's waiting lines
local Lines = {}
Lines.__index = Lines

-- Sizes before the first generation.
local function no_bytes()
  local bytes = {}
  for _, name in ipairs(NAMES) do bytes[name] = 0 end
  return bytes
end

local function file_of(name) return name .. ".jsonl" end

--- A repetition's own folder, below the run folder.
---@param repetition integer
---@return string
function run_lines.folder_of(repetition) return ("r%02d"):format(repetition) end

-- Where a repetition's lines wait.
local function waiting(repetition, name)
  return run_lines.folder_of(repetition) .. "/" .. file_of(name)
end

--- The lines of a folder, as far as its checkpoint says; none without one.
---@param folder limax.run_folder
---@param checkpoint table|nil
---@return limax.run_lines
function run_lines.new(folder, checkpoint)
  local self = setmetatable({ folder = folder, bytes = no_bytes(), ahead = {} }, Lines)
  if checkpoint then
    self.bytes = source.copy(checkpoint.bytes)
    for _, each in ipairs(checkpoint.ahead or {}) do
      self.ahead[each.repetition] = source.copy(each.bytes)
    end
  end
  return self
end

--- What a checkpoint keeps: `bytes`, and `ahead` where lines wait.
---@return table bytes
---@return table[]|nil ahead
function Lines:sizes()
  local ahead
  for _, repetition in ipairs(choice.sorted_keys(self.ahead)) do
    ahead = ahead or {}
    ahead[#ahead + 1] = { repetition = repetition, bytes = source.copy(self.ahead[repetition]) }
  end
  return source.copy(self.bytes), ahead
end

--- Makes the empty files of a new run.
function Lines:create()
  for _, name in ipairs(NAMES) do self.folder:write(file_of(name), "") end
end

function Lines:append_text(file, text, bytes, name)
  self.folder:append_later(file, text)
  bytes[name] = bytes[name] + #text
end

--- Appends one line.
---@param name "metrics"|"ledger"|"timing"
---@param value table with the `repetition` that it belongs to
function Lines:append(name, value)
  local line, repetition = host.json.encode(value) .. "\n", value.repetition
  if not self.turn or repetition == self.turn then
    self:append_text(file_of(name), line, self.bytes, name)
    return
  end
  if not self.ahead[repetition] then
    self.folder:make_folder(run_lines.folder_of(repetition))
    -- whatever a killed process left there
    for _, each in ipairs(NAMES) do self.folder:write(waiting(repetition, each), "") end
    self.ahead[repetition] = no_bytes()
  end
  self:append_text(waiting(repetition, name), line, self.ahead[repetition], name)
end

--- From now on the lines of this repetition are next: those that waited are appended. They lie in
--- both places until remove_waiting().
---@param repetition integer
---@return boolean whether there were any
function Lines:take_turn(repetition)
  self.turn = repetition
  if not self.ahead[repetition] then return false end
  for _, name in ipairs(NAMES) do
    local text, message = source.read(self.folder.path .. "/" .. waiting(repetition, name))
    self.folder:check(text, message)
    self:append_text(file_of(name), text, self.bytes, name)
  end
  self.ahead[repetition] = nil
  return true
end

--- Removes a repetition's files of lines that wait for nothing any more.
---@param repetition integer
function Lines:remove_waiting(repetition)
  if self.ahead[repetition] then return end
  for _, name in ipairs(NAMES) do
    local path = self.folder.path .. "/" .. waiting(repetition, name)
    if host.file.exists(path) then self.folder:check(host.file.remove(path)) end
  end
end

--- Cuts what lies beyond the checkpoint.
function Lines:cut()
  local folder = self.folder
  for _, name in ipairs(NAMES) do
    local path = folder.path .. "/" .. file_of(name)
    if host.file.exists(path) then
      folder:check(host.file.truncate(path, self.bytes[name]))
    else
      folder:write(file_of(name), "")
    end
    for repetition, bytes in pairs(self.ahead) do
      folder:check(host.file.truncate(folder.path .. "/" .. waiting(repetition, name),
        bytes[name]))
    end
  end
end

-- Adds the lines of a file to a list.
local function read_into(list, path)
  local text, message = source.read(path)
  if not text then failure.raise(1, message) end
  for line in text:gmatch "[^\n]+" do
    local value, wrong = host.json.decode(line, path)
    if not value then failure.raise(1, tostring(wrong)) end
    list[#list + 1] = value
  end
end

--- All lines of one kind; those that wait come last.
---@param name "metrics"|"ledger"|"timing"
---@return table[]
function Lines:read(name)
  local list = {}
  read_into(list, self.folder.path .. "/" .. file_of(name))
  for _, repetition in ipairs(choice.sorted_keys(self.ahead)) do
    read_into(list, self.folder.path .. "/" .. waiting(repetition, name))
  end
  return list
end

return run_lines
