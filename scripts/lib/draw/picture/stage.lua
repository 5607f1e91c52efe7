--- stage.lua: the part of a world around a pose, as pieces to paint: boxes, blocks, spheres,
--- planes and terrain, cut to a slab of space. Metres, along, away, up.

local palette = require "limax.draw.palette"
local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"
local terrain = require "limax.draw.picture.terrain"
local world = require "limax.draw.picture.world"

local stage = {}

local dot = polygon.dot

-- Facets of a sphere from pole to pole and around it.
local RINGS, SECTORS = 10, 20

local UP = { 0, 0, 1 }

---@class limax.picture.slab the part of space that is shown
---@field low number[] m
---@field high number[]
---@field patches integer|nil of terrain along its longer side

---@class limax.picture.space the points behind a plane
---@field normal number[] of length 1
---@field offset number m

---@class limax.picture.stage a world turned to along, away, up
---@field ground limax.picture.space|nil
---@field planes limax.picture.space[]
---@field boxes limax.picture.space[][]
---@field spheres { center: number[], radius: number, hex: string|nil }[]
---@field moving table[] moving boxes and spheres of the world, not turned
---@field patches table[] of friction, not turned
---@field targets { time: number, position: number[] }[] not turned
---@field terrain table|nil
---@field flows limax.world.flow[]
---@field turn fun(point: number[]): number[]
---@field back fun(point: number[]): number[]

local function reversed(space)
  local n = space.normal
  return { normal = { -n[1], -n[2], -n[3] }, offset = -space.offset }
end

-- The six half-spaces whose common part is a box; `turn` turns their normals.
local function spaces_of(low, high, turn)
  local spaces = {}
  for axis = 1, 3 do
    local normal = { 0, 0, 0 }
    normal[axis] = 1
    if turn then normal = turn(normal) end
    table.insert(spaces, { normal = normal, offset = high[axis] })
    table.insert(spaces, reversed { normal = normal, offset = low[axis] })
  end
  return spaces
end

