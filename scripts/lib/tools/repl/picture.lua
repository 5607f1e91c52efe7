--- picture.lua: writes a robot as an SVG file: six poses of its simulation, or the current pose of
--- a robot in motion; and starts a program that shows the file.

local choice = require "limax.base.choice"
local engine = require "limax.engine"
local film_strip = require "limax.draw.film_strip"
local host = require "limax.host"
local kind = require "limax.tools.repl.kind"
local motion = require "limax.draw.motion"
local robots = require "limax.robot.robot"
local schema = require "limax.engine.schema"
local scored_robot = require "limax.robot.scored_robot"
local sheet = require "limax.draw.sheet"
local shell = require "limax.base.shell"
local suggest = require "limax.engine.suggest"
local view = require "limax.draw.picture.view"

local picture = {}

local STILL = 800 -- px, the width of one pose
local OF_POSE = { "open", "title" }
local OF_WALK = { "device", "duration", "open", "scene", "title" }

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
  local written, message = host.file.write_atomic(path, drawn)
  if not written then engine.fail("picture: " .. message) end
end

-- Starts a program that shows a file: BROWSER, else that of the desktop.
local function show(path)
  -- BROWSER may be a list
  for _, name in ipairs { (os.getenv "BROWSER" or ""):match "^[^:]*", "xdg-open", "open" } do
    local word = name:match "^%S+"
    local is_there = word
      and os.execute(("command -v %s >/dev/null 2>&1"):format(shell.quoted(word))) == 0
    if is_there then
      os.execute(("%s %s >/dev/null 2>&1 </dev/null &"):format(name, shell.quoted(path)))
      return
    end
  end
  io.write("found no program to show it (BROWSER or xdg-open)\n")
end

-- Whether to show the picture, and the other options.
local function options_of(options, names)
  if options ~= nil and type(options) ~= "table" then
    engine.fail("picture: expected a table of options, got " .. schema.show(options))
  end
  local drawing, valid = {}, {}
  for _, name in ipairs(names) do valid[name] = true end
  for _, name in ipairs(choice.sorted_keys(options or {})) do
    if not valid[name] then
      engine.fail(("picture: unknown option %s%s"):format(name, suggest.ending(name, names)))
    end
    drawing[name] = options[name]
  end
  drawing.open = nil
  return options and options.open, drawing
end

--- Simulates a robot and writes six poses; of a robot in motion it writes the current pose.
---@param robot limax.robot|limax.scored_robot|limax.robot_in_motion
---@param options? { duration?: number, scene?: table, device?: string, title?: string,
--- open?: boolean }
---@return string path
function picture.write(robot, file, options)
  local moving = kind.of(robot) == "limax.robot_in_motion"
  if not moving and (type(robot) ~= "table" or type(robot.simulate) ~= "function") then
    engine.fail("picture: expected a robot, got " .. schema.show(robot))
  end
  if file ~= nil and type(file) ~= "string" then
    engine.fail("picture: expected the name of a file, got " .. schema.show(file))
  end
  local opens, drawing = options_of(options, moving and OF_POSE or OF_WALK)
  if scored_robot.is(robot) then robot = robots.new(robot) end
  local path = host.file.absolute(file or free_name())
  if moving then
    draw_pose(path, robot, drawing.title)
  else
    local drawn, message = film_strip.write(path, robot, drawing)
    if not drawn then engine.fail("picture: " .. message) end
  end
  if opens then show(path) end
  return path
end

return picture
