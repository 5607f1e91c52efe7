--- painted.lua: a robot that was simulated briefly, and the colours of the pixels of its picture.

local canvases = require "limax.draw.canvas"
local limax = require "limax"
local motion = require "limax.draw.motion"
local palette = require "limax.draw.palette"
local scene = require "limax.draw.picture.scene"
local view = require "limax.draw.picture.view"

local painted = {}

--- A body of every material.
painted.VOXELS = "ees\nccb\n\nsse\nbbc"

--- A robot that was simulated briefly in this scene.
---@param around table
---@param duration? number s
---@return limax.scored_robot
function painted.walked_in(around, duration)
  return assert(motion.simulate(limax.robot { voxels = painted.VOXELS }, { scene = around,
    duration = duration or 0.2 }))
end

--- The number of pixels of each colour, as "#rrggbb", in a film's first pose.
---@param film limax.motion.film
---@param name string of the view
---@param width? integer px
---@return table<string, integer>
---@return limax.picture.frame
function painted.colors_of(film, name, width)
  local frame = scene.frame(film, view.of[name], width or 300, 1, { text = 9, gap = 0, head = 2 })
  local canvas = canvases.new("pixels", frame.panel, frame.height)
  scene.draw(canvas, film, frame, film.poses[1], 1)
  scene.flows(canvas, film, frame)
  local bytes, count = canvas:finish(), {}
  for at = 1, #bytes, 4 do
    local color = ("#%02x%02x%02x"):format(bytes:byte(at, at + 2))
    count[color] = (count[color] or 0) + 1
  end
  return count, frame
end

--- The number of pixels of a colour under any light on a flat face.
---@param count table<string, integer>
---@param hex string
---@return integer
function painted.pixels_of(count, hex)
  local sum, seen = 0, {}
  for k = 0, 400 do
    local shade = palette.shade(hex, 0.5 + k / 400 * 0.6)
    if not seen[shade] then sum, seen[shade] = sum + (count[shade] or 0), true end
  end
  return sum
end

--- The number of pixels of a body.
---@param count table<string, integer>
---@param film limax.motion.film
---@return integer
function painted.body_pixels(count, film)
  local sum = 0
  for letter in pairs(film.used) do
    sum = sum + painted.pixels_of(count, film.colors[letter].hex)
  end
  return sum
end

return painted
