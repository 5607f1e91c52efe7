--- control.lua: controllers: closed forms of decay and ticks, every sensor against a hand-computed
--- pose, noise, messages, and the same bits however the work is divided. SI units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local evolution = require "support.evolution"
local limax = require "limax"

local suite = require("limax.test").suite "control"

local WALKER = "eses\neses\neses\n\neses\neses\neses"
local PRECISIONS = { "single", "compensated", "double" }

-- A robot with this controller, on the CPU; `fields` are of the effect, `options` of the
-- simulation.
local function controlled(voxels, signal, fields, options, around)
  local robot = type(voxels) == "table" and voxels or { voxels = voxels }
  local control = signal and evolution.with({ signal = signal }, fields)
  return limax.robot(robot):simulate(evolution.with({ device = "cpu", duration = 0.5, settle = 0,
    scene = evolution.with({ control = control }, around) }, options))
end

-- ---- decay --------------------------------------------------------------------------------------

-- Complex numbers as { real, imaginary }.
local function times(a, b) return { a[1] * b[1] - a[2] * b[2], a[1] * b[2] + a[2] * b[1] } end
local function over(a, b)
  local size = b[1] ^ 2 + b[2] ^ 2
  return times(a, { b[1] / size, -b[2] / size })
end
local function exp(a)
  return times({ math.exp(a[1]), 0 }, { math.cos(a[2]), math.sin(a[2]) })
end

-- The root of s^2 + w^2 + b s H(s) near i w. H is that of ticks every T which act `late` ticks
-- after they sense: of a value held until the next, (1 - e^(-s T)) / (s T); of the ramp between
-- two, e^(-s T) (sinh(s T / 2) / (s T / 2))^2, the square of the same.
local function root_of(w, b, T, late, hold)
  local s = { 0, w }
  for _ = 1, 20 do
    local sT = { s[1] * T, s[2] * T }
    local back = exp { -sT[1], -sT[2] }
    local H = over({ 1 - back[1], -back[2] }, sT)
    if not hold then H = times(H, H) end
    H = times(H, exp { -late * sT[1], -late * sT[2] })
    local forced = times(times(s, H), { b, 0 })
    -- s = i sqrt(w^2 + b s H), which changes little with s
    local real, imaginary = w * w + forced[1], forced[2]
    local size = math.sqrt(math.sqrt(real ^ 2 + imaginary ^ 2))
    local angle = math.atan2(imaginary, real) / 2
    s = { -size * math.sin(angle), size * math.cos(angle) }
  end
  return s
end

