--- flow.lua: wind and current in a picture: for each an arrow in its direction on the page, with
--- its speed, below one another. Sizes are in capitals of the picture's text.

local polygon = require "limax.draw.picture.polygon"
local world = require "limax.draw.picture.world"

local flow = {}

-- s: an arrow is as long as the distance that the flow moves in this time, true to the scale bar,
-- within these lengths
local TIME = 0.03
local SHORTEST, LONGEST = 2.2, 3.2
-- a flow that appears shorter than this share of its length goes along the line of sight: a ring
-- with a dot if it comes towards the viewer, with a cross if it goes away
local END_ON, RING = 0.15, 0.75
-- length of an arrow's head, half its width, and the width of the shaft
local HEAD, BARB, SHAFT = 1.2, 0.5, 0.22
-- height of a row, and room beside the arrows
local ROW, GAP = LONGEST + 0.2, 1

--- Capitals that the flows of a world take above the robot: 0 where nothing flows.
function flow.room(stage) return ROW * #stage.flows end

-- The arrow of a flow, right and up, px; nil if it goes along the line of sight.
local function arrow_of(each, frame)
  local v, view, text = each.velocity, frame.view, frame.text
  local x, y = view.project { v[1] * TIME, v[2] * TIME, v[3] * TIME }
  local seen = math.sqrt(x * x + y * y)
  if seen < END_ON * each.speed * TIME * view.short then return nil end
  local length = math.min(math.max(seen * frame.scale, SHORTEST * text), LONGEST * text)
  return x / seen, y / seen, length
end

local function draw_arrow(canvas, at, x, y, length, text, ink)
  local tip = { at[1] + x * length / 2, at[2] - y * length / 2 }
  local neck = { tip[1] - HEAD * text * x, tip[2] + HEAD * text * y }
  canvas:line({ at[1] - x * length / 2, at[2] + y * length / 2 }, neck, ink,
    math.max(1.2, SHAFT * text))
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
---@param top number px
function flow.draw(canvas, stage, frame, top)
  local text = frame.text
  for k, each in ipairs(stage.flows) do
    local ink = world.flow_ink[each.kind]
    local at = { frame.left + (GAP + LONGEST / 2) * text, top + (k - 0.5) * ROW * text }
    local x, y, length = arrow_of(each, frame)
    if x then
      draw_arrow(canvas, at, x, y, length, text, ink)
    else
      draw_end_on(canvas, at, polygon.dot(each.velocity, frame.view.sight) > 0, text, ink)
    end
    canvas:text(at[1] + (LONGEST / 2 + GAP) * text, at[2] + text / 2, world.flow_label(each),
      { size = text / frame.capital, fill = ink })
  end
end

return flow
