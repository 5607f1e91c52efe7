--- picture.lua: writes a robot as an SVG file: six poses of its simulation.

local engine = require "limax.engine"
local host = require "limax.host"
local robots = require "limax.robot.robot"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local sheet = require "limax.draw.sheet"

local picture = {}

local check = schema.fields { device = schema.any, duration = schema.any, scene = schema.any,
  title = schema.any, trial = schema.any }

-- The first free name in this folder.
local function free_name()
  for number = 1, math.huge do
    local name = ("picture-%d.svg"):format(number)
    if not host.file.exists(name) then return name end
  end
end

--- Simulates a robot and writes six poses as an SVG file. Returns the path.
---@param robot limax.robot|limax.scored_robot
---@param file? string the first free name of picture-1.svg, picture-2.svg, ... if absent
---@param options? { duration?: number, scene?: table, trial?: integer, device?: string,
--- title?: string } s
---@return string path
function picture.picture(robot, file, options)
  if type(robot) ~= "table" or type(robot.simulate) ~= "function" then
    schema.refuse("picture", "a robot", robot)
  end
  if file ~= nil and type(file) ~= "string" then
    schema.refuse("picture", "the name of a file", file)
  end
  if file and not file:lower():match "%.svg$" then
    engine.fail(("picture: %s: its name must end in .svg; limax picture writes other formats")
      :format(file))
  end
  options = schema.demand(check, options, "picture")
  if scored_robot.is(robot) then robot = robots.new(robot) end
  local path = host.file.absolute(file or free_name())
  local drawn, message = sheet.write_film_strip(path, robot, options)
  if not drawn then engine.fail("picture: " .. message) end
  return path
end

return picture
