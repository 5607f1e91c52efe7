--- world.lua: describes the surroundings of a robot, from its scene, for pictures and the viewer of
--- a report. World coordinates, m.

local choice = require "limax.base.choice"
local polygon = require "limax.draw.picture.polygon"

local world = {}

---@class limax.world
---@field up number[] of length 1: against gravity if the scene has a ground or obstacles, else z
---@field ground number|nil m, the height of the ground
---@field planes limax.picture.space[] normals point out of what is solid
---@field boxes { from: number[], to: number[] }[]
---@field spheres { center: number[], radius: number }[]
---@field moving_boxes table[] boxes with `velocity`, m/s, and `turns`, s, where they are at first
---@field moving_spheres table[] spheres, likewise
---@field patches { from: number[], to: number[], factor: number }[] of friction
---@field terrain { spacing: number, origin: number[], heights: number[][] }|nil
---@field fluid boolean is there drag?
---@field air boolean is there wind, even of speed 0?
---@field flows limax.world.flow[] what moves: the wind, the fluid's current
---@field targets { time: number, position: number[] }[] places that controllers see
---@field anchored boolean is a part of the body held?
---@field forces string[] names of the script's own effects

---@class limax.world.flow
---@field kind "wind"|"current"
---@field velocity number[] m/s
---@field speed number m/s, above 0

--- Colours of obstacles and of their edges, and their name in a legend. Cool, unlike bodies.
world.hex, world.ink, world.word = "#b3bac3", "#727a83", "obstacle"
--- Colour of the target, and the radius of the ball that marks it, m.
world.target_hex, world.target_radius = "#2f9e44", 0.04
--- Colours of floors and terrain, and of the lines on them.
world.soil, world.furrow = "#efece6", "#c9c2b4"
--- Colours of ground with less friction, and with more.
world.slippery, world.rough = "#d3e6f3", "#d5c8af"
--- Colours of the lines across floors: every 0.1 m, and every 0.5 m.
world.rules = { fine = "#dcd7cc", strong = "#b9b2a4" }
--- Colours of wind and current: unlike bodies, and unlike the path of one.
world.flow_ink = { wind = "#0f7b74", current = "#7b3fa0" }

-- rad: a smaller slope is not seen
local LEVEL = 1e-6
-- A plane whose normal points up by more than this is a floor, else a wall.
local FLOOR = 0.5

-- The direction against gravity if it points upwards, else z.
local function up_of(scene)
  local solid = scene.ground or scene.planes or scene.terrain or scene.boxes or scene.moving_boxes
  local g = scene.gravity and scene.gravity.acceleration
  if not solid or not g or g[3] >= 0 then return { 0, 0, 1 } end
  local up = polygon.unit { -g[1], -g[2], -g[3] }
  return math.acos(math.min(up[3], 1)) < LEVEL and { 0, 0, 1 } or up
end

