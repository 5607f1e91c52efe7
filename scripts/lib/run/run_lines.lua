--- run_lines.lua: the files of a run folder that grow by one line per generation. They hold one
--- repetition after the other, also where repetitions advance together: lines of a later
--- repetition wait in files of its own. The checkpoint of the folder states how many bytes of each
--- are complete.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local host = require "limax.host"
local source = require "limax.base.source"

local run_lines = {}

local NAMES = { "metrics", "ledger", "timing" }

---@class limax.run_lines
---@field folder limax.run_folder
---@field current integer|nil the repetition whose lines are appended; nil: those of any
---@field bytes table<string, integer> whole bytes of the files of all repetitions
---@field ahead table<integer, table<string, integer>> the same of a repetition's waiting lines
local Lines = {}
Lines.__index = Lines

--- A repetition's own folder, below the run folder.
---@return string
function run_lines.folder_of(repetition) return ("r%02d"):format(repetition) end

-- The file of all repetitions, or the one where the lines of a repetition wait.
local function file_of(name, repetition)
  local file = name .. ".jsonl"
  return repetition and run_lines.folder_of(repetition) .. "/" .. file or file
end

--- The lines of a folder, as far as its checkpoint states; none without one.
---@param folder limax.run_folder
---@param checkpoint table|nil
---@return limax.run_lines
function run_lines.new(folder, checkpoint)
  local self = setmetatable({ folder = folder, ahead = {},
    bytes = checkpoint and source.copy(checkpoint.bytes) or { metrics = 0, ledger = 0, timing = 0 }
  }, Lines)
  for _, waiting in ipairs(checkpoint and checkpoint.ahead or {}) do
    self.ahead[waiting.repetition] = source.copy(waiting.bytes)
  end
  return self
end

--- What a checkpoint holds: `bytes`, and `ahead` where lines wait.
---@return table bytes
---@return table[]|nil ahead
function Lines:sizes()
  local ahead = {}
  for k, repetition in ipairs(choice.sorted_keys(self.ahead)) do
    ahead[k] = { repetition = repetition, bytes = source.copy(self.ahead[repetition]) }
  end
  return source.copy(self.bytes), ahead[1] and ahead
end

--- Makes the empty files of a new run, or of a repetition whose lines have to wait.
function Lines:create(repetition)
  for _, name in ipairs(NAMES) do self.folder:write(file_of(name, repetition), "") end
end

function Lines:append_text(name, repetition, text)
  local bytes = repetition and self.ahead[repetition] or self.bytes
  self.folder.writer:append(self.folder.path .. "/" .. file_of(name, repetition), text)
  bytes[name] = bytes[name] + #text
end

--- Appends one line.
---@param name "metrics"|"ledger"|"timing"
---@param value table with the `repetition` that it belongs to
function Lines:append(name, value)
  local repetition = value.repetition
  if not self.current or repetition == self.current then
    repetition = nil
  elseif not self.ahead[repetition] then
    self.folder:make_folder(run_lines.folder_of(repetition))
    self:create(repetition)
    self.ahead[repetition] = { metrics = 0, ledger = 0, timing = 0 }
  end
  self:append_text(name, repetition, host.json.encode(value) .. "\n")
end

--- Appends the lines of this repetition from now on. Those that waited are appended; their files
--- stay until remove_waiting().
---@return boolean whether there were any
function Lines:append_lines_of(repetition)
  self.current = repetition
  if not self.ahead[repetition] then return false end
  for _, name in ipairs(NAMES) do
    local text, message = source.read(self.folder.path .. "/" .. file_of(name, repetition))
    self.folder:check(text, message)
    self:append_text(name, nil, text)
  end
  self.ahead[repetition] = nil
  return true
end

--- Removes a repetition's files of waiting lines, unless there are such lines.
function Lines:remove_waiting(repetition)
  if self.ahead[repetition] then return end
  for _, name in ipairs(NAMES) do
    local path = self.folder.path .. "/" .. file_of(name, repetition)
    if host.file.exists(path) then self.folder:check(host.file.remove(path)) end
  end
end

--- Cuts everything beyond the checkpoint.
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
      folder:check(host.file.truncate(folder.path .. "/" .. file_of(name, repetition), bytes[name]))
    end
  end
end

--- All lines of one kind; those that wait come last.
---@param name "metrics"|"ledger"|"timing"
---@return table[]
function Lines:read(name)
  local list, files = {}, { file_of(name) }
  for _, repetition in ipairs(choice.sorted_keys(self.ahead)) do
    files[#files + 1] = file_of(name, repetition)
  end
  for _, file in ipairs(files) do
    local path = self.folder.path .. "/" .. file
    local text, message = source.read(path)
    if not text then failure.raise(1, message) end
    for line in text:gmatch "[^\n]+" do
      local value, wrong = host.json.decode(line, path)
      if not value then failure.raise(1, tostring(wrong)) end
      list[#list + 1] = value
    end
  end
  return list
end

return run_lines
