--- scenes.lua: ready scenes, as plain tables for an experiment's `scene`. Effects in the argument
--- replace or remove (`false`) those of the scene: `limax.scenes.land { friction = false }`.

local engine = require "limax.engine"
local schema = require "limax.engine.schema"
local suggest = require "limax.engine.suggest"

local scenes = {}

-- Takes the named lengths out of `options`, with their defaults, and returns them, the rest:
-- effects, and the lengths' names.
local function split(what, options, lengths)
  local changes, taken = {}, {}
  if options ~= nil and type(options) ~= "table" then
    engine.fail(("%s: expected a table, got %s"):format(what, schema.show(options)))
  end
  for key, value in pairs(options or {}) do changes[key] = value end
  for _, length in ipairs(lengths) do
    local name, minimum, maximum, unit = length[1], length[3], length[4], length[5]
    local value = changes[name]
    if value == nil then value = length[2] end
    -- NaN is in no range
    if type(value) ~= "number" or not (value >= minimum and value <= maximum)
      or length.whole and value % 1 ~= 0 then
      engine.fail(("%s: %s: expected %s from %g to %g%s, got %s"):format(what, name,
        length.whole and "a whole number" or "a number", minimum, maximum,
        unit and " " .. unit or "", schema.show(value)))
    end
    taken[name], changes[name] = value, nil
  end
  local names = {}
  for k, length in ipairs(lengths) do names[k] = length[1] end
  return taken, changes, names
end

-- m/s^2, the engine's own default
local standard_gravity = 9.81

