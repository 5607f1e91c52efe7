--- stage.lua: the part of a world around a pose, as pieces to paint: boxes, the block, spheres,
--- planes and terrain, cut to a slab of space. Metres, along, away, up.

local palette = require "limax.draw.palette"
local polygon = require "limax.draw.picture.polygon"
local skin = require "limax.draw.skin"
local terrain = require "limax.draw.picture.terrain"
local world = require "limax.draw.picture.world"

local stage = {}

local dot = polygon.dot

-- Facets of a sphere from pole to pole and around it; of a coarser one that cuts what reaches in.
local RINGS, SECTORS = 10, 20
local COARSE_RINGS, COARSE_SECTORS = 6, 12

local UP = { 0, 0, 1 }

---@class limax.picture.slab the part of space that is shown
---@field low number[] m
---@field high number[]

---@class limax.picture.space the points behind a plane
---@field normal number[] of length 1
---@field offset number m

---@class limax.picture.stage a world turned to along, away, up
---@field ground limax.picture.space|nil
---@field planes limax.picture.space[]
---@field boxes limax.picture.space[][]
---@field spheres { center: number[], radius: number }[]
---@field terrain table|nil
---@field flows limax.world.flow[]
---@field turn fun(point: number[]): number[]
---@field back fun(point: number[]): number[]

--- A world as it is seen along the way.
---@param given limax.world
---@param axes number[][] along, away and up in the world
---@return limax.picture.stage
function stage.new(given, axes)
  local function turn(p) return { dot(p, axes[1]), dot(p, axes[2]), dot(p, axes[3]) } end
  local function back(p)
    local q = { 0, 0, 0 }
    for k = 1, 3 do
      for c = 1, 3 do q[c] = q[c] + p[k] * axes[k][c] end
    end
    return q
  end
  local self = { planes = {}, boxes = {}, spheres = {}, terrain = given.terrain, flows = {},
    turn = turn, back = back }
  if given.ground then self.ground = { normal = turn { 0, 0, 1 }, offset = given.ground } end
  for k, plane in ipairs(given.planes) do
    self.planes[k] = { normal = turn(plane.normal), offset = plane.offset }
  end
  for k, box in ipairs(given.boxes) do
    self.boxes[k] = {}
    for axis = 1, 3 do
      local normal = { 0, 0, 0 }
      normal[axis] = 1
      local out, inwards = turn(normal), turn { -normal[1], -normal[2], -normal[3] }
      table.insert(self.boxes[k], { normal = out, offset = box.to[axis] })
      table.insert(self.boxes[k], { normal = inwards, offset = -box.from[axis] })
    end
  end
  for k, sphere in ipairs(given.spheres) do
    self.spheres[k] = { center = turn(sphere.center), radius = sphere.radius }
  end
  for k, flow in ipairs(given.flows) do
    self.flows[k] = { kind = flow.kind, velocity = turn(flow.velocity), speed = flow.speed }
  end
  return self
end

--- Height of the ground below a place; nil without ground.
---@param self limax.picture.stage
---@param along number
---@param away number
---@return number|nil m
function stage.ground_height(self, along, away)
  local ground = self.ground
  if not ground then return nil end
  local n = ground.normal
  return (ground.offset - n[1] * along - n[2] * away) / n[3]
end

