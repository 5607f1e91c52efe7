--- history.lua: what was typed, kept between starts: a line for each entry in
--- $XDG_STATE_HOME/limax/history, else ~/.local/state/limax/history, for the user alone. Line
--- breaks are written \n and backslashes \\.

local host = require "limax.host"
local source = require "limax.base.source"

local history = {}

-- entries that are kept when the file is read; it is shortened once it has a tenth more
local MOST = 10000

local folder_mark = "/limax"

--- The folder of the state that a user's programs keep; nil without a home.
---@return string|nil
function history.folder()
  local given = os.getenv "XDG_STATE_HOME"
  -- a relative path is to be ignored: XDG Base Directory Specification
  if given and given:sub(1, 1) == "/" then return given .. folder_mark end
  local home = os.getenv "HOME"
  return home and home ~= "" and home .. "/.local/state" .. folder_mark or nil
end

local function encode(text) return (text:gsub("\\", "\\\\"):gsub("\n", "\\n")) end

local function decode(line)
  return (line:gsub("\\(.)", function(letter) return letter == "n" and "\n" or letter end))
end

---@class limax.repl.history
---@field path string|nil
---@field last string|nil the newest entry
---@field say fun(text: string) hears once that nothing can be kept
local History = {}
History.__index = History

-- Says once why nothing is kept, and gives up.
function History:give_up(message)
  self.path = nil
  self.say("the history is not kept: " .. message)
end

-- Writes the newest entries alone into a file beside, and puts it in the place of the long one.
function History:shorten(entries)
  local lines = {}
  for i = #entries - MOST + 1, #entries do lines[#lines + 1] = encode(entries[i]) .. "\n" end
  local beside = self.path .. ".part"
  host.file.remove(beside)
  local fine, message = host.file.append(beside, table.concat(lines), true)
  if fine then fine, message = host.file.rename(beside, self.path) end
  if not fine then self:give_up(message) end
end

--- The entries of earlier starts, oldest first.
---@return string[]
function History:entries()
  local entries = {}
  if not self.path or not host.file.exists(self.path) then return entries end
  local text, message = source.read(self.path)
  if not text then
    self:give_up(message)
    return entries
  end
  for line in text:gmatch "[^\n]+" do entries[#entries + 1] = decode(line) end
  if #entries > MOST + MOST / 10 then self:shorten(entries) end
  return entries
end

--- Keeps an entry; one like the last is left out.
---@param text string
---@return boolean kept is it a new one?
function History:add(text)
  if text:match "^%s*$" or text == self.last then return false end
  self.last = text
  if self.path then
    local fine, message = host.file.append(self.path, encode(text) .. "\n", true)
    if not fine then self:give_up(message) end
  end
  return true
end

--- The history of this user.
---@param say fun(text: string)
---@return limax.repl.history
function history.open(say)
  local self = setmetatable({ say = say }, History)
  local folder = history.folder()
  if not folder then
    self:give_up "there is neither $XDG_STATE_HOME nor $HOME"
    return self
  end
  local fine, message = host.file.mkdir(folder)
  if not fine then
    self:give_up(message)
    return self
  end
  self.path = folder .. "/history"
  return self
end

return history
