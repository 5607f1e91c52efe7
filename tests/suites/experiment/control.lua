--- control.lua: the texts of limax.control, and a Lua function as controller.

local control = require "limax.control"
local limax = require "limax"

local suite = require("limax.test").suite "control"

-- Land with everything that sensors see; passive without a controller.
local function land(controller)
  return limax.scenes.land { actuation = false, control = controller, target = true,
    block = { position = { 3, 0, 0 } } }
end

local function genes_of(controller) return limax.engine.scene(land(controller)):control_genes() end

-- The walk of a robot under a controller, with genes of control that are all `value`, or a list.
local function walk(controller, genes, options)
  local o = { scene = land(controller), duration = 0.5, settle = 0.1, device = "cpu",
    record = { center_of_mass = 100 } }
  for name, value in pairs(options or {}) do o[name] = value end
  return limax.robot({ voxels = "eeee\nceec\n\nescs\necse", control = genes,
    weights = { phase = function(x) return x / 4 end } }):simulate(o)
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
  local passive, sine = path(walk()), path(walk(control.sine { frequency = 3 }))
  local of_network = { sensors = SENSORS, hidden = 4, messages = 2, states = 2 }
  local of_central = { sensors = { "gravity", "clock" }, hidden = 4 }
  for _, case in ipairs { { passive, nil }, { sine, "sine" } } do
    for name, options in pairs { network = of_network, central = of_central } do
      options.base, options.frequency = case[2], 3
      local made = control[name](options)
      t:same_bits(path(walk(made, zeros(genes_of(made)))), case[1])
    end
  end
  t:same_bits(path(walk(control.reflex { gain = 0 })), passive)
  t:same_bits(path(walk(control.reflex { gain = 0, frequency = 3 })), sine)
  t:same_bits(path(walk(control.oscillators { frequency = 3 }, { 0, 0 })), sine)
  -- and the sine is the open loop's, sampled
  local function floats(effects)
    effects.gravity = false
    return walk(nil, nil, { scene = limax.scenes.air(effects), record = { position = 20 } })
      :trace("position"):table()
  end
  t:near(floats { control = control.sine { frequency = 3, rate = 2500 } },
    floats { actuation = { frequency = 3, ramp = 0 } }, { atol = 8e-4 }) -- m, of a tick's delay
end)