--- The description of a resolved scene.
function world.of(scene)
  local planes, flows, forces = {}, {}, {}
  for k, plane in ipairs(scene.planes or {}) do
    planes[k] = { normal = polygon.unit(plane.normal), offset = plane.offset }
  end
  local function add_flow(kind, velocity)
    local speed = velocity and math.sqrt(polygon.dot(velocity, velocity)) or 0
    if speed > 0 then
      flows[#flows + 1] = { kind = kind, velocity = velocity, speed = speed }
    end
  end
  add_flow("wind", scene.wind and scene.wind.velocity)
  add_flow("current", scene.drag and scene.drag.current)
  for _, name in ipairs(choice.sorted_keys(scene)) do
    -- an effect of a script has its force as text
    if type(scene[name]) == "table" and scene[name].force then forces[#forces + 1] = name end
  end
  return { up = up_of(scene), ground = scene.ground and scene.ground.height, planes = planes,
    boxes = scene.boxes or {}, spheres = scene.spheres or {}, terrain = scene.terrain,
    moving_boxes = scene.moving_boxes or {}, moving_spheres = scene.moving_spheres or {},
    patches = scene.patches or {},
    fluid = scene.drag ~= nil, air = scene.wind ~= nil, flows = flows,
    targets = scene.target or {},
    anchored = scene.anchors ~= nil, forces = forces }
end

--- A moving box or sphere where it is at a time; see engine/physics/effects/moving.h.
---@param time number s since the muscles began
---@return table a fixed box or sphere
function world.moved(shape, time)
  local turns, forwards, now = shape.turns, math.max(time, 0), { radius = shape.radius }
  if turns > 0 then forwards = turns - math.abs(forwards % (2 * turns) - turns) end
  for _, name in ipairs { "from", "to", "center" } do
    local p, v = shape[name], shape.velocity
    now[name] = p and { p[1] + forwards * v[1], p[2] + forwards * v[2], p[3] + forwards * v[3] }
  end
  return now
end

local function has_shapes(around)
  return #around.boxes + #around.spheres + #around.moving_boxes + #around.moving_spheres > 0
end

--- The place of the target that is seen at a time.
---@param targets { time: number, position: number[] }[] in the order of their times
---@param time number s since the muscles began
---@return number[]|nil
function world.target_at(targets, time)
  local shown
  for _, target in ipairs(targets) do
    if target.time <= math.max(time, 0) then shown = target.position end
  end
  return shown
end

--- The ball that marks a target.
function world.ball_at(place)
  return { center = place, radius = world.target_radius, hex = world.target_hex }
end

--- Is there more than flat ground?
function world.has_obstacles(around)
  return has_shapes(around) or #around.planes > 0 or around.terrain ~= nil
end

--- Is there something that is drawn as an obstacle: a box, a sphere, a wall?
function world.has_solids(around)
  for _, plane in ipairs(around.planes) do
    if not world.is_floor(plane.normal, around.up) then return true end
  end
  return has_shapes(around)
end

--- Is a plane a floor?
---@param normal number[] of length 1
function world.is_floor(normal, up) return polygon.dot(normal, up) > FLOOR end

--- The text beside a flow's arrow.
---@return string "wind 5 m/s"
function world.flow_label(flow) return ("%s %.3g m/s"):format(flow.kind, flow.speed) end

-- "along -x", or the components of the direction.
local function direction_words(flow)
  local shares = {}
  for axis, name in ipairs { "x", "y", "z" } do
    local share = flow.velocity[axis] / flow.speed
    if math.abs(share) > 1 - 1e-6 then
      return ("along %s%s"):format(share < 0 and "-" or "", name)
    end
    -- + 0: no "-0"
    shares[axis] = ("%.2g"):format(share + 0)
  end
  return ("along (%s)"):format(table.concat(shares, ", "))
end

--- Names the parts of a world: "ground, 12 boxes"; empty if it has none.
function world.words(around)
  local slope, parts, flowing = math.acos(math.min(around.up[3], 1)), {}, {}
  local function add(text)
    if text then parts[#parts + 1] = text end
  end
  local function counted(list, one, many)
    local count = #list
    return count > 0 and ("%d %s"):format(count, count == 1 and one or many) or nil
  end
  for _, flow in ipairs(around.flows) do
    flowing[flow.kind] = ("%s of %.3g m/s %s"):format(flow.kind == "wind" and "wind"
      or "a current", flow.speed, direction_words(flow))
  end
  if around.ground then
    add(slope > 0 and ("ground with a slope of %.3g degrees"):format(math.deg(slope)) or "ground")
  end
  add(around.terrain and "terrain")
  add(counted(around.planes, "plane", "planes"))
  add(counted(around.boxes, "box", "boxes"))
  add(counted(around.spheres, "sphere", "spheres"))
  add(counted(around.moving_boxes, "moving box", "moving boxes"))
  add(counted(around.moving_spheres, "moving sphere", "moving spheres"))
  add(counted(around.patches, "patch of friction", "patches of friction"))
  add(around.air and (flowing.wind or "still air"))
  add(around.fluid and (flowing.current or "a fluid"))
  add(around.anchored and "anchors")
  for _, target in ipairs(around.targets) do
    local since = target.time > 0 and (" from %.3g s on"):format(target.time) or ""
    add(("target at (%.3g, %.3g, %.3g) m%s"):format(target.position[1], target.position[2],
      target.position[3], since))
  end
  for _, name in ipairs(around.forces) do add("force " .. name) end
  return table.concat(parts, ", ")
end

--- The height of the terrain at a place, as in the engine: bilinear, and beyond the border the
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
