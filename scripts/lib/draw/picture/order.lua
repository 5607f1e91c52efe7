--- order.lua: what a picture shows of the world and of bodies in it, the farthest first, so that
--- each piece may be painted over those before it. The world's sides, which all look at the eye,
--- part space by their planes (a BSP tree); a body's faces are cut where they pass through one, and
--- sorted by depth within a part. Metres, along, away, up.

local polygon = require "limax.draw.picture.polygon"

local order = {}

-- m: contacts let masses in by less; what stands on a side is in front of it
local SLACK = 5e-3
-- sides that are tried as the next plane, of which the one that cuts fewest is taken
local TRIED = 8

local dot = polygon.dot

---@class limax.picture.ball what the facets of a sphere share
---@field center number[]
---@field radius number m
---@field spaces { normal: number[], offset: number }[] of all its facets

---@class limax.picture.order
---@field sight number[]
---@field root table
local Order = {}
Order.__index = Order

-- ---- the tree -----------------------------------------------------------------------------------

-- How many of the polygons a plane would cut.
local function cuts(plane, polygons)
  local count = 0
  for _, each in ipairs(polygons) do
    local front, behind = polygon.split(each, plane.normal, plane.offset, SLACK)
    if front and behind then count = count + 1 end
  end
  return count
end

local function best_of(polygons)
  local best, fewest = 1, math.huge
  for k = 1, math.min(TRIED, #polygons) do
    local count = cuts(polygons[k].look.plane, polygons)
    if count < fewest then best, fewest = k, count end
    if count == 0 then break end
  end
  return best
end

-- Facets of balls on both sides of a plane; a ball of which both sides have some is in both.
local function split_balls(balls, normal, offset)
  local front, behind = {}, {}
  for _, each in ipairs(balls) do
    local parts = { {}, {} }
    for _, facet in ipairs(each.facets) do
      for k, part in pairs { polygon.split(facet, normal, offset) } do
        table.insert(parts[k], part)
      end
    end
    if #parts[1] > 0 then front[#front + 1] = { ball = each.ball, facets = parts[1] } end
    if #parts[2] > 0 then behind[#behind + 1] = { ball = each.ball, facets = parts[2] } end
  end
  return front, behind
end

local build

local function build_by_side(polygons, balls, sight)
  local root = best_of(polygons)
  local plane = polygons[root].look.plane
  local node = { normal = plane.normal, offset = plane.offset, painted = { polygons[root] } }
  local front, behind = {}, {}
  for k, each in ipairs(polygons) do
    if k ~= root then
      local near, far = polygon.split(each, plane.normal, plane.offset, 1e-6)
      front[#front + 1], behind[#behind + 1] = near, far
    end
  end
  local near, far = split_balls(balls, plane.normal, plane.offset)
  node.front, node.behind = build(front, near, sight), build(behind, far, sight)
  return node
end

-- Nothing outside of a ball and nearer than its middle is hidden by it, nothing beyond hides it.
local function build_by_ball(balls, sight)
  local first = balls[1]
  local normal = { -sight[1], -sight[2], -sight[3] }
  local offset = dot(normal, first.ball.center)
  local near, far = split_balls({ unpack(balls, 2) }, normal, offset)
  return { normal = normal, offset = offset, painted = first.facets, ball = first.ball,
    front = build({}, near, sight), behind = build({}, far, sight) }
end

function build(polygons, balls, sight)
  if #polygons > 0 then return build_by_side(polygons, balls, sight) end
  if #balls > 0 then return build_by_ball(balls, sight) end
  return { faces = {} }
end

-- Parts of space one behind the other as seen along the ground; in each the terrain comes first,
-- since the eye looks from above.
local function build_terrain(patches, polygons, balls, sight, thickness)
  local length = math.sqrt(sight[1] ^ 2 + sight[2] ^ 2)
  local function by_depth(one, other)
    if one.look.depth ~= other.look.depth then return one.look.depth > other.look.depth end
    return one.look.place < other.look.place
  end
  table.sort(patches, by_depth)
  if length < 1e-6 then return { painted = patches, under = build(polygons, balls, sight) } end
  local toward = { -sight[1] / length, -sight[2] / length, 0 }
  local slices, least, most = {}, math.huge, -math.huge
  for _, patch in ipairs(patches) do
    local k = math.floor(dot(toward, patch.look.center) / thickness)
    slices[k] = slices[k] or {}
    table.insert(slices[k], patch)
    least, most = math.min(least, k), math.max(most, k)
  end
  -- from the nearest to the farthest: the front of the k-th plane is the k-th part and what is
  -- nearer
  local function part(k, sides, rounds)
    if k == most then
      return { painted = slices[k] or {}, under = build(sides, rounds, sight) }
    end
    local offset, front, behind = (k + 1) * thickness, {}, {}
    for _, each in ipairs(sides) do
      local near, far = polygon.split(each, toward, offset)
      front[#front + 1], behind[#behind + 1] = near, far
    end
    local near, far = split_balls(rounds, toward, offset)
    return { normal = toward, offset = offset, painted = {}, front = part(k + 1, front, near),
      behind = { painted = slices[k] or {}, under = build(behind, far, sight) } }
  end
  return part(least, polygons, balls)
end

--- An order of what does not move.
---@param world { sides: limax.picture.polygon[], balls: table[], patches: limax.picture.polygon[],
--- thickness: number|nil } all of it looks at the eye; patches are the terrain's, `thickness` m
---@param sight number[] away from the eye
---@return limax.picture.order
function order.new(world, sight)
  local root
  if #world.patches > 0 then
    root = build_terrain(world.patches, world.sides, world.balls, sight, world.thickness)
  else
    root = build(world.sides, world.balls, sight)
  end
  return setmetatable({ sight = sight, root = root, count = 0 }, Order)
end

-- ---- bodies in it -------------------------------------------------------------------------------

-- The parts of a face outside of a ball; the face itself where it does not reach into it.
local function outside(face, ball)
  local reach = false
  for _, p in ipairs(face.points) do
    local x, y, z = p[1] - ball.center[1], p[2] - ball.center[2], p[3] - ball.center[3]
    reach = reach or x * x + y * y + z * z < (2 * ball.radius) ^ 2 + 1
  end
  if not reach then return { face } end
  local parts, rest = {}, face
  for _, space in ipairs(ball.spaces) do
    local out, within = polygon.split(rest, space.normal, space.offset)
    parts[#parts + 1] = out
    rest = within
    if not rest then return { face } end
  end
  return parts
end

local function push(node, face)
  if not node then return end
  if node.faces then
    table.insert(node.faces, face)
  elseif node.under then
    push(node.under, face)
  elseif node.ball then
    for _, part in ipairs(outside(face, node.ball)) do
      local front, behind = polygon.split(part, node.normal, node.offset)
      if front then push(node.front, front) end
      if behind then push(node.behind, behind) end
    end
  else
    local front, behind = polygon.split(face, node.normal, node.offset, SLACK)
    if front then push(node.front, front) end
    if behind then push(node.behind, behind) end
  end
end

--- Adds a face that looks at the eye.
---@param face limax.picture.polygon
function Order:add(face) push(self.root, face) end

local function depth_of(face, sight)
  local sum = 0
  for _, p in ipairs(face.points) do sum = sum + dot(p, sight) end
  return sum / #face.points
end

--- Calls `paint` for each piece, the farthest first.
---@param paint fun(piece: limax.picture.polygon)
function Order:each(paint)
  local function visit(node)
    if node.faces then
      for k, face in ipairs(node.faces) do
        face.depth, face.place = depth_of(face, self.sight), k
      end
      table.sort(node.faces, function(one, other)
        if one.depth ~= other.depth then return one.depth > other.depth end
        return one.place < other.place
      end)
      for _, face in ipairs(node.faces) do paint(face) end
      return
    end
    if node.behind then visit(node.behind) end
    for _, each in ipairs(node.painted) do paint(each) end
    if node.under then visit(node.under) end
    if node.front then visit(node.front) end
  end
  visit(self.root)
end

return order
