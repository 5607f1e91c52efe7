--- order.lua: the order in which pieces are painted, the farthest first, so that each may be
--- painted over those before it. The planes of fixed things divide space (a BSP tree); small faces,
--- of bodies and terrain, are cut where they cross a plane, and sorted by depth within a part of
--- space. Metres, along, away, up.

local polygon = require "limax.draw.picture.polygon"

local order = {}

-- m: masses sink into what they touch by less; what touches a side is in front of it
local SLACK = 5e-3
-- m: items that leave a plane by less are not cut by it
local ROUNDING = 1e-6

---@class limax.picture.item what is painted at one place in the order
---@field plane limax.picture.space what is in front of it is painted later, what is behind earlier
---@field parts limax.picture.polygon[]

-- An item's parts in front of a plane and behind it, as items.
local function split(item, plane)
  local front, behind = {}, {}
  for _, part in ipairs(item.parts) do
    front[#front + 1], behind[#behind + 1] =
      polygon.split(part, plane.normal, plane.offset, ROUNDING)
  end
  return #front > 0 and { plane = item.plane, parts = front } or nil,
    #behind > 0 and { plane = item.plane, parts = behind } or nil
end

local function build(items)
  if #items == 0 then return { faces = {} } end
  local root, front, behind = items[1], {}, {}
  for k = 2, #items do
    front[#front + 1], behind[#behind + 1] = split(items[k], root.plane)
  end
  return { plane = root.plane, painted = root.parts, front = build(front), behind = build(behind) }
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

--- All pieces, the farthest first.
---@param items limax.picture.item[] of the world and of blocks
---@param faces limax.picture.polygon[] small ones that are turned to the viewer
---@param sight number[] away from the viewer
function order.sorted(items, faces, sight)
  local root, list = build(items), {}
  for _, face in ipairs(faces) do push(root, face) end
  local function add(pieces)
    for _, piece in ipairs(pieces) do list[#list + 1] = piece end
  end
  local function visit(node)
    if node.faces then
      sort_by_depth(node.faces, sight)
      add(node.faces)
      return
    end
    visit(node.behind)
    add(node.painted)
    visit(node.front)
  end
  visit(root)
  return list
end

return order
