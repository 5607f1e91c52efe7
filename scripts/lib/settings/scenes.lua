--- scenes.lua: ready scenes, as plain tables for an experiment's `scene`. Effects in the argument
--- replace or remove (`false`) those of the scene: `limax.scenes.land { friction = false }`.

local choice = require "limax.base.choice"
local engine = require "limax.engine"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"
local suggest = require "limax.engine.suggest"

local scenes = strict.module "limax.scenes"

-- A length, m.
local function length(default, minimum, maximum)
  return schema.number { value = default, minimum = minimum, maximum = maximum, unit = "m" }
end

-- The options of a scene, checked and completed by their rules, and the effects in its argument.
local function split(what, argument, rules)
  local options, effects, known = {}, {}, {}
  argument = schema.demand(schema.table, argument or {}, what)
  for _, effect in ipairs(engine.effects()) do known[effect.name] = true end
  for name in pairs(rules) do known[name] = true end
  for name, value in pairs(argument) do
    -- a scripted force has any name
    if type(value) == "table" and value.force ~= nil then known[name] = true end
  end
  local names = choice.sorted_keys(known)
  local function ending(name)
    for _, effect in ipairs(engine.effects()) do
      for _, field in ipairs(effect.fields) do
        if field.name == name then
          return ("; it belongs in %s = { %s = ... }"):format(effect.name, name)
        end
      end
    end
    return suggest.ending(name, names) .. '; an effect of your own has a text: { force = "..." }'
  end
  for _, name in ipairs(schema.known(argument, known, what, ending)) do
    if not rules[name] then effects[name] = argument[name] end
  end
  for name, rule in pairs(rules) do
    options[name] = schema.demand(rule, argument[name], what .. "." .. name)
  end
  return options, effects
end

-- Adds effects to a scene; a controller takes the place of the muscles' sine.
local function merged(scene, effects)
  if effects.control then scene.actuation = nil end
  for name, value in pairs(effects) do scene[name] = value end
  return scene
end

local standard_gravity = 9.81 -- m/s^2, the engine's default

--- Flat ground at z = 0 under standard gravity, with friction, damping and muscles.
---@param changes? table effect = true, false or { field = value }
---@return table scene
function scenes.land(changes)
  local base = { gravity = true, ground = true, friction = true, damping = true, actuation = true }
  local _, effects = split("scenes.land", changes, {})
  return merged(base, effects)
end

--- Nothing to stand on: gravity, damping and muscles. `gravity = false` floats.
---@param changes? table
---@return table scene
function scenes.air(changes)
  local _, effects = split("scenes.air", changes, {})
  return merged({ gravity = true, damping = true, actuation = true }, effects)
end

--- Still water without a bottom or a surface: drag on exposed faces, damping and muscles. The field
--- `buoyancy` is the weight of the water that a body displaces over its own: at 1 it hovers, below
--- it sinks, above it rises. It is a field because a scene does not know size and weight of the
--- body. Other keys are effects: `drag = { current = { 0.2, 0, 0 } }` is a river.
---@param options? { buoyancy?: number }
---@return table scene
function scenes.water(options)
  local body, effects = split("scenes.water", options,
    { buoyancy = schema.number { value = 1, minimum = 0, maximum = 100 } })
  if (options or {}).buoyancy ~= nil and effects.gravity ~= nil then
    engine.fail "scenes.water: buoyancy sets the gravity of the scene: drop gravity, or buoyancy"
  end
  local scene = { drag = true, damping = true, actuation = true }
  if body.buoyancy ~= 1 then
    scene.gravity = { acceleration = { 0, 0, standard_gravity * (body.buoyancy - 1) } }
  end
  return merged(scene, effects)
end

