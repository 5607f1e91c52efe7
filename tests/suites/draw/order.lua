--- order.lua: the painting order: a piece is painted before whatever hides it.

local block_picture = require "limax.draw.block_picture"
local limax = require "limax"
local order = require "limax.draw.picture.order"
local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"
local stage = require "limax.draw.picture.stage"
local view = require "limax.draw.picture.view"

local suite = require("limax.test").suite "draw_order"

local AXES = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }
local SLAB = { low = { -1, -1, -1 }, high = { 1, 1, 1 } }

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
  return skin.visible(faces, corners, { e = { hex = "#e8743a" } }, sight)
end

-- m^2: nearer to an edge than this is on it
local EDGE = 1e-4

-- m on the page around a polygon in which a place may still be on its edge
local MARGIN = 0.05

-- A polygon on the page, and the box around it; cached.
local flats = setmetatable({}, { __mode = "k" })
local function flat_of(piece, from)
  local flat = flats[piece]
  if flat then return flat end
  flat = { low = { math.huge, math.huge }, high = { -math.huge, -math.huge }, area = 0 }
  for k, p in ipairs(piece.points) do
    flat[k] = { from.project(p) }
    for c = 1, 2 do
      flat.low[c] = math.min(flat.low[c], flat[k][c] - MARGIN)
      flat.high[c] = math.max(flat.high[c], flat[k][c] + MARGIN)
    end
  end
  for k, p in ipairs(flat) do
    local q = flat[k % #flat + 1]
    flat.area = flat.area + p[1] * q[2] - q[1] * p[2]
  end
  flats[piece] = flat
  return flat
end

-- The depth at which the line of sight through a point of the page meets a polygon; nil elsewhere.
local function depth_at(piece, x, y, from)
  local points, flat = piece.points, flat_of(piece, from)
  if x < flat.low[1] or x > flat.high[1] or y < flat.low[2] or y > flat.high[2] then return nil end
  local near = math.huge
  for k, p in ipairs(flat) do
    local q = flat[k % #flat + 1]
    -- twice the area between the point and an edge; inside it has one sign
    local turn = (q[1] - p[1]) * (y - p[2]) - (q[2] - p[2]) * (x - p[1])
    near = math.min(near, flat.area > 0 and turn or -turn)
  end
  -- points on edges are left out
  if near < EDGE then return nil, near > -EDGE end
  local one, other = {}, {}
  for c = 1, 3 do one[c], other[c] = points[2][c] - points[1][c], points[3][c] - points[1][c] end
  local normal = polygon.cross(one, other)
  -- a point of that line: what the page shows at along = ... with away = 0 or up = 0
  local at = { 0, 0, 0 }
  local x0, y0 = from.project(at)
  local ax, ay = from.project { 1, 0, 0 }
  local e = from.eye_axis
  local bx, by = from.project(e)
  ax, ay, bx, by = ax - x0, ay - y0, bx - x0, by - y0
  local det = ax * by - ay * bx
  local u, v = ((x - x0) * by - (y - y0) * bx) / det, (ax * (y - y0) - ay * (x - x0)) / det
  at = { u + v * e[1], v * e[2], v * e[3] }
  local rate = polygon.dot(normal, from.sight)
  if math.abs(rate) < 1e-12 then return nil, true end
  return (polygon.dot(normal, points[1]) - polygon.dot(normal, at)) / rate
end

local EYES = {}
for _, name in ipairs(view.names) do
  EYES[name] = { project = view.of[name].project, sight = view.of[name].sight,
    -- a direction that the page shows beside that of along
    eye_axis = name == "top" and { 0, 1, 0 } or { 0, 0, 1 } }
end

-- Asks at many points of the page what was painted there last, and whether that is the nearest.
local function check_order(t, from, items, faces, random)
  local all, painted = {}, {}
  for _, item in ipairs(items) do
    for _, part in ipairs(item.parts) do all[#all + 1] = part end
  end
  for _, face in ipairs(faces) do all[#all + 1] = face end
  local sorted = order.new(items, from.sight)
  for _, face in ipairs(faces) do sorted:add(face) end
  sorted:each(function(piece) painted[#painted + 1] = piece end)
  local asked = 0
  for _ = 1, 400 do
    local x, y = 2.4 * random:uniform() - 1.2, 2.4 * random:uniform() - 1.2
    local last, nearest, least, second, unsure = nil, nil, math.huge, math.huge, false
    for _, piece in ipairs(painted) do
      local depth, edge = depth_at(piece, x, y, from)
      unsure = unsure or edge
      if depth then last = piece.look end
    end
    for _, piece in ipairs(all) do
      local depth = depth_at(piece, x, y, from)
      if depth and depth < least then
        nearest, second, least = piece.look, least, depth
      elseif depth then
        second = math.min(second, depth)
      end
    end
    -- pieces that touch may be painted either way
    if not unsure and second - least > 0.02 then
      t:ok(last == nearest, ("at %.3f, %.3f the nearest is not on top"):format(x, y))
      asked = asked + (nearest and 1 or 0)
    end
  end
  return asked
end

suite:test("the last that is painted at a place is the nearest there", { limit = 120 }, function(t)
  local random = limax.engine.random(5, 1, "user")
  local function between(low, high) return low + (high - low) * random:uniform() end
  for _, name in ipairs(view.names) do
    local from, asked = EYES[name], 0
    for _ = 1, 12 do
      local given = { up = { 0, 0, 1 }, planes = {}, boxes = {}, spheres = {}, flows = {} }
      -- boxes and balls on a chessboard of 0.5 m, cubes on the other fields: nothing overlaps
      local cubes = {}
      for i = -2, 1 do
        for j = -2, 1 do
          local x, y = i / 2 + 0.02, j / 2 + 0.02
          local what = random:integer(4)
          if what == 1 then
            given.boxes[#given.boxes + 1] = { from = { x, y, 0 },
              to = { x + between(0.1, 0.45), y + between(0.1, 0.45), between(0.05, 0.8) } }
          elseif what == 2 then
            given.spheres[#given.spheres + 1] = { center = { x + 0.23, y + 0.23,
              between(0.23, 0.5) }, radius = between(0.05, 0.22) }
          else
            cubes[#cubes + 1] = { x + between(0, 0.2), y + between(0, 0.2), between(0, 0.6) }
          end
        end
      end
      local block = block_picture.spaces(block_picture.corners({ 0, 0, 1.3, 0.9, 0.3, 0.3,
        0.1 }, { 0.3, 0.4, 0.2 }))
      local turned = stage.new(given, AXES)
      local pieces = stage.pieces(turned, { low = { -2, -2, -2 }, high = { 2, 2, 2 } }, from.sight,
        block, "#b98b4f")
      local faces = {}
      for _, low in ipairs(cubes) do
        for _, face in ipairs(cube_faces(low, 0.25, from.sight)) do faces[#faces + 1] = face end
      end
      asked = asked + check_order(t, from, pieces, faces, random)
    end
    t:ok(asked > 500, ("%s: %d places were asked"):format(name, asked))
  end
end)

suite:test("faces of a body at rest are painted in order", { limit = 30 }, function(t)
  local random, n = limax.engine.random(6, 1, "user"), 4
  for _, name in ipairs(view.names) do
    local from, voxel, mass_at, points = EYES[name], {}, {}, {}
    for x = 1, n do
      voxel[x] = {}
      for y = 1, n do
        voxel[x][y] = {}
        for z = 1, n do voxel[x][y][z] = random:uniform() < 0.6 and "e" or "." end
      end
    end
    for z = 0, n do
      for y = 0, n do
        for x = 0, n do
          points[#points + 1] = { x / 4 - 0.5, y / 4 - 0.5, z / 4 - 0.5 }
          mass_at[x + (n + 1) * (y + (n + 1) * z)] = #points
        end
      end
    end
    local faces = skin.visible(skin.faces(voxel, mass_at), points, { e = { hex = "#e8743a" } },
      from.sight)
    t:ok(check_order(t, from, {}, faces, random) > 40)
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
  t:equal(select(2, polygon.split(square, { 1, 0, 0 }, 3)), square)
  t:equal({ polygon.crossing(square, { 1, 0, 0 }, 0.5) }, { { 0.5, 0, 0 }, { 0.5, 2, 0 } })
  t:equal(polygon.crossing(square, { 0, 0, 1 }, 1), nil)
end)

suite:test("the sides of a solid have lines along their edges", function(t)
  local box = { up = { 0, 0, 1 }, planes = {}, spheres = {}, flows = {},
    boxes = { { from = { 0, 0, 0 }, to = { 0.5, 0.4, 0.3 } } } }
  local pieces = stage.pieces(stage.new(box, AXES), SLAB, view.of.side.sight)
  t:equal(#pieces, 3)
  for _, item in ipairs(pieces) do t:equal(item.parts[1].edges, { true, true, true, true }) end
end)

return suite
