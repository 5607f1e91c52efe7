--- memory.lua: Lua's garbage collector does not see the engine's memory behind a handle. So every
--- function that makes a handle calls `memory.collect` first, which collects garbage when the
--- engine's bytes, or the handles made, exceed a limit.

local C = require("limax.engine.abi").C

local memory = {}

-- bytes below which nothing is collected
local FLOOR = 64 * 1024 * 1024
-- handles made and not freed between two collections; they also bound other resources, such as
-- threads
local HANDLES = 256

local limit = FLOOR
local made = 0

--- Bytes that live objects hold outside Lua.
---@return integer
function memory.bytes_held() return tonumber(C.limax_bytes_held()) end

--- Counts a handle that will be made, and collects garbage if a limit is exceeded.
---@return boolean collected
function memory.collect()
  made = made + 1
  if made < HANDLES and memory.bytes_held() <= limit then return false end
  -- the first collection drops views, the second their states and what these own
  collectgarbage "collect"
  collectgarbage "collect"
  made = 0
  -- collect again when the live memory has doubled, so that the cost stays proportional to the work
  limit = math.max(FLOOR, 2 * memory.bytes_held())
  return true
end

--- Counts a handle that a script freed: nothing needs to be collected for it.
function memory.freed() made = math.max(0, made - 1) end

return memory
