--- control.lua: the texts of limax.control, and a Lua function as controller.

local control = require "limax.control"
local limax = require "limax"

local suite = require("limax.test").suite "control"

suite:fixture("walker", { shared = true }, function()
  return { voxels = "eses\nceec\n\nescs\necse", weights = { phase = function(x) return x / 4 end } }
end)

-- Land with everything that sensors see; passive without a controller.
local function land(controller)
  return limax.scenes.land { actuation = false, control = controller, target = true,
    block = { position = { 3, 0, 0 } } }
end

local function genes_of(controller) return limax.engine.scene(land(controller)):control_genes() end

-- The walk of a robot under a controller, with genes of control that are all `value`, or a list.
local function walk(t, controller, genes, options)
  local description = { control = genes }
  for name, value in pairs(t:fixture "walker") do description[name] = value end
  local o = { scene = land(controller), duration = 0.5, settle = 0.1, device = "cpu",
    record = { center_of_mass = 100 } }
  for name, value in pairs(options or {}) do o[name] = value end
  return limax.robot(description):simulate(o)
end

local function zeros(count)
  local list = {}
  for i = 1, count do list[i] = 0 end
  return list
end

local function path(robot) return robot:trace("center_of_mass"):table() end

local SENSORS = {}
for i, sensor in ipairs(limax.engine.sensors()) do SENSORS[i] = sensor.name end

suite:test("texts compile with all options", function(t)
  for _, sensors in ipairs { SENSORS, { "clock" }, { "strain.x", "gravity.z", "clock_sine" } } do
    for _, messages in ipairs { 0, 1, 4 } do
      for _, states in ipairs { 0, 1, 16 } do
        for _, base in ipairs { "passive", "sine" } do
          local made = control.network { sensors = sensors, messages = messages, states = states,
            hidden = 3, base = base, leak = 0.5, rate = 50, noise = 0.1, delay = 0.1 }
          local resolved = limax.engine.scene(land(made)):table().control
          t:equal({ resolved.rate, resolved.noise, resolved.delay }, { 50, 0.1, 0.1 })
          t:equal(resolved.leak, states > 0 and 0.5 or nil)
        end
      end
    end
  end
  for _, groups in ipairs { 2, 4, 8 } do
    local made = control.central { sensors = { "gravity", "velocity", "spin", "target",
      "target_distance", "block", "block_velocity", "ahead", "clock", "t" }, groups = groups }
    t:ok(genes_of(made) > 16 * (25 + groups))
  end
  t:equal(genes_of(control.oscillators()), 2)
  t:equal(genes_of(control.oscillators { feedback = "strain.z", frequency = 1 }), 3)
  t:equal(genes_of(control.reflex { sensor = "contact", gain = -2, frequency = 1 }), 0)
end)

suite:test("zero genes are passive, or the sine, bit for bit", function(t)
  local passive, sine = path(walk(t)), path(walk(t, control.sine { frequency = 3 }))
  local of_network = { sensors = SENSORS, hidden = 4, messages = 2, states = 2 }
  local of_central = { sensors = { "gravity", "clock" }, hidden = 4 }
  for _, case in ipairs { { passive, nil }, { sine, "sine" } } do
    for name, options in pairs { network = of_network, central = of_central } do
      options.base, options.frequency = case[2], 3
      local made = control[name](options)
      t:same_bits(path(walk(t, made, zeros(genes_of(made)))), case[1])
    end
  end
  t:same_bits(path(walk(t, control.reflex { gain = 0 })), passive)
  t:same_bits(path(walk(t, control.reflex { gain = 0, frequency = 3 })), sine)
  t:same_bits(path(walk(t, control.oscillators { frequency = 3 }, { 0, 0 })), sine)
  -- and the sine is the open loop's, sampled
  local function floats(effects)
    effects.gravity = false
    return walk(t, nil, nil, { scene = limax.scenes.air(effects), record = { position = 20 } })
      :trace("position"):table()
  end
  t:near(floats { control = control.sine { frequency = 3, rate = 2500 } },
    floats { actuation = { frequency = 3, ramp = 0 } }, { atol = 8e-4 }) -- m, of a tick's delay
end)