-- The rate at which a vibration with angular frequency w decays: its part at w in the first half
-- of the samples over that in the second, through a window that suppresses all else.
local function decay_of(values, rate, w)
  local count = math.floor(#values / 2)
  local function part(first)
    local real, imaginary = 0, 0
    for i = 0, count - 1 do
      local angle, weight = w * i / rate, 1 - math.cos(2 * math.pi * i / count)
      real = real + weight * values[first + i] * math.cos(angle)
      imaginary = imaginary + weight * values[first + i] * math.sin(angle)
    end
    return math.sqrt(real ^ 2 + imaginary ^ 2)
  end
  return math.log(part(1) / part(1 + count)) * rate / count
end

-- A voxel whose rest lengths are pushed by -g times its strain rate breathes with
-- e'' + w^2 (e - amplitude a) = 0, w^2 = 8 k / m, a = -g e' as the ticks pass it on.
local function decay(gain, fields)
  local k, m, amplitude = 200, 0.1, 0.3
  local materials = engine.materials("paper"):table()
  for _, each in ipairs(materials.materials) do
    if each.letter == "e" then
      each.stiffness, each.mass_per_site, each.amplitude, each.phase = k, m, amplitude, 0
    end
  end
  local made = engine.materials(materials)
  local population = engine.population { lattice = { 1, 1, 1 }, count = 1 }
  population:set_body(1, { "e" }, nil, made)
  population:check(made)
  local simulation = engine.simulation(population, made, engine.scene { control = evolution.with(
    { signal = "a = -g_of_rate * strain_rate;", g_of_rate = 5 * gain }, fields) },
    { duration = 2, settle = 0, precision = "double", time_step = 1e-4,
      record = { position = 1000 } }, engine.device "cpu")
  local positions = (simulation:state(1)):table()
  for _, p in ipairs(positions) do
    for axis = 1, 3 do p[axis] = 1.002 * p[axis] end
  end
  simulation:place(1, positions)
  simulation:run()
  local trace, widths = simulation:trace(1, "position"):table(), {}
  for i, sample in ipairs(trace) do widths[i] = sample[2][1] - sample[1][1] - 0.1 end
  local w = math.sqrt(8 * k / m)
  local T = 1 / fields.rate
  -- leapfrog applies a force that sets in half a step too long
  local late = (fields.delay or 0) - (fields.hold and 0.5e-4 or 0)
  local root = root_of(w, gain * amplitude * w * w, T, late / T, fields.hold == 1)
  return decay_of(widths, 1000, root[2]), -root[1]
end

suite:test("a vibration decays at the rate of its delayed reflex", function(t)
  for _, fields in ipairs { { rate = 1000 }, { rate = 200 }, { rate = 200, hold = 1 },
    { rate = 200, delay = 0.005 } } do
    local measured, predicted = decay(4e-4, fields)
    t:near(measured, predicted, { rtol = 5e-4 })
  end
end)

-- ---- ticks --------------------------------------------------------------------------------------

suite:test("an activation is reached by the next tick, or at once, and changes by at most `change`",
  function(t)
    local function wanted(tick) return tick < 0 and 0 or 0.9 * math.sin(0.5 + 20 * tick / 50) end
    local limited = { [-1] = 0 }
    for tick = 0, 25 do
      limited[tick] = math.max(limited[tick - 1] - 0.2,
        math.min(limited[tick - 1] + 0.2, wanted(tick)))
    end
    for _, fields in ipairs { {}, { hold = 1 }, { change = 0.2 } } do
      local done = controlled("ec", "a = 0.9 * sin(0.5 + 20 * t);",
        evolution.with({ rate = 50 }, fields),
        { record = { activation = 250, sensor = 50 }, precision = "double" })
      local trace = done:trace "activation"
      for i = 1, trace:size() do
        local tick, share = math.floor((i - 1) / 5), (i - 1) % 5 / 5
        local before, after = wanted(tick - 1), wanted(tick)
        if fields.change then before, after = limited[tick - 1], limited[tick] end
        local expected = before + (after - before) * (fields.hold and 1 or share)
        -- nothing ticks at the end
        if i == trace:size() then expected = before end
        t:near(trace[i]:table(), { expected, expected }, { atol = 1e-9 })
      end
    end
  end)

suite:test("clock and time are those of the ticks", function(t)
  -- 20 Hz and 7 Hz have no whole number of turns per tick
  local done = controlled("e", "a = clock_sine * clock_cosine + t;",
    { rate = 20, frequency = 7 }, { record = { sensor = 20 }, precision = "double" })
  local trace = done:trace "sensor"
  t:equal(trace.inputs, { "clock_sine", "clock_cosine", "t" })
  for i = 1, trace:size() - 1 do
    local at = (i - 1) / 20
    t:near(trace[i]:table(), { { math.sin(14 * math.pi * at) },
      { math.cos(14 * math.pi * at) }, { at } }, { atol = 1e-12 })
  end
end)

local PERCEPTRON = "real y[2] = perceptron(3, g[0], strain, contact, clock_sine);"
  .. " say[0] = y[1]; a = y[0] + heard[0];"

suite:test("genes of 0 are the passive body, bit for bit", function(t)
  local genes = {}
  for k = 1, 29 do genes[k] = 0 end
  for _, precision in ipairs(PRECISIONS) do
    local options = { precision = precision, time_step = 2e-4, record = { position = 20 } }
    local scene = limax.scenes.land()
    scene.actuation = nil
    local passive = controlled(WALKER, nil, nil, options, scene)
    local zero = controlled({ voxels = WALKER, control = genes }, PERCEPTRON, nil, options, scene)
    t:same_bits(zero:trace("position"):table(), passive:trace("position"):table())
  end
end)

suite:test("messages are one tick old, and 0 where there is no neighbour", function(t)
  -- faces are -x, +x, -y, +y, -z, +z, six of each message; the third voxel is empty
  local done = controlled("ee\n.e", "say[0] = 0.02 * place.x + 0.04 * place.y + 0.1 * t;"
    .. " say[1] = 0.5; a = heard[0] + 2 * heard[1] + 3 * heard[2] + 4 * heard[3]"
    .. " + 100 * (heard[4] + heard[5]) + heard[6];",
    { rate = 10, hold = 1 }, { record = { activation = 10 }, precision = "double" })
  local trace = done:trace("activation"):table()
  t:equal(trace[1], { 0, 0, 0, 0 })
  for tick = 1, 4 do
    local time = 0.1 * (tick - 1) / 10
    local first, second, fourth = -0.03 + time, -0.01 + time, 0.03 + time
    t:near(trace[tick + 1], { 2 * second, first + 4 * fourth + 0.5, 0, 3 * second },
      { atol = 1e-12 })
  end
end)

suite:test("states and messages leave the sensors alone", function(t)
  local function seen(more)
    local done = controlled("ee", more .. "a = 0.5 * clock_sine + strain.x;", { rate = 50 },
      { record = { sensor = 50 }, precision = "double" })
    return done:trace("sensor"):table()
  end
  t:same_bits(seen "s[0] += 1; s[15] = 3; say[0] = 5 + heard[0]; say[3] = s[0];", seen "")
end)

-- ---- sensors ------------------------------------------------------------------------------------

-- A controller that reads every sensor that a scene allows.
local function reading_all(scene)
  local terms = {}
  for _, sensor in ipairs(engine.sensors()) do
    local of = sensor.name:match "^target" or sensor.name:match "^block"
    if not of or scene[of] then
      terms[#terms + 1] = sensor.components == 3 and ("length(%s)"):format(sensor.name)
        or sensor.name
    end
  end
  return ("a = 0 * (%s);"):format(table.concat(terms, " + "))
end

local DOWN = { acceleration = { 0, 0, -9.81 } }
-- terrain that rises by 0.1 along y
local RISING = { spacing = 1, origin = { -1, 0, 0 }, heights = {} }
for x = 1, 2 do RISING.heights[x] = { 0, 0.1, 0.2 } end

-- Poses of the body at { 1, 2, 3 }: `map` gives the place of a corner relative to the middle, from
-- that in the undeformed body; `flow` its velocity. Sensors without a name are as in ELSE, or 0.
local ELSE = { clock_cosine = 1, phase = math.pi }
local POSES = {
  { "at rest", expected = { ["gravity.z"] = -1, ["block.x"] = 0.25, ["block.y"] = 0.35,
    ["block.z"] = 0.45, ["block_velocity.x"] = 0.5, ["block_velocity.y"] = -1,
    ["block_velocity.z"] = 2, ["target.x"] = 0.6, ["target.z"] = 0.8, target_distance = 1 },
    scene = { gravity = DOWN, target = { position = { 4.05, 2.05, 7.05 } }, block = {
      position = { 0.2, 0.3, 0.4 }, size = { 0.2, 0.2, 0.2 }, velocity = { 0.5, -1, 2 } } },
  },
  { "stretched, and stretching", map = function(x, y, z) return 1.1 * x, 0.9 * y, z end,
    flow = function(x, y, z) return 0.4 * x, -0.2 * y, 0.7 * z end,
    expected = { ["strain.x"] = 0.5, ["strain.y"] = -0.5,
      strain_rate = (0.44 - 0.18 + 0.7) / 3 / 5 } },
  { "sheared along x", map = function(x, y, z) return x + 0.75 * z, y, z end,
    scene = { gravity = { acceleration = { 3, 0, -4 } } },
    expected = { ["strain.z"] = 1.25, ["gravity.x"] = 0.6, ["gravity.z"] = -0.8 } },
  { "sheared along z", map = function(x, y, z) return x, y, z + 0.75 * x end,
    scene = { gravity = DOWN },
    expected = { ["strain.x"] = 1.25, ["gravity.x"] = -0.6, ["gravity.z"] = -0.8 } },
  { "turned about z, flying and spinning", map = function(x, y, z) return -y, x, z end,
    flow = function(x, y, z) return 0.3 - 2 * y, 0.4 + 2 * x - z, 0.5 + y end,
    scene = { gravity = { acceleration = { 0, -1, 0 } },
      target = { position = { 1.05, 7.05, 3.05 } },
      block = { position = { 1, 0, 0 }, size = { 0.1, 0.1, 0.1 }, velocity = { 0, 0.25, 0 } } },
    expected = { ["gravity.x"] = -1, ["velocity.x"] = 0.4, ["velocity.y"] = -0.3,
      ["velocity.z"] = 0.5, ["spin.y"] = -0.2, ["spin.z"] = 0.4, ["target.x"] = 1,
      target_distance = 1, ["block.y"] = -1, ["block_velocity.x"] = 0.25 } },
  { "1 mm deep in the ground, falling", flow = function() return 0, 0, -1 end,
    scene = { gravity = DOWN, ground = { stiffness = 1000, height = 3.001 } },
    -- 1 N on four of eight masses of 0.1 kg
    expected = { contact = 0.5, load = 4 / (0.8 * 9.81) / 4, ["gravity.z"] = -1,
      ["velocity.z"] = -1 } },
  { "before a rise, turned about z", map = function(x, y, z) return -y, x, z end,
    scene = { terrain = RISING, ground = { height = -1 } }, at = { 0, 0, 3 },
    expected = { ["ahead.x"] = 0.1, ["ahead.y"] = 0.2, ["ahead.z"] = 0.3 } },
  { "one of two voxels stretched", voxels = { "e", "e" }, voxel = 2,
    map = function(x, y, z) return x > 0.06 and x + 0.02 or x, y, z end,
    expected = { ["strain.x"] = 1, ["place.x"] = 0.5 } },
}

-- What voxel `voxel` of a pose's body senses at the first tick, by name.
local function sensed(pose, precision)
  local materials = engine.materials "paper"
  local voxels = pose.voxels or { "e" }
  local population = engine.population { lattice = { #voxels, 1, 1 }, count = 1 }
  population:set_body(1, voxels, nil, materials)
  population:check(materials)
  local at = pose.at or { 1, 2, 3 }
  local around = pose.scene or {}
  local scene = evolution.with({ control = { signal = reading_all(around) } }, around)
  local simulation = engine.simulation(population, materials, engine.scene(scene),
    { duration = 0.1, settle = 0, position = at, precision = precision, time_step = 1e-4,
      record = { sensor = 20 } }, engine.device "cpu")
  local positions = (simulation:state(1)):table()
  local velocities, middle = {}, { at[1] + 0.05, at[2] + 0.05, at[3] + 0.05 }
  for i, p in ipairs(positions) do
    local x, y, z = p[1] - middle[1], p[2] - middle[2], p[3] - middle[3]
    if pose.map then x, y, z = pose.map(x, y, z) end
    positions[i] = { middle[1] + x, middle[2] + y, middle[3] + z }
    velocities[i] = { (pose.flow or function() return 0, 0, 0 end)(x, y, z) }
  end
  simulation:place(1, positions, velocities)
  simulation:advance(1, 1)
  local trace, values = simulation:trace(1, "sensor"), {}
  for i, name in ipairs(trace.inputs) do values[name] = trace[1][i][pose.voxel or 1] end
  return values
end

suite:test("each sensor measures what a pose has", function(t)
  for _, pose in ipairs(POSES) do
    for _, precision in ipairs { "double", "compensated" } do
      local values, names = sensed(pose, precision), {}
      for name in pairs(values) do names[#names + 1] = name end
      t:ok(#names >= 26)
      for _, name in ipairs(names) do
        local expected = pose.expected[name] or ELSE[name] or 0
        t:ok(math.abs(values[name] - expected) < (precision == "double" and 1e-7 or 1e-4),
          ("%s, %s: %s is %.9g, expected %.9g"):format(pose[1], precision, name, values[name],
            expected))
      end
    end
  end
end)

suite:test("targets appear one after the other", function(t)
  local materials = engine.materials "paper"
  local population = engine.population { lattice = { 1, 1, 1 }, count = 1 }
  population:set_body(1, { "e" }, nil, materials)
  population:check(materials)
  local scene = engine.scene { control = { signal = "a = 0 * target_distance;", rate = 20 },
    target = { { time = 0.1, position = { 2.05, 0.05, 0.05 } },
      { time = 0.2, position = { 0.05, 4.05, 0.05 } } } }
  local simulation = engine.simulation(population, materials, scene, { duration = 0.3, settle = 0,
    position = { 0, 0, 0 }, precision = "double", record = { sensor = 20 } }, engine.device "cpu")
  simulation:run()
  local trace, distances = simulation:trace(1, "sensor"), {}
  for tick = 1, 6 do distances[tick] = 5 * trace[tick][1][1] end -- 5 m is its range
  t:near(distances, { 0, 0, 2, 2, 4, 4 }, { atol = 1e-9 })
  t:raises("scene.target[2].time: 1 s, but the target before it appears at 1 s; expected a later",
    function() engine.scene { target = { { time = 1 }, { time = 1 } } } end)
end)

suite:test("noise has its range and differs by seed, tick, voxel and sensor", function(t)
  local function noisy(seed)
    local done = controlled("eee", "a = 0 * (contact + load + clock_sine);",
      { rate = 100, noise = 0.2, seed = seed },
      { record = { sensor = 100 }, duration = 2, precision = "double" })
    return done:trace("sensor"):table()
  end
  local trace, values, sum, largest = noisy(1), {}, 0, 0
  for tick = 1, 200 do
    for input = 1, 2 do
      for voxel = 1, 3 do
        local value = trace[tick][input][voxel]
        t:ok(not values[value], "two draws are equal")
        values[value], values[#values + 1] = true, value
        sum, largest = sum + value, math.max(largest, math.abs(value))
      end
    end
    t:equal(trace[tick][3][1], trace[tick][3][3]) -- a clock has none
  end
  t:ok(largest <= 0.2 and largest > 0.19, largest)
  -- five standard deviations of a mean of 1200
  t:ok(math.abs(sum / 1200) < 5 * 0.2 / math.sqrt(3 * 1200), sum / 1200)
  t:same_bits(noisy(1), trace)
  t:ok(noisy(2)[1][1][1] ~= trace[1][1][1])
end)

-- ---- robots and bits ----------------------------------------------------------------------------

-- Simulates robots of 5 x 5 x 5 voxels with these genes of control each.
local function begun(genes, signal, options, device)
  local materials = engine.materials "paper"
  local bred = bodies.population(materials, { 5, 5, 5 }, #genes)
  local population = engine.population { lattice = { 5, 5, 5 }, count = #genes, encoding = engine
    .encoding { network = "none", genes = 1, control_genes = #genes[1], lattice = { 5, 5, 5 } } }
  for i = 1, #genes do
    population:set_body(i, bred:voxels(i), nil, materials)
    for k, gene in ipairs(genes[i]) do population:control_view(i)[k] = gene end
  end
  population:check(materials)
  local scene = limax.scenes.land { control = { rate = 100, noise = 0.1, delay = 0.03,
    signal = signal } }
  scene.actuation = nil
  return engine.simulation(population, materials, engine.scene(scene),
    evolution.with({ duration = 0.1 }, options), device or engine.device "cpu")
end

local function genes_of(count)
  local all = {}
  for i = 1, count do
    all[i] = {}
    for k = 1, 29 do all[i][k] = math.sin(40 * i + k) end
  end
  return all
end

suite:test("NaN and infinity end their own robot and no other", function(t)
  for _, bad in ipairs { -1, 0 } do
    -- from the third tick on: the root of -1, and 1 / 0
    local function ended(first, count)
      local genes = {}
      for i = 1, count do genes[i] = { i == first and bad or 1 } end
      local simulation = begun(genes, "a = t < 0.02 ? 0.1 : 0.1 / sqrt(g[0]);", {})
      simulation:run()
      return simulation
    end
    local simulation, healthy = ended(2, 3), ended(nil, 3)
    local outcome = simulation:outcome(2)
    t:equal({ outcome.status, outcome.reason }, { "diverged", "control" })
    t:near(outcome.time, 0.02)
    for _, i in ipairs { 1, 3 } do
      t:equal(simulation:outcome(i).status, "done")
      t:same_bits(simulation:state(i):table(), healthy:state(i):table())
    end
  end
end)

suite:test("the same bits with any threads, slices and number of robots", function(t)
  local function ended(isa, threads, slice, precision, count)
    local simulation = begun(genes_of(count or 2), PERCEPTRON, { precision = precision },
      engine.device("cpu", { isa = isa, threads = threads }))
    while not simulation:advance(1, slice).finished do end
    local states = {}
    for i = 1, 2 do states[i] = simulation:state(i):table() end
    return states
  end
  for _, precision in ipairs { "compensated", "double" } do
    local expected = ended(nil, 1, 100000, precision)
    t:same_bits(ended(nil, 3, 7, precision), expected)
    t:same_bits(ended("baseline", 2, 100000, precision), expected)
    t:same_bits(ended(nil, 2, 31, precision, 5), expected)
  end
end)

suite:test("every integrator runs, and the energy balance counts the muscles", function(t)
  for _, integrator in ipairs { "leapfrog", "symplectic_euler", "rk4" } do
    local done = controlled(WALKER, "a = 0.5 * clock_sine - 0.1 * strain_rate;", { rate = 50 },
      { integrator = integrator, time_step = 1e-4, precision = "double", duration = 1,
        record = { ledger = 50, position = 20 } }, { damping = true })
    local balance = done:ledger()
    t:ok(balance.muscles > 1e-3, balance.muscles)
    t:ok(balance.closure < 1e-4, ("%s: %.3g"):format(integrator, balance.closure))
  end
end)

suite:test("a run with a controller resumes, replays, and has trials and islands", function(t)
  local fields = { scene = limax.scenes.land { actuation = false, control = { rate = 50,
    noise = 0.1, signal = PERCEPTRON } }, genome = { control_spread = 1 },
    islands = { count = 2, every = 1, migrants = 1 } }
  evolution.resumes(t, fields)
  fields.trials = { {}, { velocity = { 0.5, 0, 0 } } }
  local history = evolution.finished(fields)
  local robot = history[3].population[1]
  t:equal(limax.robot(robot):replay().fitness, robot.fitness)
end)
