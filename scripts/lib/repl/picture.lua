--- picture.lua: what a robot looks like while it walks, as an SVG file.

local engine = require "limax.engine"
local film_strip = require "limax.film_strip"
local host = require "limax.host"
local robots = require "limax.robot"
local schema = require "limax.schema"
local scored_robot = require "limax.scored_robot"

local picture = {}

-- The first name of this folder that nobody has.
local function free_name()
  for number = 1, math.huge do
    local name = ("picture-%d.svg"):format(number)
    if not host.file.exists(name) then return name end
  end
end

--- Simulates a robot, writes six poses of it and prints the path.
---@param robot limax.robot|limax.scored_robot
---@param file? string
---@param options? { duration?: number, scene?: table, device?: string, title?: string }
---@return string path
function picture.write(robot, file, options)
  if type(robot) ~= "table" or type(robot.simulate) ~= "function" then
    engine.fail("picture: expected a robot, got " .. schema.show(robot))
  end
  if file ~= nil and type(file) ~= "string" then
    engine.fail("picture: expected the name of a file, got " .. schema.show(file))
  end
  if scored_robot.is(robot) then robot = robots.new(robot) end
  local path = host.file.absolute(file or free_name())
  local drawn, message = film_strip.write(path, robot, options)
  if not drawn then engine.fail("picture: " .. message) end
  return path
end

return picture
