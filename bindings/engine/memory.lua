--- memory.lua: the collector sees a handle as a few bytes, however much the engine holds behind it.
--- So whoever makes a handle comes here first, and garbage is collected when the engine's bytes, or
--- the handles made, outgrow a limit.

local C = require("limax.engine.abi").C

local memory = {}

-- bytes below which nobody minds
local FLOOR = 64 * 1024 * 1024
-- handles made between two collections, so that things which cost more than bytes (threads) stay
-- few
local HANDLES = 256

local limit = FLOOR
local made = 0

--- Bytes that live objects hold outside Lua.
---@return integer
function memory.bytes_held() return tonumber(C.limax_bytes_held()) end

--- Counts a handle about to be made, and collects garbage where the limits say so.
---@param weight integer|nil how many handles this one counts for
---@return boolean collected
function memory.collect(weight)
  made = made + (weight or 1)
  if made < HANDLES and memory.bytes_held() <= limit then return false end
  collectgarbage "collect"
  made = 0
  -- the next collection comes when what lives now has doubled, so its cost stays a share of the
  -- work
  limit = math.max(FLOOR, 2 * memory.bytes_held())
  return true
end

return memory
