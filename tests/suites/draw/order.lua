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

-- The faces of a cube that look at the eye.
local function cube_faces(low, edge, sight)
  local corners, faces = {}, {}
  for k = 0, 7 do
    corners[k + 1] = {}
    for c = 1, 3 do
      corners[k + 1][c] = low[c] + (math.floor(k / 2 ^ (c - 1)) % 2) * edge
    end
  end
  for k, face in ipairs(block_picture.faces(0)) do
    faces[k] = { corners = face.corners, letter = "e" }
  end
  return skin.visible(faces, corners, COLORS, sight)
end

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

-- Asks at random points of pieces whether a later piece is painted over them that is behind them.
-- Returns the number of pieces that were painted over such a point.
local function check_order(t, from, items, faces, random)
  local sorted, painted, asked = order.new(items, from.sight), {}, 0
  for _, face in ipairs(faces) do sorted:add(face) end
  sorted:each(function(piece)
    local flat = {}
    for k, p in ipairs(piece.points) do flat[k] = { from.project(p) } end
    local p = piece.points
    local one, other = {}, {}
    for c = 1, 3 do one[c], other[c] = p[2][c] - p[1][c], p[3][c] - p[1][c] end
    painted[#painted + 1] = { points = p, flat = flat, normal = polygon.cross(one, other) }
  end)
  for k, piece in ipairs(painted) do
    local point, sum, weights = { 0, 0, 0 }, 0, {}
    for m = 1, #piece.points do
      weights[m] = random:uniform() + 0.1
      sum = sum + weights[m]
    end
    for m, p in ipairs(piece.points) do
      for c = 1, 3 do point[c] = point[c] + weights[m] / sum * p[c] end
    end
    local x, y = from.project(point)
    for later = k + 1, #painted do
      local over = painted[later]
      local rate = polygon.dot(over.normal, from.sight)
      if rate < 0 and contains(over.flat, x, y) then
        -- the other piece along the line of sight, from the point away from the eye
        local depth = (polygon.dot(over.normal, over.points[1])
          - polygon.dot(over.normal, point)) / rate
        -- pieces that touch may be painted either way
        t:ok(depth < 0.02, ("a piece is painted %.3f m behind another"):format(depth))
        asked = asked + 1
      end
    end
  end
  return asked
end

suite:test("no piece is painted over one in front of it", { limit = 120 }, function(t)
  local random = limax.engine.random(5, 1, "user")
  local function between(low, high) return low + (high - low) * random:uniform() end
  for _, name in ipairs(view.names) do
    local from, asked = view.of[name], 0
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
            for _, face in ipairs(cube_faces(low, 0.25, from.sight)) do
              faces[#faces + 1] = face
            end
          end
        end
      end
      local block = block_picture.spaces(block_picture.corners({ 0, 0, 1.3, 0.9, 0.3, 0.3, 0.1 },
        { 0.3, 0.4, 0.2 }))
      local items = stage.pieces(stage.new(world.of { boxes = boxes, spheres = spheres }),
        SLAB, from.sight, block, "#b98b4f")
      asked = asked + check_order(t, from, items, faces, random)
    end
    t:ok(asked > 30, ("%s: %d places were asked"):format(name, asked))
  end
end)

suite:test("faces of a body are painted in order", { limit = 30 }, function(t)
  local random, n = limax.engine.random(6, 1, "user"), 4
  local voxel, mass_at, points = {}, {}, {}
  for x = 1, n do
    voxel[x] = {}
    for y = 1, n do
      voxel[x][y] = {}
      for z = 1, n do voxel[x][y][z] = random:uniform() < 0.6 and "e" or "." end
    end
  end
  for site = 0, (n + 1) ^ 3 - 1 do
    local row = math.floor(site / (n + 1))
    points[site + 1] = { site % (n + 1) / 4, row % (n + 1) / 4, math.floor(row / (n + 1)) / 4 }
    mass_at[site] = site + 1
  end
  for _, name in ipairs { "side", "iso" } do
    local from = view.of[name]
    local faces = skin.visible(skin.faces(voxel, mass_at), points, COLORS, from.sight)
    t:ok(check_order(t, from, {}, faces, random) > 5, name)
  end
end)

suite:test("a plane cuts a polygon in two that make the whole", function(t)
  local square = { points = { { 0, 0, 0 }, { 2, 0, 0 }, { 2, 2, 0 }, { 0, 2, 0 } },
    edges = { true, true, true, true }, look = {} }
  local front, behind = polygon.split(square, { 1, 0, 0 }, 0.5)
  t:equal(front.points, { { 0.5, 0, 0 }, { 2, 0, 0 }, { 2, 2, 0 }, { 0.5, 2, 0 } })
  -- the cut has no line
  t:equal(front.edges, { true, true, true, false })
  t:equal(behind.points, { { 0, 0, 0 }, { 0.5, 0, 0 }, { 0.5, 2, 0 }, { 0, 2, 0 } })
  t:equal(behind.edges, { true, false, true, true })
  t:equal({ polygon.split(square, { 1, 0, 0 }, 0.01, 0.02) }, { square })
  t:equal(select(2, polygon.split(square, { 1, 0, 0 }, 1.99, 0.02)), square)
  t:equal({ polygon.crossing(square, { 1, 0, 0 }, 0.5) }, { { 0.5, 0, 0 }, { 0.5, 2, 0 } })
  t:equal(polygon.crossing(square, { 0, 0, 1 }, 1), nil)
end)

return suite
