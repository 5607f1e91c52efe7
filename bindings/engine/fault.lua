--- fault.lua: raising errors at the line of the person who can mend them. A frame of bindings/
--- never is that line, and one of scripts/lib or scripts/commands only where nobody else is on the
--- stack. Needs the host's paths alone.

local host = require "limax.host"

local fault = {}

local bindings = host.home .. "/bindings/"
local library = { host.home .. "/scripts/lib/", host.home .. "/scripts/commands/" }

local function begins(text, beginning) return text:sub(1, #beginning) == beginning end

-- Stack frames by who wrote them: nil for C, "engine", "library" or "user".
local function writer(info)
  if info.what == "C" or info.currentline < 0 then return nil end
  local path = info.source:sub(2)
  if begins(path, bindings) then return "engine" end
  for _, folder in ipairs(library) do
    if begins(path, folder) then return "library" end
  end
  return "user"
end

--- Where the call came from: the nearest line of a user's file, else the nearest one outside
--- bindings/.
---@return string file as Lua shows it in messages; "?" where there is none
---@return integer line
---@return string source the file's whole path
function fault.place()
  local nearest
  local level = 2
  while true do
    local info = debug.getinfo(level, "Sl")
    if not info then break end
    local who = writer(info)
    if who == "user" then return info.short_src, info.currentline, info.source:sub(2) end
    if who == "library" and not nearest then nearest = info end
    level = level + 1
  end
  if nearest then return nearest.short_src, nearest.currentline, nearest.source:sub(2) end
  return "?", 0, "?"
end

--- `FILE:LINE` of fault.place().
---@return string
function fault.where()
  local file, line = fault.place()
  return ("%s:%d"):format(file, line)
end

--- `text` with "FILE:LINE: " of fault.place() before it.
---@param text string
---@return string
function fault.placed(text)
  local file, line = fault.place()
  return file == "?" and text or ("%s:%d: %s"):format(file, line, text)
end

--- Raises `text` at fault.place().
---@param text string
function fault.raise(text) error(fault.placed(text), 0) end

return fault
