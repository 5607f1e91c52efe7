--- picture.lua: writes a robot as an SVG file: six poses of its simulation, or the current pose of
--- a robot in motion.

local engine = require "limax.engine"
local host = require "limax.host"
local kind = require "limax.tools.repl.kind"
local motion = require "limax.draw.motion"
local robots = require "limax.robot.robot"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local sheet = require "limax.draw.sheet"
local view = require "limax.draw.picture.view"

local picture = {}

local STILL = 800 -- px, the width of one pose

local of_pose = schema.fields { title = schema.any }
local of_walk = schema.fields { device = schema.any, duration = schema.any, scene = schema.any,
  title = schema.any, trial = schema.any }

-- The first free name in this folder.
local function free_name()
  for number = 1, math.huge do
    local name = ("picture-%d.svg"):format(number)
    if not host.file.exists(name) then return name end
  end
end

local function draw_pose(path, moving, title)
  local film = motion.now(moving.finished(), moving:positions():table(), moving.time or 0)
  local drawn = sheet.new({ film }, { view = view.of.side, width = STILL }):render("svg",
    { title = title or "a robot in motion" })
  return host.file.write_atomic(path, drawn)
end

--- Simulates a robot and writes six poses as an SVG file; of a robot in motion it writes the
--- current pose. Returns the path.
---@param robot limax.robot|limax.scored_robot|limax.robot_in_motion
---@param file? string the first free name of picture-1.svg, picture-2.svg, ... if absent
---@param options? { duration?: number, scene?: table, trial?: integer, device?: string,
--- title?: string } s
---@return string path
function picture.picture(robot, file, options)
  local moving = kind.of(robot) == "limax.robot_in_motion"
  if not moving and (type(robot) ~= "table" or type(robot.simulate) ~= "function") then
    schema.refuse("picture", "a robot", robot)
  end
  if file ~= nil and type(file) ~= "string" then
    schema.refuse("picture", "the name of a file", file)
  end
  if file and not file:lower():match "%.svg$" then
    engine.fail(("picture: %s: its name must end in .svg; limax picture writes other formats")
      :format(file))
  end
  options = schema.demand(moving and of_pose or of_walk, options, "picture")
  if scored_robot.is(robot) then robot = robots.new(robot) end
  local path = host.file.absolute(file or free_name())
  local draw = moving and draw_pose or sheet.write_film_strip
  local drawn, message = draw(path, robot, moving and options.title or options)
  if not drawn then engine.fail("picture: " .. message) end
  return path
end

return picture
