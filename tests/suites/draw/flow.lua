--- flow.lua: wind and current in pictures: arrows in their direction, longer if faster, with words.

local sheet = require "limax.draw.sheet"
local flow = require "limax.draw.picture.flow"
local limax = require "limax"
local painted = require "support.painted"
local repl_picture = require "limax.tools.repl.picture"
local source = require "limax.base.source"
local stage = require "limax.draw.picture.stage"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local suite = require("limax.test").suite "draw_flow"

local function windy(velocity) return { wind = { velocity = velocity, drag = 0.01 } } end

-- What is drawn of the flows of a scene at 100 px/m and 10 px a capital: ends of the arrows,
-- numbers of dots, lines and rings, and the texts.
local function drawn(scene, name)
  local got = { tips = {}, starts = {}, dots = 0, lines = 0, rings = 0, texts = {} }
  local canvas = {}
  function canvas.line(_, from)
    got.lines = got.lines + 1
    got.starts[#got.starts + 1] = from
  end
  function canvas.polygon(_, points) got.tips[#got.tips + 1] = points[1] end
  function canvas.circle(_, _, _, style)
    local kind = style.fill and "dots" or "rings"
    got[kind] = got[kind] + 1
  end
  function canvas.text(_, _, _, text) got.texts[#got.texts + 1] = text end
  local turned = stage.new(world.of(scene))
  flow.draw(canvas, turned, { view = view.of[name], scale = 100, text = 10, capital = 1, left = 0 },
    0)
  return got, flow.room(turned)
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
    t:equal({ got.rings, got.dots, got.lines, #got.tips }, counts)
  end
end)

suite:test("flows in words", function(t)
  for words, scene in pairs {
    ["wind of 5 m/s along x"] = windy { 5, 0, 0 },
    ["wind of 5 m/s along (0.6, 0.8, 0)"] = windy { 3, 4, -0 },
    ["still air"] = windy { 0, 0, 0 },
    ["a fluid"] = { drag = { current = { 0, 0, 0 } } },
    ["a current of 0.5 m/s along -z"] = { drag = { current = { 0, 0, -0.5 } } },
    ["force magnet"] = { magnet = { force = "f = vec(0, 0, 0);" } },
    [""] = {},
  } do t:equal(world.words(world.of(scene)), words) end
end)

suite:test("film strips and pictures in the REPL have the arrows and the words",
  function(t)
    local scene = limax.scenes.land { wind = { velocity = { 0, 2, 0 }, drag = 0.01 },
      drag = { density = 1.2, current = { -0.5, 0, 0 } } }
    local moving = limax.robot { voxels = painted.VOXELS }:begin { duration = 1, settle = 0,
      scene = scene }
    for _, svg in ipairs { sheet.film_strip(painted.walked_in(scene)),
      source.read(repl_picture.picture(moving, t:folder() .. "/now.svg")) } do
      for _, ink in pairs(world.flow_ink) do
        t:ok(select(2, svg:gsub(ink, "")) >= 3, "shaft, head and text in " .. ink)
      end
      t:ok(svg:find(">wind 2 m/s<", 1, true) and svg:find(">current 0.5 m/s<", 1, true))
      t:ok(svg:find "<desc>[^<]*wind of 2 m/s along y, a current of 0%.5 m/s along %-x[^<]*</desc>",
        "for screen readers")
    end
  end)

return suite
