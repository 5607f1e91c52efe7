--- devices.lua: a GPU computes what the CPU computes: close by on the way, in the same statistics
--- at the end, and always the same bits on the same machine, however a population is cut.

local agreement = require "limax.tools.bench.agreement"
local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"

local suite = require("limax.test").suite "devices"

local materials = engine.materials "paper"

-- ---- close to the CPU ---------------------------------------------------------------------------

local SCENES = {
  all = bodies.ALL,
  undamped = { gravity = true, ground = true, friction = true, actuation = true },
  muscles = { actuation = true, damping = true },
  air = { gravity = true },
  free = {},
}
local SCENE_NAMES = { "all", "undamped", "muscles", "air", "free" }
local PRECISIONS = { "single", "compensated", "mixed", "double" }
local INTEGRATORS = { "leapfrog", "symplectic_euler" }
-- from one voxel to some that need more than a block of threads
local LATTICES = {
  { 1, 1, 1 }, { 3, 3, 3 }, { 4, 3, 2 }, { 5, 5, 5 }, { 6, 6, 6 }, { 10, 2, 3 }, { 8, 8, 8 },
  { 10, 10, 10 },
}

-- Of energies, against the largest of each kind, and what is left of it where nothing moves. They
-- follow from places over a spring's stretch, some 1e-4 of its length: in fp32 they have three or
-- four digits less than the places.
local function energy_tolerance_of(precision)
  if precision == "double" then return 1e-9, 1e-12 end
  return 0.05, 1e-4
end

local function near_energies(t, got, expected, precision)
  local relative, least = energy_tolerance_of(precision)
  for column = 1, 4 do
    local largest, a, b = 0, {}, {}
    for sample, row in ipairs(expected) do
      a[sample], b[sample] = got[sample][column], row[column]
      largest = math.max(largest, math.abs(row[column]))
    end
    t:near(a, b, { atol = relative * largest + least })
  end
end

local function run(population, scene, options, device)
  local simulation = engine.simulation(population, materials, engine.scene(scene), options, device)
  simulation:run()
  return simulation
end