-- The half-spaces of a slab.
local function spaces_of(slab)
  local spaces = {}
  for axis = 1, 3 do
    local normal = { 0, 0, 0 }
    normal[axis] = 1
    spaces[#spaces + 1] = { normal = normal, offset = slab.high[axis] }
    spaces[#spaces + 1] = { normal = { -normal[1], -normal[2], -normal[3] },
      offset = -slab.low[axis] }
  end
  return spaces
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

local function reversed(space)
  local n = space.normal
  return { normal = { -n[1], -n[2], -n[3] }, offset = -space.offset }
end

local function joined(...)
  local all = {}
  for _, list in ipairs { ... } do
    for _, item in ipairs(list) do all[#all + 1] = item end
  end
  return all
end

-- How a flat thing is painted; what one may stand on shows the way, as the ground does.
local function look_of(plane, hex, ink)
  return { plane = plane, fill = palette.shade(hex, skin.brightness(plane.normal)), ink = ink }
end

-- Adds those sides of a solid that look at the eye.
local function add_solid(sides, spaces, context, hex, ink)
  for k, space in ipairs(spaces) do
    if dot(space.normal, context.sight) < -1e-9 then
      local side = polygon.side(spaces, k, context.center, context.reach)
      if side then
        side.look = look_of(space, hex, ink)
        sides[#sides + 1] = side
      end
    end
  end
end

-- A direction on the unit sphere, by shares of the way from pole to pole and around it.
local function direction(down, around)
  local tilt, turned = math.pi * down, 2 * math.pi * around
  return { math.sin(tilt) * math.cos(turned), math.sin(tilt) * math.sin(turned), math.cos(tilt) }
end

-- A sphere as half-spaces: many-sided, and as large as the sphere.
local function spaces_in(sphere)
  local spaces = {}
  for ring = 1, COARSE_RINGS do
    for sector = 1, COARSE_SECTORS do
      local normal = direction((ring - 0.5) / COARSE_RINGS, sector / COARSE_SECTORS)
      spaces[#spaces + 1] = { normal = normal,
        offset = dot(normal, sphere.center) + 0.98 * sphere.radius }
    end
  end
  return spaces
end

local function add_ball(balls, sphere, within, context)
  local facets, c, r = {}, sphere.center, sphere.radius
  local function corner(ring, sector)
    local out = direction(ring / RINGS, sector / SECTORS)
    return { c[1] + r * out[1], c[2] + r * out[2], c[3] + r * out[3] }
  end
  for ring = 0, RINGS - 1 do
    for sector = 0, SECTORS - 1 do
      local normal = direction((ring + 0.5) / RINGS, (sector + 0.5) / SECTORS)
      if dot(normal, context.sight) < 0 then
        facets[#facets + 1] = polygon.within({ points = { corner(ring, sector),
          corner(ring + 1, sector), corner(ring + 1, sector + 1), corner(ring, sector + 1) },
          edges = { false, false, false, false },
          look = look_of({ normal = normal }, world.hex, world.ink) }, within)
      end
    end
  end
  if #facets > 0 then
    balls[#balls + 1] = { facets = facets,
      ball = { center = c, radius = r, spaces = spaces_in(sphere) } }
  end
end

-- Where a body may be: above the ground and in front of the planes.
local function open_of(self)
  local open = {}
  for k, plane in ipairs(self.planes) do open[k] = reversed(plane) end
  if self.ground then open[#open + 1] = reversed(self.ground) end
  return open
end

--- The planes of a world as far as they are in a slab, above the ground and in front of each other.
---@param self limax.picture.stage
---@param slab limax.picture.slab
---@return limax.picture.polygon[]
function stage.sheets(self, slab)
  local within, open, sheets = spaces_of(slab), open_of(self), {}
  local center, reach = middle_of(slab)
  for k, plane in ipairs(self.planes) do
    local spaces = joined({ plane }, within)
    for other, space in ipairs(open) do
      if other ~= k then spaces[#spaces + 1] = space end
    end
    local sheet = polygon.side(spaces, 1, center, reach)
    if sheet then
      local floor = world.is_floor(plane.normal, UP)
      sheet.look = look_of(plane, floor and world.soil or world.hex, world.ink)
      sheet.look.ruled = floor
      sheets[#sheets + 1] = sheet
    end
  end
  return sheets
end

---@class limax.picture.pieces
---@field sides limax.picture.polygon[]
---@field balls table[] see order.lua
---@field patches limax.picture.polygon[]
---@field thickness number|nil m
---@field before limax.picture.polygon[] planes seen from behind: they are in front of all

--- What of the world is seen in a slab, and the block where it is at that moment.
---@param self limax.picture.stage
---@param slab limax.picture.slab
---@param sight number[] away from the eye
---@param block limax.picture.space[]|nil
---@param block_hex string
---@return limax.picture.pieces
function stage.pieces(self, slab, sight, block, block_hex)
  local center, reach = middle_of(slab)
  local context = { sight = sight, center = center, reach = reach }
  local within, open = spaces_of(slab), open_of(self)
  local pieces = { sides = {}, balls = {}, patches = {}, before = {} }
  if self.terrain then
    pieces.patches, pieces.thickness = terrain.patches(self, slab, within, sight)
  end
  for _, sheet in ipairs(stage.sheets(self, slab)) do
    table.insert(dot(sheet.look.plane.normal, sight) < 0 and pieces.sides or pieces.before, sheet)
  end
  for _, box in ipairs(self.boxes) do
    add_solid(pieces.sides, joined(box, within, open), context, world.hex, world.ink)
  end
  for _, sphere in ipairs(self.spheres) do
    add_ball(pieces.balls, sphere, joined(within, open), context)
  end
  if block then add_solid(pieces.sides, block, context, block_hex, skin.ink) end
  return pieces
end

-- ---- seen from beside ---------------------------------------------------------------------------

-- Corners of a circle, and samples along a line of heights.
local ROUND, SAMPLES = 48, 200

-- The line of a plane along the middle of a slab, as far as it is in it; nil where it leaves it.
local function plane_line(plane, slab, away)
  local spaces = { plane, { normal = { 0, 1, 0 }, offset = away + 1e-3 },
    { normal = { 0, -1, 0 }, offset = 1e-3 - away } }
  for axis = 1, 3, 2 do
    local normal = { 0, 0, 0 }
    normal[axis] = 1
    table.insert(spaces, { normal = normal, offset = slab.high[axis] })
    table.insert(spaces, reversed { normal = normal, offset = slab.low[axis] })
  end
  local center = { (slab.low[1] + slab.high[1]) / 2, away, (slab.low[3] + slab.high[3]) / 2 }
  local reach = slab.high[1] - slab.low[1] + slab.high[3] - slab.low[3]
  local sheet = polygon.side(spaces, 1, center, reach)
  if not sheet then return nil end
  local from, to = sheet.points[1], sheet.points[1]
  local function first(p, q) return p[1] < q[1] or p[1] == q[1] and p[3] < q[3] end
  for _, p in ipairs(sheet.points) do
    if first(p, from) then from = p end
    if first(to, p) then to = p end
  end
  return { from, to, open = true }
end

--- What of a world is in a slab, seen along it: points of outlines, the ground and terrain as open
--- lines below the middle of the slab.
---@param self limax.picture.stage
---@param slab limax.picture.slab
---@return number[][][] each a list of points, `open` where it is a line
function stage.profile(self, slab)
  local list, away = {}, (slab.low[2] + slab.high[2]) / 2
  local within, center, reach = spaces_of(slab), middle_of(slab)
  for _, box in ipairs(self.boxes) do
    local spaces, points = joined(box, within), {}
    for k = 1, #spaces do
      local side = polygon.side(spaces, k, center, reach)
      for _, p in ipairs(side and side.points or {}) do points[#points + 1] = p end
    end
    if #points > 0 then list[#list + 1] = points end
  end
  for _, sphere in ipairs(self.spheres) do
    local c, r, points = sphere.center, sphere.radius, {}
    for k = 1, c[2] + r > slab.low[2] and c[2] - r < slab.high[2] and ROUND or 0 do
      local angle = 2 * math.pi * k / ROUND
      points[k] = { c[1] + r * math.cos(angle), c[2], c[3] + r * math.sin(angle) }
    end
    if #points > 0 then list[#list + 1] = points end
  end
  if self.terrain then
    local line = { open = true }
    for k = 0, SAMPLES do
      local along = slab.low[1] + (slab.high[1] - slab.low[1]) * k / SAMPLES
      local p = self.back { along, away, 0 }
      line[k + 1] = self.turn { p[1], p[2], world.height(self.terrain, p[1], p[2]) }
    end
    list[#list + 1] = line
  end
  for _, plane in ipairs(self.planes) do list[#list + 1] = plane_line(plane, slab, away) end
  if self.ground then list[#list + 1] = plane_line(self.ground, slab, away) end
  return list
end

return stage