local function joined(...)
  local all = {}
  for _, list in ipairs { ... } do
    for _, item in ipairs(list) do all[#all + 1] = item end
  end
  return all
end

-- Adds boxes and spheres of the world to a stage.
local function add_shape(self, shape)
  if shape.radius then
    table.insert(self.spheres, { center = self.turn(shape.center), radius = shape.radius,
      hex = shape.hex })
  else
    table.insert(self.boxes, spaces_of(shape.from, shape.to, self.turn))
  end
end

--- A world as it is seen along the path.
---@param axes? number[][] along, away and up in the world; its own if left out
function stage.new(around, axes)
  axes = axes or { { 1, 0, 0 }, { 0, 1, 0 }, UP }
  local function turn(p) return { dot(p, axes[1]), dot(p, axes[2]), dot(p, axes[3]) } end
  local function back(p)
    local q = { 0, 0, 0 }
    for k = 1, 3 do
      for c = 1, 3 do q[c] = q[c] + p[k] * axes[k][c] end
    end
    return q
  end
  local self = { planes = {}, boxes = {}, spheres = {}, terrain = around.terrain, flows = {},
    moving = joined(around.moving_boxes, around.moving_spheres), patches = around.patches,
    targets = around.targets,
    turn = turn, back = back }
  if around.ground then self.ground = { normal = turn(UP), offset = around.ground } end
  for k, plane in ipairs(around.planes) do
    self.planes[k] = { normal = turn(plane.normal), offset = plane.offset }
  end
  for _, shape in ipairs(joined(around.boxes, around.spheres)) do add_shape(self, shape) end
  for k, flow in ipairs(around.flows) do
    self.flows[k] = { kind = flow.kind, velocity = turn(flow.velocity), speed = flow.speed }
  end
  return self
end

--- Height of the ground below a place; nil without ground.
---@return number|nil m
function stage.ground_height(self, along, away)
  local ground = self.ground
  if not ground then return nil end
  local n = ground.normal
  return (ground.offset - n[1] * along - n[2] * away) / n[3]
end

-- How ground looks whose friction is multiplied by a factor.
local function ground_look(factor)
  return { ink = world.furrow, factor = factor, fill = factor < 1 and world.slippery
    or factor > 1 and world.rough or world.soil }
end

--- The ground in a slab.
function stage.ground_in(self, slab)
  local points = {}
  for k, at in ipairs { { slab.low[1], slab.low[2] }, { slab.high[1], slab.low[2] },
    { slab.high[1], slab.high[2] }, { slab.low[1], slab.high[2] } } do
    points[k] = { at[1], at[2], stage.ground_height(self, at[1], at[2]) }
  end
  return { points = points, edges = { false, false, false, false }, look = ground_look(1) }
end

--- The same, cut at the borders of patches of friction.
function stage.ground_parts(self, slab)
  local parts = { stage.ground_in(self, slab) }
  for _, patch in ipairs(self.patches) do
    local cut = {}
    for _, inside in ipairs(parts) do
      for _, space in ipairs(spaces_of(patch.from, patch.to, self.turn)) do
        local outside
        if inside then outside, inside = polygon.split(inside, space.normal, space.offset) end
        cut[#cut + 1] = outside
      end
      if inside then inside.look = ground_look(inside.look.factor * patch.factor) end
      cut[#cut + 1] = inside
    end
    parts = cut
  end
  return parts
end

-- The middle of a slab, and a length that no two points of it are farther apart than, m.
local function middle_of(slab)
  local center, reach = {}, 0
  for c = 1, 3 do
    center[c] = (slab.low[c] + slab.high[c]) / 2
    reach = reach + (slab.high[c] - slab.low[c])
  end
  return center, reach
end

local function look_of(normal, hex, ink)
  return { fill = palette.shade(hex, skin.brightness(normal)), ink = ink }
end

-- Adds those sides of a solid that face the viewer.
local function add_solid(items, spaces, context, hex, ink)
  for k, space in ipairs(spaces) do
    if not context.sight or dot(space.normal, context.sight) < -1e-9 then
      local side = polygon.side(spaces, k, context.center, context.reach)
      if side then
        side.look = look_of(space.normal, hex, ink)
        items[#items + 1] = { plane = space, parts = { side } }
      end
    end
  end
end

-- A direction on the unit sphere, by shares of the way from pole to pole and around it.
local function direction(down, around)
  local tilt, turned = math.pi * down, 2 * math.pi * around
  return { math.sin(tilt) * math.cos(turned), math.sin(tilt) * math.sin(turned), math.cos(tilt) }
end

-- Adds the facets of a sphere that face the viewer. Their plane goes through its centre: whatever
-- is outside of the sphere and in front of that plane is not hidden by it.
local function add_sphere(items, sphere, within, context)
  local facets, c, r = {}, sphere.center, sphere.radius
  local function corner(ring, sector)
    local out = direction(ring / RINGS, sector / SECTORS)
    return { c[1] + r * out[1], c[2] + r * out[2], c[3] + r * out[3] }
  end
  for ring = 0, RINGS - 1 do
    for sector = 0, SECTORS - 1 do
      local normal = direction((ring + 0.5) / RINGS, (sector + 0.5) / SECTORS)
      if not context.sight or dot(normal, context.sight) < 0 then
        facets[#facets + 1] = polygon.within({ points = { corner(ring, sector),
          corner(ring + 1, sector), corner(ring + 1, sector + 1), corner(ring, sector + 1) },
          edges = { false, false, false, false },
          look = look_of(normal, sphere.hex or world.hex, world.ink) }, within)
      end
    end
  end
  local sight = context.sight or UP
  local normal = polygon.unit { -sight[1], -sight[2], -sight[3] }
  if #facets > 0 then
    items[#items + 1] = { plane = { normal = normal, offset = dot(normal, c) }, parts = facets }
  end
end

--- All sides of one box or sphere of the world, wherever it is.
---@return limax.picture.polygon[]
function stage.sides(self, shape)
  local items, sides = {}, {}
  if shape.radius then
    local sphere = { center = self.turn(shape.center), radius = shape.radius, hex = shape.hex }
    add_sphere(items, sphere, {}, {})
  else
    local center, reach = middle_of { low = shape.from, high = shape.to }
    add_solid(items, spaces_of(shape.from, shape.to, self.turn),
      { center = self.turn(center), reach = reach }, world.hex, world.ink)
  end
  for _, item in ipairs(items) do sides = joined(sides, item.parts) end
  return sides
end

-- Where a body may be: above the ground and in front of the planes.
local function open_of(self)
  local open = {}
  for k, plane in ipairs(self.planes) do open[k] = reversed(plane) end
  if self.ground then open[#open + 1] = reversed(self.ground) end
  return open
end

-- The planes of a world as far as they are in a slab, above the ground and in front of each other:
-- items with one part each, with `look.ruled` if it is a floor.
local function sheets_of(self, within, open, context)
  local sheets = {}
  for k, plane in ipairs(self.planes) do
    local spaces = joined({ plane }, within)
    for other, space in ipairs(open) do
      if other ~= k then spaces[#spaces + 1] = space end
    end
    local sheet = polygon.side(spaces, 1, context.center, context.reach)
    if sheet then
      local floor = world.is_floor(plane.normal, UP)
      sheet.look = look_of(plane.normal, floor and world.soil or world.hex, world.ink)
      sheet.look.ruled, sheet.look.wall = floor, not floor
      sheets[#sheets + 1] = { plane = plane, parts = { sheet } }
    end
  end
  return sheets
end

--- The pieces of the world that are visible in a slab, and blocks where they are at that moment.
---@param time? number s, of what moves and of targets that come one after the other; without it
--- these are left out
---@param sight? number[] away from the viewer, who does not see the backs of things; without it all
--- sides are returned
---@param blocks? limax.picture.space[][] half-spaces of each
---@return limax.picture.item[] items for order.new
---@return limax.picture.polygon[] veils planes seen from behind: they are in front of all
---@return limax.picture.polygon[] patches of terrain
function stage.pieces(self, slab, time, sight, blocks, block_hex)
  local center, reach = middle_of(slab)
  local context = { sight = sight, center = center, reach = reach }
  local within, open = spaces_of(slab.low, slab.high), open_of(self)
  local items, veils = {}, {}
  for _, sheet in ipairs(sheets_of(self, within, open, context)) do
    if not sight or dot(sheet.plane.normal, sight) < 0 then
      items[#items + 1] = sheet
    else
      veils[#veils + 1] = sheet.parts[1]
    end
  end
  local now = { turn = self.turn, boxes = joined(self.boxes), spheres = joined(self.spheres) }
  for _, shape in ipairs(time and self.moving or {}) do add_shape(now, world.moved(shape, time)) end
  local target = (time or #self.targets == 1) and world.target_at(self.targets, time or math.huge)
  if target then add_shape(now, world.ball_at(target)) end
  for _, box in ipairs(now.boxes) do
    add_solid(items, joined(box, within, open), context, world.hex, world.ink)
  end
  for _, sphere in ipairs(now.spheres) do
    -- a small ball that reaches into the slab is shown whole
    local inside = sphere.radius < reach / 4
    for c = 1, 3 do
      inside = inside and math.abs(sphere.center[c] - center[c])
        < (slab.high[c] - slab.low[c]) / 2 + sphere.radius
    end
    add_sphere(items, sphere, inside and open or joined(within, open), context)
  end
  for _, block in ipairs(blocks or {}) do
    add_solid(items, block, context, block_hex, skin.ink)
  end
  return items, veils, self.terrain and terrain.patches(self, slab, within, sight) or {}
end

return stage
