--- flow.lua: wind and current in a picture: for each an arrow in its direction on the page, with its
--- speed, below one another. Sizes are in capitals of the picture's text.

local polygon = require "limax.draw.picture.polygon"
local world = require "limax.draw.picture.world"

local flow = {}

-- s: an arrow is as long as the distance that the flow moves in this time, true to the scale bar, ...
local TIME = 0.03
-- ... but within these lengths, and at most so high
local SHORTEST, LONGEST, TALLEST = 2.2, 8, 4
-- a flow that is seen under less than this share of its length goes along the line of sight: a ring
-- with a dot when it comes towards the eye, with a cross when it goes away
local END_ON, RING = 0.15, 0.75
-- length of an arrow's head, half its width, and the width of the shaft
local HEAD, BARB, SHAFT = 1.2, 0.5, 0.22
-- height of a row without its arrow; left of the arrows, and between arrow and text
local ROW, GAP = 2, 1

-- The direction of a flow on the page, and its length there, m; nil where it goes along the line of
-- sight.
local function seen_of(each, view)
  local v = each.velocity
  local x, y = view.project { v[1] * TIME, v[2] * TIME, v[3] * TIME }
  local length = math.sqrt(x * x + y * y)
  if length < END_ON * each.speed * TIME * view.short then return nil end
  return { x = x / length, y = y / length, length = length }
end

-- Capitals that a row takes at any scale.
local function height_of(each, view)
  local seen = seen_of(each, view)
  return math.max(ROW, seen and math.min(TALLEST, LONGEST * math.abs(seen.y)) + ROW - 1 or ROW)
end

--- Capitals that the flows of a world take above the robot: 0 where nothing flows.
---@param stage limax.picture.stage
---@param view limax.picture.view
---@return number
function flow.room(stage, view)
  local sum = 0
  for _, each in ipairs(stage.flows) do sum = sum + height_of(each, view) end
  return sum
end

-- Draws an arrow around a place; `width` and `height` are its extent, px.
local function draw_arrow(canvas, at, width, height, text, ink)
  local length = math.sqrt(width ^ 2 + height ^ 2)
  local x, y = width / length, height / length
  local tip = { at[1] + width / 2, at[2] - height / 2 }
  local neck = { tip[1] - HEAD * text * x, tip[2] + HEAD * text * y }
  canvas:line({ at[1] - width / 2, at[2] + height / 2 }, neck, ink, math.max(1.2, SHAFT * text))
  canvas:polygon({ tip, { neck[1] + BARB * text * y, neck[2] + BARB * text * x },
    { neck[1] - BARB * text * y, neck[2] - BARB * text * x } }, { fill = ink })
end

local function draw_end_on(canvas, at, away, text, ink)
  local wide, reach = math.max(1, SHAFT * text / 2), RING * text * math.sqrt(1 / 2)
  canvas:circle(at, RING * text, { stroke = ink, width = wide })
  if not away then
    canvas:circle(at, SHAFT * text, { fill = ink })
    return
  end
  for _, side in ipairs { -1, 1 } do
    canvas:line({ at[1] - reach, at[2] - side * reach },
      { at[1] + reach, at[2] + side * reach }, ink, wide)
  end
end

--- Draws the flows of a world at the left, from `top` on.
---@param canvas limax.canvas
---@param stage limax.picture.stage
---@param frame limax.picture.frame
---@param top number px
function flow.draw(canvas, stage, frame, top)
  local text, arrows, widest = frame.text, {}, 2 * RING * frame.text
  for k, each in ipairs(stage.flows) do
    local seen = seen_of(each, frame.view)
    if seen then
      local length = math.min(math.max(seen.length * frame.scale, SHORTEST * text), LONGEST * text)
      length = math.min(length, TALLEST * text / math.max(math.abs(seen.y), 1e-9))
      arrows[k] = { length * seen.x, length * seen.y }
      widest = math.max(widest, math.abs(arrows[k][1]))
    end
  end
  local left = frame.left + GAP * text
  for k, each in ipairs(stage.flows) do
    local arrow, ink = arrows[k], world.flow_ink[each.kind]
    local height = height_of(each, frame.view) * text
    local at = { left + widest / 2, top + height / 2 }
    if arrow then
      draw_arrow(canvas, at, arrow[1], arrow[2], text, ink)
    else
      draw_end_on(canvas, at, polygon.dot(each.velocity, frame.view.sight) > 0, text, ink)
    end
    canvas:text(left + widest + GAP * text, at[2] + text / 2, world.flow_label(each),
      { size = text / frame.capital, fill = ink })
    top = top + height
  end
end

return flow
