--- order.lua: the order in which pieces are painted, the farthest first, so that each may be
--- painted over those before it. What does not move divides space by its planes (a BSP tree); small
--- faces, of bodies and terrain, are cut where they cross one, and sorted by depth within a part of
--- space. Metres, along, away, up.

local polygon = require "limax.draw.picture.polygon"

local order = {}

-- m: masses sink into what they touch by less; what touches a side is in front of it
local SLACK = 5e-3
-- items that are tried as the next plane; the one that cuts fewest is taken
local TRIED = 8

---@class limax.picture.item what is painted at one place in the order
---@field plane limax.picture.space what is in front of it is painted later, what is behind earlier
---@field parts limax.picture.polygon[]

---@class limax.picture.order
---@field sight number[]
---@field root table
local Order = {}
Order.__index = Order

-- An item's parts in front of a plane and behind it, as items.
local function split(item, plane, slack)
  local front, behind = {}, {}
  for _, part in ipairs(item.parts) do
    front[#front + 1], behind[#behind + 1] =
      polygon.split(part, plane.normal, plane.offset, slack)
  end
  return #front > 0 and { plane = item.plane, parts = front } or nil,
    #behind > 0 and { plane = item.plane, parts = behind } or nil
end

-- The item whose plane cuts fewest of the others.
local function best_of(items)
  local best, fewest = 1, math.huge
  for k = 1, math.min(TRIED, #items) do
    local count = 0
    for _, item in ipairs(items) do
      local front, behind = split(item, items[k].plane, SLACK)
      if front and behind then count = count + 1 end
    end
    if count < fewest then best, fewest = k, count end
    if count == 0 then break end
  end
  return best
end

local function build(items)
  if #items == 0 then return { faces = {} } end
  local best = best_of(items)
  local root, front, behind = items[best], {}, {}
  for k, item in ipairs(items) do
    if k ~= best then
      front[#front + 1], behind[#behind + 1] = split(item, root.plane, 1e-6)
    end
  end
  return { plane = root.plane, painted = root.parts, front = build(front), behind = build(behind) }
end

--- An order of what does not move.
---@param items limax.picture.item[]
---@param sight number[] away from the viewer
---@return limax.picture.order
function order.new(items, sight)
  return setmetatable({ sight = sight, root = build(items) }, Order)
end

local function push(node, face)
  if node.faces then
    table.insert(node.faces, face)
    return
  end
  local front, behind = polygon.split(face, node.plane.normal, node.plane.offset, SLACK)
  if front then push(node.front, front) end
  if behind then push(node.behind, behind) end
end

--- Adds a face that is turned to the viewer.
function Order:add(face) push(self.root, face) end

-- Sorts polygons by the mean depth of their corners, the farthest first.
local function sort_by_depth(list, sight)
  for k, each in ipairs(list) do
    local sum = 0
    for _, p in ipairs(each.points) do sum = sum + polygon.dot(p, sight) end
    each.depth, each.place = sum / #each.points, k
  end
  table.sort(list, function(one, other)
    if one.depth ~= other.depth then return one.depth > other.depth end
    return one.place < other.place
  end)
end

--- Calls `paint` for each piece, the farthest first.
---@param paint fun(piece: limax.picture.polygon)
function Order:each(paint)
  local function visit(node)
    if node.faces then
      sort_by_depth(node.faces, self.sight)
      for _, face in ipairs(node.faces) do paint(face) end
      return
    end
    visit(node.behind)
    for _, part in ipairs(node.painted) do paint(part) end
    visit(node.front)
  end
  visit(self.root)
end

return order
