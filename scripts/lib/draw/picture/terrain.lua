--- terrain.lua: a height field as pieces to paint: patches of its surface, and the walls where a
--- slab of space cuts it. Metres, along, away, up.

local palette = require "limax.draw.palette"
local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"
local world = require "limax.draw.picture.world"

local terrain = {}

-- Patches along the longer side of a slab, about; each is as long as it is wide.
local PATCHES = 14
-- m of soil below the lowest place
local DEPTH = 0.02

-- The rectangle around the corners of a slab's floor in the world.
local function footprint(stage, slab)
  local low, high, add_corner = polygon.bounds(2)
  for _, along in ipairs { slab.low[1], slab.high[1] } do
    for _, away in ipairs { slab.low[2], slab.high[2] } do
      add_corner(stage.back { along, away, slab.low[3] })
    end
  end
  return low, high
end

-- Adds a piece with four corners, counter-clockwise seen from outside, if it faces the viewer.
local function add(patches, points, edges, within, sight)
  local normal = polygon.quad_normal(points)
  if polygon.dot(normal, normal) == 0 or sight and polygon.dot(normal, sight) >= 0 then return end
  patches[#patches + 1] = polygon.within({ points = points, edges = edges,
    look = { fill = palette.shade(world.soil, skin.brightness(polygon.unit(normal))),
      ink = world.furrow } }, within)
end

-- Adds the walls below the slab's four sides, from the surface down to `floor`.
local function add_walls(patches, stage, slab, step, floor, sight)
  local low, high = slab.low, slab.high
  -- counter-clockwise seen from above
  local corners = { { low[1], low[2] }, { high[1], low[2] }, { high[1], high[2] },
    { low[1], high[2] } }
  for side, from in ipairs(corners) do
    local to = corners[side % 4 + 1]
    local reach = math.abs(to[1] - from[1]) + math.abs(to[2] - from[2])
    local count, before = math.ceil(reach / step), nil
    for k = 0, count do
      local along = from[1] + (to[1] - from[1]) * k / count
      local away = from[2] + (to[2] - from[2]) * k / count
      local p = stage.back { along, away, floor }
      local top = stage.turn { p[1], p[2], world.height(stage.terrain, p[1], p[2]) }
      if before then
        add(patches, { { before[1], before[2], floor }, { top[1], top[2], floor }, top, before },
          { true, false, true, false }, {}, sight)
      end
      before = top
    end
  end
end

--- Pieces that face the viewer. Some heights are left out where they are finer than the picture,
--- and the surface between them is divided where they are coarse.
---@param within limax.picture.space[] the slab; its first four sides are upright
---@param sight? number[] away from the viewer; without it all sides are returned
function terrain.patches(stage, slab, within, sight)
  local field, low, high = stage.terrain, footprint(stage, slab)
  local wanted = math.max(slab.high[1] - slab.low[1], slab.high[2] - slab.low[2])
    / (slab.patches or PATCHES)
  local step = field.spacing * math.max(1, math.floor(wanted / field.spacing))
  if field.spacing > wanted then step = field.spacing / math.ceil(field.spacing / wanted) end
  local first, last = {}, {}
  for c = 1, 2 do
    first[c] = math.floor((low[c] - field.origin[c]) / step)
    last[c] = math.floor((high[c] - field.origin[c]) / step)
  end
  local function at(i, j)
    local x, y = field.origin[1] + i * step, field.origin[2] + j * step
    return stage.turn { x, y, world.height(field, x, y) }
  end
  -- the slab's heights do not limit the surface
  local upright, patches, lowest = { unpack(within, 1, 4) }, {}, math.huge
  for i = first[1], last[1] do
    for j = first[2], last[2] do
      local points = { at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1) }
      for _, p in ipairs(points) do lowest = math.min(lowest, p[3]) end
      add(patches, points, { true, true, true, true }, upright, sight)
    end
  end
  add_walls(patches, stage, slab, step, lowest - DEPTH, sight)
  return patches
end

return terrain