suite:test("networks and oscillators act by their genes", function(t)
  -- the direct weights lie behind the perceptron's genes
  local made = control.network { sensors = { "contact", "clock" }, hidden = 4, rate = 50 }
  local genes = zeros(genes_of(made))
  genes[#genes - 1] = 2
  local record = { record = { activation = 50 } }
  local direct = walk(made, genes, record):trace("activation"):table()
  local text = walk({ signal = "a = tanh(2 * clock_sine);", rate = 50 }, nil, record)
  t:same_bits(direct, text:trace("activation"):table())
  -- a change of the frequency by 1 Hz
  local faster = walk(control.oscillators { frequency = 2, rate = 1000 }, { 1, 0 }, record)
  local sine = walk(control.sine { frequency = 3, rate = 1000 }, nil, record)
  t:near(faster:trace("activation"):table(), sine:trace("activation"):table(), { atol = 1e-3 })
  -- coupled phases become equal: the voxels differ less and less
  local coupled = walk(control.oscillators { frequency = 2, rate = 100 }, { 0, 20 },
    { record = { activation = 50 }, duration = 1.5 }):trace "activation"
  local function spread(row) return math.max(unpack(row)) - math.min(unpack(row)) end
  t:ok(spread(coupled[70]:table()) < 0.05 and spread(coupled[5]:table()) > 0.3)
end)

suite:test("a scene may name its controller", function(t)
  local function signal(scene, changes)
    local experiment = limax.experiment { fitness = "walk", scene = scene }
    return (changes and experiment:override(changes) or experiment).config.scene.control
  end
  local sine = { actuation = { frequency = 3 }, terrain = { spacing = 5,
    heights = { { 0, 0 }, { 0, 0 } } } }
  local network = signal(limax.scenes.rough(sine), { "scene.control=network",
    "scene.control.hidden=4" })
  t:equal({ network.frequency, network.signal }, { 3, control.network { base = "sine", hidden = 4,
    sensors = { "strain", "strain_rate", "load", "contact", "gravity", "velocity", "spin", "clock",
      "ahead" } }.signal })
  t:equal(signal(limax.scenes.land { control = "sine" }).signal, control.sine().signal)
  local by_name = walk { "reflex", gain = 2 }
  t:same_bits(path(by_name), path(walk(control.reflex { gain = 2 })))
  t:raises('there is no controller "netwrk"; did you mean "network"?',
    function() signal { control = "netwrk" } end)
end)

suite:test("a function controls a robot by hand, as a text would", function(t)
  local times = {}
  local function drive(moving, time)
    t:ok(moving:center()[3] > 0)
    times[#times + 1] = time
    return 0.5 * time + 0.1
  end
  for _, settle in ipairs { 0, 0.1 } do
    local options = { settle = settle, precision = "double" }
    local text = path(walk({ rate = 50, signal = "a = 0.5 * t + 0.1;" }, nil, options))
    t:same_bits(path(walk({ rate = 50, signal = drive }, nil, options)), text)
    t:equal({ #times, times[1], times[25] }, { 25, 0, 0.48 })
    times = {}
  end
  local list = zeros(16)
  list[2] = 0.25
  local walked = walk(function() return list end, nil, { record = { activation = 50 } })
  t:equal(walked:trace("activation")[20]:table(), list)
  t:raises("a Lua function controlled the robot", function() walked:simulate() end)
  t:raises("one for each of the 16 voxels of the lattice, got 2 entries",
    function() walk(function() return { 0, 1 } end) end)
  t:raises("a Lua function controls only a robot by hand", function()
    limax.experiment { fitness = "walk", scene = land(function() return 0 end) }
  end)
end)

suite:test("options are checked", function(t)
  for message, call in pairs {
    ['network.sensors[2]: there is no sensor "starin"; did you mean "strain"?'] = function()
      control.network { sensors = { "clock", "starin" } }
    end,
    ["network.sensors: expected a list of sensors"] = function() control.network {} end,
    ["central.sensors[1]: strain.x differs from voxel to voxel"] = function()
      control.central { sensors = { "strain.x" } }
    end,
    ["central.groups: expected 2, 4 or 8, got 3"] = function()
      control.central { sensors = { "gravity" }, groups = 3 }
    end,
    ['reflex.sensor: expected one number, such as "strain.x", got "strain"'] = function()
      control.reflex { sensor = "strain" }
    end,
    ["control.network.hold: expected 0 or 1, got true"] = function()
      control.network { sensors = { "clock" }, hold = true }
    end,
    ["control.hold: expected 0 or 1, got true"] = function()
      walk { signal = "a = 1;", hold = true }
    end,
    ["call it: limax.control.reflex {}"] = function() walk(control.reflex) end,
    ['write control = { signal = "a = 1;" }'] = function() walk "a = 1;" end,
    ['control.singal: unknown field; did you mean "signal"?'] = function()
      walk { singal = "a = 1;" }
    end,
    ["did you mean clock_sine?"] = function() walk { signal = "a = sin(frequency * t);" } end,
    ["control.change: expected a number from 0.001 to 2, got 3"] = function()
      walk { signal = "a = 1;", change = 3 }
    end,
    ["control.noise: it acts on the sensors that a text reads"] = function()
      walk { signal = function() return 0 end, noise = 0.1 }
    end,
    ["reads 2 genes of control, and the robot has 3: remove the surplus"] = function()
      walk({ signal = "a = g[1];" }, { 1, 2, 3 })
    end,
    ["the robot has 0: limax.robot { voxels = ..., control = { 2 numbers } }"] = function()
      walk { signal = "a = g[1];" }
    end,
    ["control: the controller gave a value that is not finite"] = function()
      walk({ signal = "a = sqrt(-1);" }):distance()
    end,
  } do t:raises(message, call) end
  local clock = { signal = "a = clock_sine;", rate = 20, frequency = 10, delay = 0.02 }
  local notes = table.concat(limax.experiment { fitness = "walk", scene = land(clock) }.notes)
  for _, field in ipairs { "frequency is 10 Hz", "delay is 0.02 s" } do
    t:ok(notes:find("scene.control." .. field, 1, true), notes)
  end
end)
