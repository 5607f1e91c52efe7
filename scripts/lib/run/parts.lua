--- parts.lua: reads a file of a run folder in parts, if its hash is a sum over its rows: with many
--- robots it is larger than a text of Lua may be.

local bit = require "bit"
local ffi = require "ffi"

local host = require "limax.host"
local source = require "limax.base.source"

local parts = {}

-- Bytes that are read at a time, and at least one row.
local CHUNK = 2 ^ 24

---@class limax.parts
---@field left integer bytes that were not read yet
---@field row integer bytes of a row
local Parts = {}
Parts.__index = Parts

--- Opens a file, or returns nil, a message, and whether it is missing.
---@param part any[] of the journal: bytes, hash, bytes of a row
---@return limax.parts|nil
---@return string|nil message
---@return boolean|nil missing
function parts.open(path, part)
  local problem = source.foreign(path)
  if problem then return nil, problem end
  local file, message, missing = source.open(path)
  if not file then return nil, message, missing end
  return setmetatable({ file = file, left = part[1], hash = part[2], row = part[3], sum = 0ULL },
    Parts)
end

--- The next bytes, as many that whole rows are left: fewer where the file ends, or the bytes that
--- the journal states.
function Parts:read(size)
  if size > self.left then return "" end
  local text = self.file:read(size) or ""
  self.left, self.is_short = self.left - size, self.is_short or #text < size
  local digits = host.xxh3(text, self.row, self.left / self.row)
  self.sum = self.sum + ffi.cast("uint64_t", tonumber(digits:sub(1, 8), 16)) * 2ULL ^ 32
    + tonumber(digits:sub(9), 16)
  return text
end

--- Rows that are read at a time.
function Parts:step() return math.max(1, math.floor(CHUNK / self.row)) end

--- Closes the file. Had it the bytes that the journal states?
function Parts:close()
  local ends = self.left == 0 and not self.is_short and not self.file:read(1)
  self.file:close()
  return ends and bit.tohex(self.sum, 16) == self.hash
end

--- Has a file the bytes that the journal states? Otherwise as `open`.
---@param part any[] bytes, hash, and of an array those of a row
---@return boolean|nil
function parts.is_whole(path, part)
  if not part[3] then
    local text, message, missing = source.read_own(path)
    if not text then return nil, message, missing end
    return #text == part[1] and host.xxh3(text) == part[2]
  end
  local file, message, missing = parts.open(path, part)
  if not file then return nil, message, missing end
  file:read(file.left % file.row)
  while file.left > 0 do file:read(math.min(file.left, file:step() * file.row)) end
  return file:close()
end

return parts
