--- history.lua: the history of the prompt: a line for each entry in $XDG_STATE_HOME/limax/history,
--- else ~/.local/state/limax/history, readable only by the user. Line breaks are written \n and
--- backslashes \\.

local host = require "limax.host"
local source = require "limax.base.source"

local history = {}

-- the file is shortened to so many entries once it has a tenth more
local MAX_ENTRIES = 10000

--- The folder of the history; nil without a home.
function history.folder()
  local state = os.getenv "XDG_STATE_HOME"
  -- the XDG Base Directory Specification ignores relative paths
  if state and state:sub(1, 1) == "/" then return state .. "/limax" end
  local home = os.getenv "HOME"
  return home and home ~= "" and home .. "/.local/state/limax" or nil
end

local function encode(text) return (text:gsub("\\", "\\\\"):gsub("\n", "\\n")) end

local function decode(line)
  return (line:gsub("\\(.)", function(letter) return letter == "n" and "\n" or letter end))
end

---@class limax.repl.history
---@field path string|nil
---@field last string|nil the newest entry
---@field say fun(text: string) receives one message if nothing can be saved
local History = {}
History.__index = History

-- Reports why nothing is saved, and stops saving.
function History:give_up(message)
  self.path = nil
  self.say("the history is not saved: " .. message)
end

-- Replaces the file by one with only the newest entries.
function History:shorten(entries)
  local lines = {}
  for i = #entries - MAX_ENTRIES + 1, #entries do lines[#lines + 1] = encode(entries[i]) .. "\n" end
  local part = self.path .. ".part"
  host.file.remove(part)
  local done, message = host.file.append(part, table.concat(lines), true)
  if done then done, message = host.file.rename(part, self.path) end
  if not done then self:give_up(message) end
end

--- The entries of earlier sessions, oldest first.
function History:entries()
  local entries = {}
  if not self.path or not host.file.exists(self.path) then return entries end
  local text, message = source.read(self.path)
  if not text then
    self:give_up(message)
    return entries
  end
  for line in text:gmatch "[^\n]+" do entries[#entries + 1] = decode(line) end
  if #entries > 1.1 * MAX_ENTRIES then self:shorten(entries) end
  return entries
end

--- Saves an entry, unless it is empty or equals the last one.
---@return boolean added
function History:add(text)
  if text:match "^%s*$" or text == self.last then return false end
  self.last = text
  if self.path then
    local done, message = host.file.append(self.path, encode(text) .. "\n", true)
    if not done then self:give_up(message) end
  end
  return true
end

--- The history of this user.
---@param say fun(text: string)
function history.open(say)
  local self = setmetatable({ say = say }, History)
  local folder = history.folder()
  if not folder then
    self:give_up "neither $XDG_STATE_HOME nor $HOME is set"
    return self
  end
  local made, message = host.file.mkdir(folder)
  if not made then
    self:give_up(message)
    return self
  end
  self.path = folder .. "/history"
  return self
end

return history
