--- flow.lua: wind and current in a picture: an arrow for each as the eye sees its direction, with
--- its speed, below one another. Sizes are in capitals of the picture's text.

local polygon = require "limax.draw.picture.polygon"
local world = require "limax.draw.picture.world"

local flow = {}

-- s: an arrow is as long as the way of the flow in this time, true to the scale bar, ...
local TIME = 0.03
-- ... but within these, so that it is seen and stays a mark; and so high at most
local SHORTEST, LONGEST, TALLEST = 2.2, 8, 4
-- what is seen under less than this share of its length is a disc: a dot when it comes towards the
-- eye, a cross when it goes away
local END_ON, DISC = 0.15, 0.75
-- length of an arrow's head, half its width, and of the shaft
local HEAD, BARB, SHAFT = 1.2, 0.5, 0.22
-- of a row without its arrow, and left of the arrows, between arrow and text
local ROW, GAP = 2, 1

-- A flow as the page shows it: right and up, m; nil where it goes along the line of sight.
local function seen_of(each, view)
  local v = each.velocity
  local x, y = view.project { v[1] * TIME, v[2] * TIME, v[3] * TIME }
  local length = math.sqrt(x * x + y * y)
  if length < END_ON * each.speed * TIME * view.short then return nil end
  return { x = x / length, y = y / length, length = length }
end

-- Capitals that a row takes, at any scale.
local function height_of(each, view)
  local seen = seen_of(each, view)
  return math.max(ROW, seen and math.min(TALLEST, LONGEST * math.abs(seen.y)) + ROW - 1 or ROW)
end

--- Capitals above what is drawn that the flows of a world take: none where nothing flows.
---@param stage limax.picture.stage
---@param view limax.picture.view
---@return number
function flow.room(stage, view)
  local sum = 0
  for _, each in ipairs(stage.flows) do sum = sum + height_of(each, view) end
  return sum
end

-- Draws an arrow around a place; `width` and `height` are its parts, px.
local function draw_arrow(canvas, at, width, height, text, ink)
  local length = math.sqrt(width ^ 2 + height ^ 2)
  local x, y = width / length, height / length
  local from = { at[1] - width / 2, at[2] + height / 2 }
  local tip = { at[1] + width / 2, at[2] - height / 2 }
  local neck = { tip[1] - HEAD * text * x, tip[2] + HEAD * text * y }
  canvas:line(from, neck, ink, math.max(1.2, SHAFT * text))
  canvas:polygon({ tip, { neck[1] + BARB * text * y, neck[2] + BARB * text * x },
    { neck[1] - BARB * text * y, neck[2] - BARB * text * x } }, ink)
end

-- Draws what goes along the line of sight.
local function draw_disc(canvas, at, away, text, ink)
  local ring, wide = {}, math.max(1, SHAFT * text / 2)
  for k = 0, 24 do
    local angle = 2 * math.pi * k / 24
    ring[k + 1] = { at[1] + DISC * text * math.cos(angle), at[2] + DISC * text * math.sin(angle) }
  end
  canvas:path(ring, ink, wide)
  if not away then
    canvas:dot(at, SHAFT * text, ink)
    return
  end
  local reach = DISC * text * math.sqrt(1 / 2)
  for _, side in ipairs { -1, 1 } do
    canvas:line({ at[1] - reach, at[2] - side * reach },
      { at[1] + reach, at[2] + side * reach }, ink, wide)
  end
end

--- Draws the flows of a world at the left, from `top` on.
---@param canvas limax.picture.pixels|limax.picture.vectors
---@param stage limax.picture.stage
---@param frame limax.picture.frame
---@param top number px
function flow.draw(canvas, stage, frame, top)
  local text, rows, widest = frame.text, {}, 2 * DISC * frame.text
  for k, each in ipairs(stage.flows) do
    local seen = seen_of(each, frame.view)
    rows[k] = { seen = seen, height = height_of(each, frame.view) * text }
    if seen then
      local length = math.min(math.max(seen.length * frame.scale, SHORTEST * text), LONGEST * text)
      length = math.min(length, TALLEST * text / math.max(math.abs(seen.y), 1e-9))
      rows[k].x, rows[k].y = length * seen.x, length * seen.y
      widest = math.max(widest, math.abs(rows[k].x))
    end
  end
  local left = frame.left + GAP * text
  for k, each in ipairs(stage.flows) do
    local row, ink = rows[k], world.flow_ink[each.kind]
    local middle = top + row.height / 2
    local at = { left + widest / 2, middle }
    if row.seen then
      draw_arrow(canvas, at, row.x, row.y, text, ink)
    else
      local v, sight = each.velocity, frame.view.sight
      draw_disc(canvas, at, polygon.dot(v, sight) > 0, text, ink)
    end
    canvas:text(left + widest + GAP * text, middle + text / 2, world.flow_label(each), text, ink)
    top = top + row.height
  end
end

return flow
