--- scenes.lua: ready scenes, as the plain tables that an experiment's `scene` takes. Effects handed
--- over replace or remove (`false`) a scene's own: `limax.scenes.land { friction = false }`.

local choice = require "limax.choice"
local engine = require "limax.engine"
local schema = require "limax.schema"

local scenes = {}

-- m/s^2, the engine's own default
local standard_gravity = 9.81

local function merged(base, changes, what)
  if changes == nil then return base end
  if type(changes) ~= "table" then
    engine.fail(("%s: expected a table of effects, got %s"):format(what, schema.show(changes)))
  end
  for _, name in ipairs(choice.sorted_keys(changes)) do base[name] = changes[name] end
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
  local scene = merged(scenes.land(), changes, "scenes.slope")
  scene.gravity = { acceleration =
    { along * math.cos(direction), along * math.sin(direction), -strength * math.cos(angle) } }
  return scene
end

return scenes
