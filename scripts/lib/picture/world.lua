--- world.lua: what stands around a robot, as its scene says: one description for pictures and for
--- the page's viewer. World coordinates, m.

local polygon = require "limax.picture.polygon"

local world = {}

---@class limax.world
---@field up number[] of length 1: against gravity where there is something to stand on, else z
---@field ground number|nil m, the height of the ground
---@field planes { normal: number[], offset: number }[] normals of length 1, out of what is solid
---@field boxes { from: number[], to: number[] }[]
---@field spheres { center: number[], radius: number }[]
---@field terrain { spacing: number, origin: number[], heights: number[][] }|nil
---@field fluid boolean is there drag?
---@field anchored boolean is a part of the body held?

--- What fixed things are drawn with, and the word for them in a legend. Cool, unlike bodies.
world.hex, world.ink, world.word = "#b3bac3", "#727a83", "obstacle"
--- What floors and terrain are drawn with.
world.soil, world.furrow = "#efece6", "#c9c2b4"

-- Gravity is level where it leaves z by less than this, rad: far less than anybody sees.
local LEVEL = 1e-6

-- Against gravity, where that is upwards at all.
local function up_of(scene)
  local stands = scene.ground or scene.planes or scene.terrain or scene.boxes
  local g = scene.gravity and scene.gravity.acceleration
  if not stands or not g or g[3] >= 0 then return { 0, 0, 1 } end
  local up = polygon.unit { -g[1], -g[2], -g[3] }
  return math.acos(math.min(up[3], 1)) < LEVEL and { 0, 0, 1 } or up
end

local function copies(list, fields)
  local result = {}
  for k, each in ipairs(list or {}) do
    result[k] = {}
    for _, name in ipairs(fields) do result[k][name] = each[name] end
  end
  return result
end

--- The description of a resolved scene.
---@param scene table
---@return limax.world
function world.of(scene)
  local planes = {}
  for k, plane in ipairs(scene.planes or {}) do
    planes[k] = { normal = polygon.unit(plane.normal), offset = plane.offset }
  end
  return { up = up_of(scene), ground = scene.ground and scene.ground.height, planes = planes,
    boxes = copies(scene.boxes, { "from", "to" }),
    spheres = copies(scene.spheres, { "center", "radius" }),
    terrain = scene.terrain and copies({ scene.terrain }, { "spacing", "origin", "heights" })[1],
    fluid = scene.drag ~= nil, anchored = scene.anchors ~= nil }
end

--- Is there more than flat ground?
---@param given limax.world
---@return boolean
function world.has_obstacles(given)
  return #given.planes + #given.boxes + #given.spheres > 0 or given.terrain ~= nil
end

--- Is there something that is drawn as an obstacle: a box, a sphere, a wall?
---@param given limax.world
---@return boolean
function world.has_solids(given)
  for _, plane in ipairs(given.planes) do
    if not world.is_floor(plane.normal, given.up) then return true end
  end
  return #given.boxes + #given.spheres > 0
end

-- A plane whose normal points up by more than this is a floor, else a wall.
local FLOOR = 0.5

--- Is a plane one to stand on?
---@param normal number[] of length 1
---@param up number[]
---@return boolean
function world.is_floor(normal, up) return polygon.dot(normal, up) > FLOOR end

--- Angle between the ground and the horizontal, rad.
---@param given limax.world
---@return number
function world.slope(given) return math.acos(math.min(given.up[3], 1)) end

local function counted(count, one, many)
  return count > 0 and ("%d %s"):format(count, count == 1 and one or many or one .. "s") or nil
end

--- What there is, in words: "ground, 12 boxes"; empty where there is nothing.
---@param given limax.world
---@return string
function world.words(given)
  local slope, parts = world.slope(given), {}
  if given.ground then
    parts[1] = slope > 0 and ("ground with a slope of %.3g degrees"):format(math.deg(slope))
      or "ground"
  end
  for _, text in ipairs { given.terrain and "terrain" or false,
    counted(#given.planes, "plane") or false, counted(#given.boxes, "box", "boxes") or false,
    counted(#given.spheres, "sphere") or false, given.fluid and "a fluid" or false,
    given.anchored and "anchors" or false } do
    if text then parts[#parts + 1] = text end
  end
  return table.concat(parts, ", ")
end

--- The height of the terrain at a place, as the engine has it: bilinear, and beyond the border the
--- border's height.
---@param terrain { spacing: number, origin: number[], heights: number[][] }
---@param x number m
---@param y number m
---@return number m
function world.height(terrain, x, y)
  local heights = terrain.heights
  local function cell(along, count)
    local held = math.min(math.max(along, 0), count - 1)
    local below = math.min(math.floor(held), count - 2)
    return below + 1, held - below
  end
  local i, share_x = cell((x - terrain.origin[1]) / terrain.spacing, #heights)
  local j, share_y = cell((y - terrain.origin[2]) / terrain.spacing, #heights[1])
  local near, far = heights[i], heights[i + 1]
  local low = near[j] + (near[j + 1] - near[j]) * share_y
  local high = far[j] + (far[j + 1] - far[j]) * share_y
  return terrain.origin[3] + low + (high - low) * share_x
end

return world
