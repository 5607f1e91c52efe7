--- fault.lua: the error type of limax, and the line that an error names: the nearest line of a
--- user's file on the stack, else the nearest line outside bindings/.

local host = require "limax.host"

local fault = {}

--- An error of limax. `tostring` gives place and text; the methods of strings work on it too, so
--- that a script can read a caught error as it reads Lua's own.
---@class limax.error
---@field kind "misuse"|"script"|"usage"|"failed"|"damaged"|"memory"|"device"|"disk"|"defect"
---@field status integer|nil exit status of a command that it ends; nil: shown with a traceback
---@field place string "FILE:LINE: ", or ""
---@field text string
---@field traceback string|nil of where it was raised first
local Error = {}

function Error:__tostring() return self.place .. tostring(self.text) end

function Error.__concat(left, right) return tostring(left) .. tostring(right) end

function Error.__index(_, key)
  local method = string[key]
  return method and function(self, ...) return method(tostring(self), ...) end
end

--- Raises an error.
---@param fields { kind: string, status: integer|nil, place: string|nil, text: string }
function fault.throw(fields)
  fields.place = fields.place or ""
  error(setmetatable(fields, Error), 0)
end

--- Is a value an error of limax?
function fault.is(value) return getmetatable(value) == Error end

-- Folders of limax's own files.
local OWN = { [host.home .. "/bindings/"] = "engine", [host.home .. "/scripts/lib/"] = "library",
  [host.home .. "/scripts/commands/"] = "library" }

-- The author of a stack frame: nil for C, "engine", "library" or "user".
local function writer(info)
  if info.what == "C" or info.currentline < 0 then return nil end
  local path = info.source:sub(2)
  for folder, who in pairs(OWN) do
    if path:sub(1, #folder) == folder then return who end
  end
  return "user"
end

--- The place of the call: the nearest line of a user's file, else the nearest one outside
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

--- Raises `text` at fault.place().
---@param text string
---@param kind? string "misuse" if left out
function fault.raise(text, kind)
  local file, line = fault.place()
  fault.throw { kind = kind or "misuse", text = text,
    place = file ~= "?" and ("%s:%d: "):format(file, line) or "" }
end

return fault
