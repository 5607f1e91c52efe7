--- order.lua: the painting order: a piece is painted before whatever hides it.

local block_picture = require "limax.draw.block_picture"
local limax = require "limax"
local order = require "limax.draw.picture.order"
local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local view = require "limax.draw.picture.view"
local world = require "limax.draw.picture.world"

local suite = require("limax.test").suite "draw_order"

local SLAB = { low = { -2, -2, -2 }, high = { 2, 2, 2 } }
local COLORS = { e = { hex = "#e8743a" } }

-- Does a piece, as the page shows it, contain a point of the page? Nearer to an edge than 1e-4 m2
-- it does not.
local function contains(flat, x, y)
  local least, most = math.huge, -math.huge
  for k, p in ipairs(flat) do
    local q = flat[k % #flat + 1]
    local turn = (q[1] - p[1]) * (y - p[2]) - (q[2] - p[2]) * (x - p[1])
    least, most = math.min(least, turn), math.max(most, turn)
  end
  return least > 1e-4 or most < -1e-4
end

-- Tries a random point of each piece: a piece that is painted later over that point must not be
-- behind it. Returns the number of pieces that were painted over a point.
local function check_order(t, from, items, faces, random)
  local painted, found = {}, 0
  for k, piece in ipairs(order.sorted(items, faces, from.sight)) do
    local flat, p, one, other = {}, piece.points, {}, {}
    for m, point in ipairs(p) do flat[m] = { from.project(point) } end
    for c = 1, 3 do one[c], other[c] = p[2][c] - p[1][c], p[3][c] - p[1][c] end
    painted[k] = { points = p, flat = flat, normal = polygon.cross(one, other) }
  end
  for k, piece in ipairs(painted) do
    local point, sum = { 0, 0, 0 }, 0
    for _, p in ipairs(piece.points) do
      local weight = random:uniform() + 0.1
      sum = sum + weight
      for c = 1, 3 do point[c] = point[c] + weight * p[c] end
    end
    for c = 1, 3 do point[c] = point[c] / sum end
    local x, y = from.project(point)
    for later = k + 1, #painted do
      local over = painted[later]
      local rate = polygon.dot(over.normal, from.sight)
      if rate < 0 and contains(over.flat, x, y) then
        -- how far behind the point the other piece is, along the line of sight
        local depth = (polygon.dot(over.normal, over.points[1])
          - polygon.dot(over.normal, point)) / rate
        -- pieces that touch may be painted either way
        t:ok(depth < 0.02, ("a piece is painted %.3f m behind another"):format(depth))
        found = found + 1
      end
    end
  end
  return found
end

-- Faces of a cube that look at the eye.
local function faces_of(edge, low, sight)
  local mass_at, points = {}, {}
  for site = 0, 7 do
    points[site + 1] = { low[1] + site % 2 * edge, low[2] + math.floor(site / 2) % 2 * edge,
      low[3] + math.floor(site / 4) * edge }
    mass_at[site] = site + 1
  end
  return skin.visible(skin.faces({ { { "e" } } }, mass_at), points, COLORS, sight)
end

suite:test("no piece is painted over one in front of it", function(t)
  local random = limax.engine.random(5, 1, "user")
  local function between(low, high) return low + (high - low) * random:uniform() end
  for _, name in ipairs(view.names) do
    local from, found = view.of[name], 0
    for _ = 1, 12 do
      -- boxes, balls and cubes on a chessboard of 0.5 m: nothing overlaps
      local boxes, spheres, faces = {}, {}, {}
      for i = -2, 1 do
        for j = -2, 1 do
          local x, y = i / 2 + 0.02, j / 2 + 0.02
          local what = random:integer(4)
          if what == 1 then
            boxes[#boxes + 1] = { from = { x, y, 0 },
              to = { x + between(0.1, 0.45), y + between(0.1, 0.45), between(0.05, 0.8) } }
          elseif what == 2 then
            spheres[#spheres + 1] = { center = { x + 0.23, y + 0.23, between(0.23, 0.5) },
              radius = between(0.05, 0.22) }
          else
            local low = { x + between(0, 0.2), y + between(0, 0.2), between(0, 0.6) }
            for _, face in ipairs(faces_of(0.25, low, from.sight)) do
              faces[#faces + 1] = face
            end
          end
        end
      end
      local block = block_picture.spaces(block_picture.corners({ 0, 0, 1.3, 0.9, 0.3, 0.3, 0.1 },
        { 0.3, 0.4, 0.2 }))
      local items = stage.pieces(stage.new(world.of { boxes = boxes, spheres = spheres }),
        SLAB, nil, from.sight, { block }, "#b98b4f")
      found = found + check_order(t, from, items, faces, random)
    end
    t:ok(found > 30, ("%s: %d pieces over another"):format(name, found))
  end
end)