--- An endless slope, as flat ground under tilted gravity: x and y run along the slope, z at right
--- angles to it. Downhill is +x, turned by `direction` about z. Other keys are effects.
---@param options { angle: number, direction?: number, gravity?: number } rad, rad, m/s^2
---@return table scene
function scenes.slope(options)
  local slope, effects = split("scenes.slope", options, {
    angle = schema.number { above = -math.pi / 2, below = math.pi / 2,
      unit = "rad; math.rad(20) is 20 degrees" },
    direction = schema.number { value = 0, minimum = -2 * math.pi, maximum = 2 * math.pi,
      unit = "rad" },
    gravity = schema.number { value = standard_gravity, unit = "m/s^2" } })
  local along = slope.gravity * math.sin(slope.angle)
  local scene = merged(scenes.land(), effects)
  scene.gravity = { acceleration = { along * math.cos(slope.direction),
    along * math.sin(slope.direction), -slope.gravity * math.cos(slope.angle) } }
  return scene
end

--- Flat ground and stairs that rise along +x: as many steps as `count`, each `step` higher than the
--- one before and `depth` deep. The first begins at x = `start`; a body starts at x = 0 and reaches
--- as far as it is long. Other keys are effects. All lengths in m.
---@param options? table step, depth, count, width, start, and effects
---@return table scene
function scenes.stairs(options)
  local size, effects = split("scenes.stairs", options, {
    step = length(0.05, 0.001, 10), depth = length(0.3, 0.001, 100),
    count = schema.whole(1, 16, 5), width = length(4, 0.001, 1000),
    start = length(1, -1000, 1000) })
  local steps = {}
  for i = 1, size.count do
    local front = size.start + (i - 1) * size.depth
    steps[i] = { from = { front, -size.width / 2, 0 },
      to = { front + size.depth, size.width / 2, i * size.step } }
  end
  local scene = scenes.land()
  scene.boxes = steps
  return merged(scene, effects)
end

--- Flat ground and the inside of a corner: walls across x and across y, `distance` away from the
--- world's origin. Other keys are effects.
---@param options? { distance?: number } m
---@return table scene
function scenes.corner(options)
  local size, effects = split("scenes.corner", options, { distance = length(1, -1000, 1000) })
  local scene = scenes.land()
  scene.planes = { { normal = { -1, 0, 0 }, offset = -size.distance },
    { normal = { 0, -1, 0 }, offset = -size.distance } }
  return merged(scene, effects)
end

--- Uneven land: random heights from `roughness` below 0 to 0, `spacing` apart, on a square of this
--- `size` around the world's origin. The same for the same `seed`. Other keys are effects.
---@param options? { roughness?: number, spacing?: number, size?: number, seed?: integer } m
---@return table scene
function scenes.rough(options)
  local field, effects = split("scenes.rough", options, {
    roughness = length(0.05, 0, 10), spacing = length(0.2, 0.001, 100),
    size = length(10, 0.002, 10000), seed = schema.whole(0, 2 ^ 53, 1) })
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
  return merged(scene, effects)
end

--- A force for a scene: an impulse on the whole body, which changes the velocity of every mass
--- alike: `velocity` times its mass, N s, from `time` on. It lasts about `lasts`, to within a step.
--- Kicks that differ in these numbers share a kernel on a GPU.
---@param options { time?: number, velocity?: number[], lasts?: number } s, m/s, s
---@return table effect
function scenes.kick(options)
  local kick = schema.demand(schema.fields {
    time = schema.number { value = 1, minimum = 0, maximum = 1e6, unit = "s" },
    velocity = schema.numbers(3, { minimum = -1e6, maximum = 1e6, unit = "m/s" }),
    lasts = schema.number { value = 0.05, minimum = 0.001, maximum = 10, unit = "s" } },
    options, "scenes.kick")
  local acceleration, velocity = {}, kick.velocity or { 0, 0.5, 0 }
  for axis = 1, 3 do acceleration[axis] = velocity[axis] / kick.lasts end
  return { force = "f = t >= time && t < time + lasts ? m * acceleration : vec(0, 0, 0);",
    bound = { stiffness = 0, damping = 0 }, time = kick.time, lasts = kick.lasts,
    acceleration = acceleration }
end

return strict.close("limax.scenes", scenes)
