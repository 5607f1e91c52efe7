--- recorded.lua: fields of a robot's record as scripts read them. Of a table they get a copy: what
--- they change in it is not written.

local source = require "limax.base.source"

local recorded = {}

-- Key of the copies that a robot has handed out: for each table of its record one copy.
local COPIES = {}

--- A field of a robot's record.
---@param robot limax.scored_robot
---@param name string of the field
---@return any
function recorded.field(robot, name)
  local value = robot.record[name]
  if type(value) ~= "table" then return value end
  local copies = rawget(robot, COPIES)
  if not copies then
    copies = setmetatable({}, { __mode = "k" })
    rawset(robot, COPIES, copies)
  end
  copies[value] = copies[value] or source.copy(value)
  return copies[value]
end

return recorded
