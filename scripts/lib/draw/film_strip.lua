--- film_strip.lua: a robot's walk as one SVG: six poses from the side, and below them the whole
--- walk with the path of the centre of mass.

local engine = require "limax.engine"
local host = require "limax.host"
local motion = require "limax.draw.motion"
local sheet = require "limax.draw.sheet"
local view = require "limax.draw.picture.view"

local film_strip = {}

--- Poses of a film strip.
film_strip.POSES = 6
-- px: of the page, of a capital, and a row of poses at most
local WIDTH, TEXT, ROW = 1000, 8, 190

--- The SVG text of a simulated robot whose "position" was recorded.
---@param options? { title?: string, prefix?: string } prefix: see canvas.lua
function film_strip.svg(robot, options)
  options = options or {}
  local film = motion.of(robot, sheet.evenly(robot:duration(), film_strip.POSES))
  local title, speed = options.title or "robot", robot:speed()
  local facts = ("%.3f m in %.4g s: %.3f m/s, %.2f body lengths per second"):format(
    robot:distance(), robot:duration(), speed, speed / robot:length())
  return sheet.new({ film }, { view = view.of.side, width = WIDTH, text = TEXT, most = ROW,
    title = title, facts = facts, track = true }):render("svg",
    { title = title, prefix = options.prefix })
end

--- Simulates a robot with its positions recorded and writes its film strip. `nil, message` where
--- the simulation fails: there is nothing to draw.
---@return limax.scored_robot|nil
---@return string|nil message
function film_strip.write(path, robot, options)
  local walked, reason = motion.simulate(robot, options)
  if not walked then return nil, reason end
  local ok, message = host.file.write_atomic(path, film_strip.svg(walked, options))
  if not ok then engine.fail(message) end
  return walked
end

return film_strip