-- Adds effects and scripted forces to a scene; `own` are the scene's options, for suggestions.
local function merged(base, changes, what, own)
  if changes == nil then return base end
  if type(changes) ~= "table" then
    engine.fail(("%s: expected a table of effects, got %s"):format(what, schema.show(changes)))
  end
  local known, is_effect = { unpack(own or {}) }, {}
  for _, effect in ipairs(engine.effects()) do
    known[#known + 1], is_effect[effect.name] = effect.name, true
  end
  local names, message = schema.names(changes, what)
  if not names then engine.fail(message) end
  for _, name in ipairs(names) do
    local value = changes[name]
    local is_force = type(value) == "table" and value.force ~= nil
    if not is_effect[name] and not is_force then
      engine.fail(("%s: unknown field %s%s"):format(what, schema.show(name),
        suggest.ending(name, known)))
    end
    base[name] = value
  end
  return base
end

--- Flat ground at z = 0 under standard gravity, with friction, damping and muscles.
---@param changes? table effect = true, false or { field = value }
---@return table scene
function scenes.land(changes)
  local base = { gravity = true, ground = true, friction = true, damping = true, actuation = true }
  return merged(base, changes, "scenes.land")
end

--- Nothing to stand on: gravity, damping and muscles. `gravity = false` floats.
---@param changes? table
---@return table scene
function scenes.air(changes)
  return merged({ gravity = true, damping = true, actuation = true }, changes, "scenes.air")
end

--- Still water without a bottom or a surface: drag on exposed faces, damping and muscles. The field
--- `buoyancy` is the weight of the water that a body displaces over its own: at 1 it hovers, below
--- it sinks, above it rises. Size and weight are the body's, so a scene cannot tell. Other keys are
--- effects: `drag = { current = { 0.2, 0, 0 } }` is a river.
---@param options? { buoyancy?: number }
---@return table scene
function scenes.water(options)
  local body, changes, own = split("scenes.water", options, { { "buoyancy", 1, 0, 100 } })
  local scene = { drag = true, damping = true, actuation = true }
  if body.buoyancy ~= 1 then
    scene.gravity = { acceleration = { 0, 0, standard_gravity * (body.buoyancy - 1) } }
  end
  return merged(scene, changes, "scenes.water", own)
end

--- An endless slope, as flat ground under tilted gravity: x and y run along the slope, z at right
--- angles to it. Downhill is +x, turned by `direction` about z. Other keys are effects.
---@param options { angle: number, direction?: number, gravity?: number } rad, rad, m/s^2
---@return table scene
function scenes.slope(options)
  local changes = {}
  for key, value in pairs(type(options) == "table" and options or {}) do changes[key] = value end
  local angle, direction = changes.angle, changes.direction or 0
  local strength = changes.gravity or standard_gravity
  -- NaN is no angle either
  local legal = type(angle) == "number" and math.abs(angle) < math.pi / 2
  if not legal then
    engine.fail(("scenes.slope: angle: expected a number between -pi/2 and pi/2 (rad; write "
      .. "math.rad(20) for 20 degrees), got %s"):format(schema.show(angle)))
  end
  if type(direction) ~= "number" or type(strength) ~= "number" then
    engine.fail "scenes.slope: direction (rad) and gravity (m/s^2) are numbers"
  end
  changes.angle, changes.direction, changes.gravity = nil, nil, nil
  local along = strength * math.sin(angle)
  local scene = merged(scenes.land(), changes, "scenes.slope",
    { "angle", "direction", "gravity" })
  scene.gravity = { acceleration =
    { along * math.cos(direction), along * math.sin(direction), -strength * math.cos(angle) } }
  return scene
end

--- Flat ground and stairs that rise along +x: as many steps as `count`, each `step` higher than the
--- one before and `depth` deep. The first begins at x = `start`; a body starts at x = 0 and reaches
--- as far as it is long. Other keys are effects. All lengths in m.
---@param options? table step, depth, count, width, start, and effects
---@return table scene
function scenes.stairs(options)
  local size, changes, own = split("scenes.stairs", options, {
    { "step", 0.05, 0.001, 10, "m" }, { "depth", 0.3, 0.001, 100, "m" },
    { "count", 5, 1, 16, whole = true }, { "width", 4, 0.001, 1000, "m" },
    { "start", 1, -1000, 1000, "m" } })
  local steps = {}
  for i = 1, size.count do
    local front = size.start + (i - 1) * size.depth
    steps[i] = { from = { front, -size.width / 2, 0 },
      to = { front + size.depth, size.width / 2, i * size.step } }
  end
  local scene = scenes.land()
  scene.boxes = steps
  return merged(scene, changes, "scenes.stairs", own)
end

--- Flat ground and the inside of a corner: walls across x and across y, `distance` away from the
--- world's origin. Other keys are effects.
---@param options? { distance?: number } m
---@return table scene
function scenes.corner(options)
  local size, changes, own =
    split("scenes.corner", options, { { "distance", 1, -1000, 1000, "m" } })
  local scene = scenes.land()
  scene.planes = { { normal = { -1, 0, 0 }, offset = -size.distance },
    { normal = { 0, -1, 0 }, offset = -size.distance } }
  return merged(scene, changes, "scenes.corner", own)
end

--- Uneven land: random heights from `roughness` below 0 to 0, `spacing` apart, on a square of this
--- `size` around the world's origin. The same for the same `seed`. Other keys are effects.
---@param options? { roughness?: number, spacing?: number, size?: number, seed?: integer } m
---@return table scene
function scenes.rough(options)
  local field, changes, own = split("scenes.rough", options, {
    { "roughness", 0.05, 0, 10, "m" }, { "spacing", 0.2, 0.001, 100, "m" },
    { "size", 10, 0.002, 10000, "m" }, { "seed", 1, 0, 2 ^ 53, whole = true } })
  local count = math.floor(field.size / field.spacing + 0.5) + 1
  if count < 2 or count > 512 then
    engine.fail(("scenes.rough: a size of %g m at a spacing of %g m takes %d heights a side; 2 to "
      .. "512 are possible"):format(field.size, field.spacing, count))
  end
  local random, heights = engine.random(field.seed, 1, "user"), {}
  for x = 1, count do
    heights[x] = {}
    for y = 1, count do heights[x][y] = -field.roughness * random:uniform() end
  end
  local scene, edge = scenes.land { ground = false }, -field.spacing * (count - 1) / 2
  scene.terrain = { heights = heights, spacing = field.spacing, origin = { edge, edge, 0 } }
  return merged(scene, changes, "scenes.rough", own)
end

return scenes
