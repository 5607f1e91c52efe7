--- named_control.lua: controllers that a scene names: `control = "network"`, or with options
--- `control = { "network", hidden = 8 }`. It takes the place of the muscles' sine: it
--- has its frequency, and networks begin as that sine. Sensors that are left out are all those that
--- the controller can read and the scene has something for.

local choice = require "limax.base.choice"
local control = require "limax.control"
local engine = require "limax.engine"
local suggest = require "limax.engine.suggest"

local named_control = {}

local OF_VOXEL = { "strain", "strain_rate", "load", "contact" }
local OF_BODY = { "gravity", "velocity", "spin", "clock" }
-- what an effect of the scene adds
local OF_SCENE = { { "target", "target", "target_distance" },
  { "block", "block", "block_velocity" }, { "terrain", "ahead" } }

local function add(list, names, first)
  for i = first or 1, #names do list[#list + 1] = names[i] end
  return list
end

local function sensors_in(scene, name)
  local sensors = add(name == "network" and add({}, OF_VOXEL) or {}, OF_BODY)
  for _, entry in ipairs(OF_SCENE) do
    if scene[entry[1]] then add(sensors, entry, 2) end
  end
  return sensors
end

--- The scene with its controller instead of a name; any other scene as it is.
---@param scene any as a script wrote it
function named_control.resolve(scene)
  local named = type(scene) == "table" and scene.control
  local name = type(named) == "table" and named[1] or named
  -- about any other text the engine's scene has a message
  if type(name) ~= "string" or not name:match "^[%w_]+$" then return scene end
  local make = rawget(control, name)
  if not make then
    local names = choice.sorted_keys(control)
    engine.fail(("scene: control: there is no controller %q%s"):format(name,
      suggest.ending(name, names)))
  end
  local own, options = {}, {}
  for effect, value in pairs(scene) do own[effect] = value end
  for option, value in pairs(type(named) == "table" and named or {}) do
    if option ~= 1 then options[option] = value end
  end
  if name == "network" or name == "central" then
    options.sensors = options.sensors or sensors_in(scene, name)
    if scene.actuation then options.base = options.base or "sine" end
  end
  local sine = scene.actuation
  options.frequency = options.frequency or type(sine) == "table" and sine.frequency or nil
  own.actuation, own.control = nil, make(options)
  return own
end

return named_control