-- Holds one robot of two simulations against each other.
local function near(t, got, expected, robot, how)
  local a, b = got:outcome(robot), expected:outcome(robot)
  for _, name in ipairs { "status", "step", "steps", "masses", "springs", "coarse" } do
    t:equal(a[name], b[name])
  end
  t:equal(a.reason, b.reason)
  for _, name in ipairs { "time_step", "time_step_bound", "mass" } do
    t:same_bits(a[name], b[name])
  end
  if a.status ~= "done" then return end
  local near_by = agreement.tolerance(how.precision, SCENES[how.scene])
  local places = { atol = near_by }
  for _, name in ipairs { "center_start", "center_middle", "center_end" } do
    t:near(a[name], b[name], places)
  end
  t:equal(got:sites(robot):table(), expected:sites(robot):table())
  t:near((got:state(robot)):table(), (expected:state(robot)):table(), places)
  for kind in pairs(got.record) do
    local of_got, of_expected = got:trace(robot, kind):table(), expected:trace(robot, kind):table()
    t:equal(#of_got, #of_expected)
    if kind == "center_of_mass" or kind == "position" then
      t:near(of_got, of_expected, places)
    elseif kind == "strain" then
      -- two places over a length of 0.1 m
      t:near(of_got, of_expected, { atol = 20 * near_by })
    elseif kind == "energy" then
      near_energies(t, of_got, of_expected, how.precision)
    end
  end
  -- a mass at the ground's height touches or not by its last bit: two of a hundred may differ
  if a.contact then t:near(a.contact, b.contact, { atol = 0.02 }) end
end

-- Holds one combination against the CPU.
local function agrees(t, population, cpu, how)
  local scene = SCENES[how.scene]
  local options = { integrator = how.integrator, precision = how.precision,
    time_step = agreement.TIME_STEP, duration = agreement.DURATION, settle = agreement.SETTLE,
    record = { center_of_mass = 100, position = 50, velocity = 50, energy = 100, strain = 100,
      contact = scene.ground and 100 } }
  local got = run(population, scene, options, t.device)
  local expected = run(population, scene, options, cpu)
  for robot = 1, population.count do
    near(t, got, expected, robot, how)
  end
  got:free()
  expected:free()
end

-- Calls `each` for combinations in which every two of lattice, precision and scene meet that the
-- numbers allow, both integrators among them; or for all.
local function combinations(l, all, each)
  for p, precision in ipairs(PRECISIONS) do
    for s, scene in ipairs(SCENE_NAMES) do
      for i, integrator in ipairs(INTEGRATORS) do
        local chosen = (l + p) % #SCENE_NAMES + 1 == s and (l + s) % #INTEGRATORS + 1 == i
        if all or chosen then
          each { precision = precision, scene = scene, integrator = integrator }
        end
      end
    end
  end
end

for l, lattice in ipairs(LATTICES) do
  local size = ("%dx%dx%d"):format(unpack(lattice))
  for _, all in ipairs { false, true } do
    local name = "places agree with the CPU: " .. size .. (all and ", every combination" or "")
    suite:test(name, { devices = { "cuda" }, tags = all and { "full" } or {} }, function(t)
      local cpu = engine.device "cpu"
      local population = bodies.population(materials, lattice, 8, { hollow = true })
      local count = 0
      combinations(l, all, function(how)
        local fine, value = pcall(agrees, t, population, cpu, how)
        if not fine then
          if type(value) ~= "string" then
            value.text = ("%s %s %s: %s"):format(how.precision, how.scene, how.integrator,
              value.text)
          end
          error(value, 0)
        end
        count = count + 1
      end)
      t:ok(count >= #PRECISIONS)
      t:note(("%d combinations of precision, scene and integrator"):format(count))
    end)
  end
end

suite:test("genomes bred and bodies expressed have the CPU's bits", { devices = { "cuda" } },
  function(t)
    local encoding = engine.encoding { lattice = { 5, 5, 5 }, materials = materials.count, seed = 3,
      repetition = 1, features = 16, sigma = 1, hidden = { 32, 32 }, initial_scale = 1 }
    local function generations(device)
      local first = engine.population { lattice = { 5, 5, 5 }, count = 200, encoding = encoding }
      first:initialize()
      first:express(materials, { device = device })
      local second = engine.population { lattice = { 5, 5, 5 }, count = 200, encoding = encoding }
      local parents = {}
      for child = 1, 200 do parents[child] = { child, 1 + (child * 7) % 200 } end
      second:breed(first, parents, { mutation_rate = 0.2, mutation_scale = 0.1,
        crossover_rate = 0.4, seed = 3, repetition = 1, generation = 1, elites = 5 }, device)
      second:express(materials, { device = device })
      return first, second
    end
    local cpu = { generations(engine.device "cpu") }
    local cuda = { generations(t.device) }
    for k = 1, 2 do
      t:ok(cuda[k]:genomes_bytes() == cpu[k]:genomes_bytes(), "genomes differ")
      for robot = 1, 200 do
        t:equal(cuda[k]:body(robot), cpu[k]:body(robot))
        t:same_bits(cuda[k]:voxels(robot):table(), cpu[k]:voxels(robot):table())
        t:same_bits(cuda[k]:weights(robot):table(), cpu[k]:weights(robot):table())
      end
    end
  end)

suite:test("256 bodies walk as far in the mean as on the CPU",
  { devices = { "cuda" }, tags = "full" }, function(t)
    local encoding = engine.encoding { lattice = { 5, 5, 5 }, materials = materials.count,
      seed = 11, repetition = 1, features = 16, sigma = 0.25, hidden = { 32, 32 },
      initial_scale = 1 }
    local population =
      engine.population { lattice = { 5, 5, 5 }, count = 256, encoding = encoding }
    population:initialize()
    population:express(materials, { require_muscle = true })
    local options = { duration = 5, settle = 0.5 }
    local got = run(population, bodies.ALL, options, t.device)
    local expected = run(population, bodies.ALL, options, engine.device "cpu")
    local function distance(simulation, robot)
      local outcome = simulation:outcome(robot)
      if outcome.status ~= "done" then return nil end
      local from, to = outcome.center_start, outcome.center_end
      return math.sqrt((to[1] - from[1]) ^ 2 + (to[2] - from[2]) ^ 2)
    end
    local count, sum, squares = 0, 0, 0
    for robot = 1, population.count do
      local a, b = distance(got, robot), distance(expected, robot)
      if a and b then
        count, sum, squares = count + 1, sum + (a - b), squares + (a - b) ^ 2
      end
    end
    t:ok(count >= 100, ("only %d bodies walked on both"):format(count))
    local mean = sum / count
    local error_of_mean = math.sqrt((squares / count - mean ^ 2) / (count - 1))
    t:note(("%d bodies: mean difference %.3g m, its standard error %.3g m"):format(count, mean,
      error_of_mean))
    t:ok(math.abs(mean) <= 3 * error_of_mean, "the mean differs")
  end)

-- ---- always the same bits -----------------------------------------------------------------------

local RECORD = { center_of_mass = 100, energy = 50, position = 50, contact = 50 }

-- Everything that a robot's simulation left, as plain tables.
local function leavings(simulation, robot)
  local positions, velocities = simulation:state(robot)
  local left = { outcome = simulation:outcome(robot), positions = positions:table(),
    velocities = velocities:table(), traces = {} }
  for kind in pairs(simulation.record) do
    left.traces[kind] = simulation:trace(robot, kind):table()
  end
  return left
end

local function begin(population, precision, device, mask)
  return engine.simulation(population, materials, engine.scene(bodies.ALL), { time_step = 1e-4,
    duration = 0.1, settle = 0.02, precision = precision, record = RECORD }, device, mask)
end

for _, lattice in ipairs { { 5, 5, 5 }, { 8, 8, 8 } } do
  local size = ("%dx%dx%d"):format(unpack(lattice))
  suite:test("run twice, in slices and as a whole: " .. size, { devices = "all" }, function(t)
    local population = bodies.population(materials, lattice, 6, { hollow = true })
    for _, precision in ipairs(PRECISIONS) do
      local whole = begin(population, precision, t.device)
      whole:run()
      local again = begin(population, precision, t.device)
      again:run()
      local sliced = begin(population, precision, t.device)
      repeat until sliced:advance(0, 37).finished
      -- what is read on the way changes nothing
      local read = begin(population, precision, t.device)
      repeat
        local progress = read:advance(0, 501)
        for robot = 1, population.count do read:state(robot) end
      until progress.finished
      for robot = 1, population.count do
        local expected = leavings(whole, robot)
        for _, other in ipairs { again, sliced, read } do
          t:same_bits(leavings(other, robot), expected)
        end
      end
    end
  end)

  suite:test("alone and in a large population: " .. size, { devices = "all" }, function(t)
    -- more than a GPU holds at once
    local count = t.device.kind == "cpu" and 16 or lattice[1] == 5 and 4096 or 600
    local population = bodies.population(materials, lattice, count)
    local many = begin(population, "compensated", t.device)
    many:run()
    for _, robot in ipairs { 1, count / 2 + 1, count } do
      local alone = bodies.population(materials, lattice, 1, { first = robot })
      local one = begin(alone, "compensated", t.device)
      one:run()
      t:same_bits(leavings(many, robot), leavings(one, 1))
      -- and among others that are left out
      local mask = {}
      for i = 1, count do mask[i] = i == robot end
      local chosen = begin(population, "compensated", t.device, mask)
      chosen:run()
      t:same_bits(leavings(chosen, robot), leavings(one, 1))
    end
  end)

  suite:test("a robot that diverges disturbs nobody: " .. size, { devices = "all" }, function(t)
    local population = bodies.population(materials, lattice, 5)
    local calm = begin(population, "compensated", t.device)
    calm:run()
    local shaken = begin(population, "compensated", t.device)
    local places, speeds = shaken:state(3), (select(2, shaken:state(2))):table()
    places = places:table()
    -- every spring of robot 3 twenty times as long, robot 2 faster than is allowed
    for _, place in ipairs(places) do
      for axis = 1, 3 do place[axis] = 20 * place[axis] end
    end
    for _, speed in ipairs(speeds) do speed[3] = 2000 end
    shaken:place(3, places)
    shaken:place(2, nil, speeds)
    shaken:run()
    local stretched, fast = shaken:outcome(3), shaken:outcome(2)
    t:equal({ stretched.status, stretched.reason }, { "diverged", "stretch" })
    t:equal({ fast.status, fast.reason }, { "diverged", "speed" })
    for _, robot in ipairs { 1, 4, 5 } do
      t:equal(shaken:outcome(robot).status, "done")
      t:same_bits(leavings(shaken, robot), leavings(calm, robot))
    end
  end)

  suite:test("a robot that moves too far in a step is marked: " .. size, { devices = "all" },
    function(t)
      local population = bodies.population(materials, lattice, 3)
      for _, precision in ipairs(PRECISIONS) do
        local thrown = begin(population, precision, t.device)
        -- a tenth of an edge in a step of 0.1 ms is 100 m/s
        for robot, speed in ipairs { 0, 80, 120 } do
          local speeds = (select(2, thrown:state(robot))):table()
          for _, velocity in ipairs(speeds) do velocity[3] = speed end
          thrown:place(robot, nil, speeds)
        end
        thrown:run()
        for robot, coarse in ipairs { false, false, true } do
          local outcome = thrown:outcome(robot)
          t:equal({ outcome.status, outcome.coarse }, { "done", coarse })
        end
      end
    end)
end

suite:test("simulations that advance together keep their bits", { devices = "all" }, function(t)
  local list, alone = {}, {}
  for k = 1, 3 do
    local population = bodies.population(materials, { 4, 4, 4 }, 4, { first = 10 * k })
    list[k] = begin(population, "compensated", t.device)
    alone[k] = begin(population, "compensated", t.device)
    alone[k]:run()
  end
  local finished
  repeat
    finished = true
    for _, progress in ipairs(engine.advance_together(list, 0.02)) do
      finished = finished and progress.finished
    end
  until finished
  for k = 1, 3 do
    for robot = 1, 4 do t:same_bits(leavings(list[k], robot), leavings(alone[k], robot)) end
  end
end)

return suite
