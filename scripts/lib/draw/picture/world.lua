--- world.lua: what stands around a robot, as its scene says: one description for pictures and for
--- the page's viewer. World coordinates, m.

local choice = require "limax.base.choice"
local polygon = require "limax.draw.picture.polygon"

local world = {}

---@class limax.world
---@field up number[] of length 1: against gravity where there is something to stand on, else z
---@field ground number|nil m, the height of the ground
---@field planes { normal: number[], offset: number }[] normals of length 1, out of what is solid
---@field boxes { from: number[], to: number[] }[]
---@field spheres { center: number[], radius: number }[]
---@field terrain { spacing: number, origin: number[], heights: number[][] }|nil
---@field fluid boolean is there drag?
---@field air boolean is there wind, be it of no speed?
---@field flows limax.world.flow[] what moves: the wind, the fluid's current
---@field anchored boolean is a part of the body held?
---@field forces string[] names of the script's own effects

---@class limax.world.flow
---@field kind "wind"|"current"
---@field velocity number[] m/s
---@field speed number m/s, above 0

--- What fixed things are drawn with, and the word for them in a legend. Cool, unlike bodies.
world.hex, world.ink, world.word = "#b3bac3", "#727a83", "obstacle"
--- What floors and terrain are drawn with.
world.soil, world.furrow = "#efece6", "#c9c2b4"
--- What wind and current are drawn with: unlike bodies, and unlike the path of one.
world.flow_ink = { wind = "#0f7b74", current = "#7b3fa0" }

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

-- The wind and the fluid's current, as far as they have a speed.
local function flows_of(scene)
  local flows = {}
  local function add(kind, velocity)
    local speed = velocity and math.sqrt(polygon.dot(velocity, velocity)) or 0
    if speed > 0 then
      flows[#flows + 1] = { kind = kind, velocity = velocity, speed = speed }
    end
  end
  add("wind", scene.wind and scene.wind.velocity)
  add("current", scene.drag and scene.drag.current)
  return flows
end

-- Names of effects that a script brought: they are texts.
local function forces_of(scene)
  local names = {}
  for _, name in ipairs(choice.sorted_keys(scene)) do
    if type(scene[name]) == "table" and scene[name].force then names[#names + 1] = name end
  end
  return names
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
    fluid = scene.drag ~= nil, air = scene.wind ~= nil, flows = flows_of(scene),
    anchored = scene.anchors ~= nil, forces = forces_of(scene) }
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

--- The words beside a flow's arrow.
---@param given limax.world.flow
---@return string "wind 5 m/s"
function world.flow_label(given) return ("%s %.3g m/s"):format(given.kind, given.speed) end

-- A direction that differs by less than this from an axis is said to be along it.
local ALONG = 1e-6

-- Where something goes: "along -x", or its share of each axis.
local function direction_words(velocity, speed)
  for axis, name in ipairs { "x", "y", "z" } do
    local share = velocity[axis] / speed
    if math.abs(share) > 1 - ALONG then
      return ("along %s%s"):format(share < 0 and "-" or "", name)
    end
  end
  local shares = {}
  -- + 0: no "-0"
  for axis = 1, 3 do shares[axis] = ("%.2g"):format(velocity[axis] / speed + 0) end
  return ("along (%s)"):format(table.concat(shares, ", "))
end

-- Of a wind or a fluid: what flows, or what is there and rests.
local function flow_words(given, kind, moving, resting)
  for _, each in ipairs(given.flows) do
    if each.kind == kind then
      return ("%s of %.3g m/s %s"):format(moving, each.speed, direction_words(each.velocity,
        each.speed))
    end
  end
  return resting
end

--- What there is, in words: "ground, 12 boxes"; empty where there is nothing.
---@param given limax.world
---@return string
function world.words(given)
  local slope, parts = world.slope(given), {}
  local function add(text)
    if text then parts[#parts + 1] = text end
  end
  if given.ground then
    add(slope > 0 and ("ground with a slope of %.3g degrees"):format(math.deg(slope)) or "ground")
  end
  add(given.terrain and "terrain")
  add(counted(#given.planes, "plane"))
  add(counted(#given.boxes, "box", "boxes"))
  add(counted(#given.spheres, "sphere"))
  add(given.air and flow_words(given, "wind", "wind", "still air"))
  add(given.fluid and flow_words(given, "current", "a current", "a fluid"))
  add(given.anchored and "anchors")
  for _, name in ipairs(given.forces) do add("force " .. name) end
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
