--- history.lua: the history of the prompt: a line for each entry in $XDG_STATE_HOME/limax/history,
--- else ~/.local/state/limax/history, readable only by the user. Line breaks are written \n and
--- backslashes \\.

local host = require "limax.host"
local output = require "limax.base.output"
local source = require "limax.base.source"
local user_folder = require "limax.base.user_folder"

local history = {}

-- the file; nil: nothing is saved
local path
-- the newest entry
local last

local function encode(text) return (text:gsub("\\", "\\\\"):gsub("\n", "\\n")) .. "\n" end

local function decode(line)
  return (line:gsub("\\(.)", function(letter) return letter == "n" and "\n" or letter end))
end

-- Unless `done`, reports why nothing is saved, and stops saving.
local function check(done, message)
  if done then return end
  path = nil
  output.warn("limax: the history is not saved: ", message, "\n")
end

--- The entries of earlier sessions of this user, oldest first.
function history.open()
  local folder, message = user_folder "XDG_STATE_HOME"
  check(folder, message)
  if not folder then return {} end
  path = folder .. "/history"
  check(host.file.mkdir(folder))
  local entries = {}
  if not path or not host.file.exists(path) then return entries end
  local text, unreadable = source.read(path)
  check(text, unreadable)
  for line in (text or ""):gmatch "[^\n]+" do entries[#entries + 1] = decode(line) end
  return entries
end

--- Saves an entry, unless it is empty or equals the last one.
---@return boolean added
function history.add(text)
  if text:match "^%s*$" or text == last then return false end
  last = text
  if path then check(host.file.append(path, encode(text), true)) end
  return true
end

return history
