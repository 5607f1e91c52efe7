--- flow.lua: wind and current in pictures: arrows in their direction.

local flow = require "limax.draw.picture.flow"
local stage = require "limax.draw.picture.stage"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local suite = require("limax.test").suite "draw_flow"

local function windy(velocity) return { wind = { velocity = velocity, drag = 0.01 } } end

-- What is drawn of the flows of a scene at 100 px/m and 10 px a capital: where arrows start and
-- end, and the numbers of dots, lines and rings.
local function drawn(scene, name)
  local got, canvas = { tips = {}, starts = {}, dots = 0, rings = 0 }, {}
  function canvas.line(_, from) got.starts[#got.starts + 1] = from end
  function canvas.polygon(_, points) got.tips[#got.tips + 1] = points[1] end
  function canvas.circle(_, _, _, style)
    local kind = style.fill and "dots" or "rings"
    got[kind] = got[kind] + 1
  end
  function canvas.text() end
  flow.draw(canvas, stage.new(world.of(scene)), { view = view.of[name], scale = 100, text = 10,
    capital = 1, left = 0 }, 0)
  return got
end

-- Right and up on the page, px, of the arrow of a wind.
local function arrow(velocity, name)
  local got = drawn(windy(velocity), name)
  local from, tip = got.starts[1], got.tips[1]
  return tip[1] - from[1], from[2] - tip[2]
end

suite:test("an arrow has the direction of the flow as the eye sees it", function(t)
  for _, name in ipairs(view.names) do
    for _, v in ipairs { { 3, 0, 0 }, { 0, 2, 0 }, { 1, -2, 2 }, { 0.4, 1, -2 } } do
      local x, y = arrow(v, name)
      local right, up = view.of[name].project(v)
      t:near(math.atan2(y, x), math.atan2(up, right), { atol = 1e-9 })
    end
  end
end)

suite:test("a flow along the line of sight is a dot or a cross in a ring", function(t)
  for up, counts in pairs { [2] = { 1, 1, 0, 0 }, [-2] = { 1, 0, 2, 0 } } do
    local got = drawn(windy { 0, 0, up }, "top")
    t:equal({ got.rings, got.dots, #got.starts, #got.tips }, counts)
  end
end)

return suite
