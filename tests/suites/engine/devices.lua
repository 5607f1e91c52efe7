--- devices.lua: a GPU computes what the CPU computes: the same motion within a tolerance, the same
--- statistics, and on one machine always the same bits, however a population is divided. Without a
--- GPU the CPU is compared with itself. SI units.

local agreement = require "limax.tools.bench.agreement"
local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"

local suite = require("limax.test").suite "devices"

local materials = engine.materials "paper"
local PRECISIONS = { "single", "compensated", "mixed", "double" }
local INTEGRATORS = { "leapfrog", "symplectic_euler" }

-- ---- cases --------------------------------------------------------------------------------------

---@class limax.device_case
---@field name string
---@field scene fun(size: number[]): table of a body of this size, m
---@field lattices integer[][] one for each kind of kernel: a block of threads, a cluster, the grid
---@field options table of the simulation
---@field make nil|fun(lattice: integer[]): limax.population
---@field place nil|fun(simulation: limax.simulation)

local ALL = bodies.ALL

local function with(more)
  local scene = {}
  for _, part in ipairs { ALL, more } do
    for name, value in pairs(part) do scene[name] = value end
  end
  return scene
end

local function hollow(lattice)
  return bodies.population(materials, lattice, 3, { hollow = true })
end

-- One body of soft tissue with voxels where `is_there(x, y, z)`, from 0.
local function shaped(is_there)
  return function(lattice)
    local population, voxels = engine.population { lattice = lattice, count = 1 }, {}
    for z = 0, lattice[3] - 1 do
      for y = 0, lattice[2] - 1 do
        for x = 0, lattice[1] - 1 do voxels[#voxels + 1] = is_there(x, y, z) and 3 or 0 end
      end
    end
    population:set_body(1, voxels)
    population:check(materials, { require_muscle = false })
    return population
  end
end

-- Moves the two legs of a body towards each other, at 3 m/s.
local function clap(simulation)
  local positions, velocities = simulation:state(1)
  positions, velocities = positions:table(), velocities:table()
  for i, p in ipairs(positions) do
    if p[3] > 0.15 then velocities[i][1] = p[1] < 0.2 and 3 or -3 end
  end
  simulation:place(1, nil, velocities)
end

-- Puts everything within a few edges, so that masses have more partners than a list has room for.
local function crumple(simulation)
  local positions = (simulation:state(1)):table()
  for i, p in ipairs(positions) do
    positions[i] = { 0.3 * p[1] + 1e-3 * (i % 7), 0.3 * p[2] + 1e-3 * (i % 5),
      p[3] + 1e-3 * (i % 11) }
  end
  simulation:place(1, positions)
end

local FLAT = { 40, 15, 1 }

---@type limax.device_case[]
local CASES = {
  { name = "a body that hits a block", lattices = { { 3, 2, 2 }, { 5, 5, 5 }, { 10, 9, 8 }, FLAT },
    options = { velocity = { 2, 0.3, 0 }, duration = 0.03 }, scene = function(size)
      return with { block = { position = { size[1] + 0.01, -0.05, 0 },
        size = { 0.3, size[2], 0.2 }, velocity = { 0, 0.5, 0 } } }
    end },
  { name = "a block that lands on a body", lattices = { { 4, 3, 2 }, { 10, 9, 8 }, FLAT },
    options = { duration = 0.03 }, scene = function(size)
      return with { block = { position = { 0.05, 0.05, size[3] + 0.002 },
        size = { 0.35, 0.25, 0.1 }, velocity = { 0.4, 0.1, -1 }, spin = { 0.1, 0.2, 1 },
        mass = 3 } }
    end },
  -- the robot's own origin follows
  { name = "a block that is carried far", lattices = { { 3, 3, 2 }, FLAT },
    options = { velocity = { 150, 0, 0 }, duration = 0.04 }, scene = function(size)
      return { gravity = true, damping = true, block = { position = { 0.05, 0.05, size[3] - 1e-3 },
        size = { 0.2, 0.2, 0.2 }, velocity = { 150, 0, 0 }, spin = { 0, 1, 3 } } }
    end },
  { name = "every effect", lattices = { { 4, 4, 3 }, { 10, 10, 3 }, FLAT },
    options = { velocity = { 2, 0.3, 0.1 }, duration = 0.03 }, scene = function(size)
      return with { drag = { density = 10 }, self_collision = true,
        block = { position = { size[1] + 0.02, 0, 0.005 }, size = { 0.2, 0.3, 0.3 } },
        wind = { velocity = { 1, 0, 0 }, drag = 0.01 },
        planes = { { normal = { -1, 0, 0.3 }, offset = -6 },
          { normal = { 0, 1, 0 }, offset = -0.1 } },
        boxes = { from = { 0.2, -1, -1 }, to = { 0.6, 2, 0.01 } } }
    end },
  { name = "a swimming body", lattices = { { 1, 1, 1 }, { 4, 3, 2 }, { 5, 5, 5 }, { 12, 3, 9 } },
    options = { velocity = { 1.5, -0.5, 0.3 }, duration = 0.05 }, scene = function()
      return { damping = true, actuation = { frequency = 5 },
        gravity = { acceleration = { 0, 0, -0.5 } },
        drag = { density = 200, current = { 0.5, -0.3, 0.1 } } }
    end },
  { name = "legs that clap", lattices = { { 4, 1, 5 } }, options = { duration = 0.08 },
    scene = function() return { damping = true, self_collision = true } end, place = clap,
    make = shaped(function(x, _, z) return z == 0 or x == 0 or x == 3 end) },
  { name = "a crumpled sheet", lattices = { { 6, 5, 1 } }, options = { duration = 0.01 },
    scene = function() return { damping = true, self_collision = true } end, place = crumple,
    make = shaped(function() return true end) },
}

local function begin(case, population, how, device)
  local size = {}
  for axis = 1, 3 do size[axis] = 0.1 * population.lattice[axis] end
  local scene = case.scene(size)
  local options = { time_step = 1e-4, settle = 0.01, precision = how.precision,
    integrator = how.integrator or "leapfrog", record = { center_of_mass = 100, position = 50,
      velocity = 50, energy = 100, strain = 100, contact = scene.ground and 100,
      block = scene.block and 200 } }
  for name, value in pairs(case.options) do options[name] = value end
  local simulation = engine.simulation(population, materials, engine.scene(scene), options, device)
  if case.place then case.place(simulation) end
  return simulation
end

-- ---- close to the CPU ---------------------------------------------------------------------------

-- Energies depend on positions over a stretch of 1e-4 of a length: fp32 loses three digits.
local function near_energies(t, got, expected, precision)
  for column = 1, 4 do
    local largest, a, b = 0, {}, {}
    for sample, row in ipairs(expected) do
      a[sample], b[sample] = got[sample][column], row[column]
      largest = math.max(largest, math.abs(row[column]))
    end
    t:near(a, b, { atol = precision == "double" and 1e-9 * largest + 1e-12
      or 0.05 * largest + 1e-4 })
  end
end

-- Compares one robot of two simulations; `atol` of positions, m.
local function near(t, got, expected, robot, precision, atol)
  local a, b = got:outcome(robot), expected:outcome(robot)
  for _, name in ipairs { "status", "reason", "step", "steps", "masses", "springs", "coarse" } do
    t:equal(a[name], b[name])
  end
  for _, name in ipairs { "time_step", "time_step_bound", "mass" } do
    t:same_bits(a[name], b[name])
  end
  if a.status ~= "done" then return end
  for _, name in ipairs { "center_start", "center_middle", "center_end", "block_start",
    "block_middle", "block_end", "block_upright" } do
    t:near(a[name], b[name], { atol = atol })
  end
  t:near(a.block_velocity, b.block_velocity, { atol = 1e3 * atol })
  t:equal(got:sites(robot):table(), expected:sites(robot):table())
  t:near((got:state(robot)):table(), (expected:state(robot)):table(), { atol = atol })
  local factors = { center_of_mass = 1, position = 1, block = 10,
    strain = not got.record.block and 20 or nil }
  for kind in pairs(got.record) do
    local rows, other = got:trace(robot, kind):table(), expected:trace(robot, kind):table()
    t:equal(#rows, #other)
    if factors[kind] then t:near(rows, other, { atol = factors[kind] * atol }) end
    -- a block amplifies differences of the last bits
    if kind == "energy" and not got.record.block then near_energies(t, rows, other, precision) end
  end
  -- a mass at the ground's height touches or not by its last bit
  if not got.record.block then t:near(a.contact, b.contact, { atol = 0.02 }) end
end

local function agrees(t, case, population, how, atol)
  local got = begin(case, population, how, t.device)
  local expected = begin(case, population, how, engine.device "cpu")
  got:run()
  expected:run()
  for robot = 1, population.count do near(t, got, expected, robot, how.precision, atol) end
  got:free()
  expected:free()
end

for _, case in ipairs(CASES) do
  suite:test(case.name .. " moves as on the CPU", { devices = "cuda", precisions = "all",
    integrators = INTEGRATORS }, function(t)
    for _, lattice in ipairs(case.lattices) do
      -- after some hundred steps; coordinates of a long body are rounded more coarsely
      local atol = (t.precision == "double" and 1e-11 or 3e-5) * math.max(1, 0.1 * lattice[1])
      agrees(t, case, (case.make or hollow)(lattice), t, atol)
    end
  end)
end

local SCENES = {
  { "all", ALL },
  { "undamped", { gravity = true, ground = true, friction = true, actuation = true } },
  { "muscles", { actuation = true, damping = true } }, { "air", { gravity = true } },
  { "free", {} },
}

-- from one voxel to bodies of more than a block of threads
for l, lattice in ipairs { { 1, 1, 1 }, { 3, 3, 3 }, { 4, 3, 2 }, { 5, 5, 5 }, { 6, 6, 6 },
  { 10, 2, 3 }, { 8, 8, 8 }, { 10, 10, 10 } } do
  for _, full in ipairs { false, true } do
    suite:test(("walkers of %dx%dx%d%s move as on the CPU"):format(lattice[1], lattice[2],
      lattice[3], full and " in every combination" or ""),
      { devices = "cuda", tags = full and "full" or nil }, function(t)
      local population = bodies.population(materials, lattice, 8, { hollow = true })
      for p, precision in ipairs(PRECISIONS) do
        for s, scene in ipairs(SCENES) do
          for i, integrator in ipairs(INTEGRATORS) do
            -- every pair of lattice, precision and scene
            if full or (l + p) % #SCENES + 1 == s and (l + s) % #INTEGRATORS + 1 == i then
              agrees(t, { scene = function() return scene[2] end, options = {
                duration = agreement.DURATION, settle = agreement.SETTLE,
                time_step = agreement.TIME_STEP } }, population,
                { precision = precision, integrator = integrator },
                agreement.tolerance(precision, scene[2]))
            end
          end
        end
      end
    end)
  end
end

-- ---- the same statistics and genomes ------------------------------------------------------------

local function genomes(lattice, count, sigma)
  return engine.population { lattice = lattice, count = count, encoding = engine.encoding {
    lattice = lattice, materials = materials.count, seed = 11, repetition = 1, features = 16,
    sigma = sigma, hidden = { 32, 32 }, initial_scale = 1 } }
end

suite:test("bred genomes and expressed bodies have the CPU's bits", { devices = "cuda" },
  function(t)
    local function generations(device)
      local first, second, parents = genomes({ 5, 5, 5 }, 200, 1), genomes({ 5, 5, 5 }, 200, 1), {}
      first:initialize()
      first:express(materials, { device = device })
      for child = 1, 200 do parents[child] = { child, 1 + (child * 7) % 200 } end
      second:breed(first, parents, { mutation_rate = 0.2, mutation_scale = 0.1,
        crossover_rate = 0.4, seed = 3, repetition = 1, generation = 1, elites = 5 }, device)
      second:express(materials, { device = device })
      return { first, second }
    end
    local cpu, cuda = generations(engine.device "cpu"), generations(t.device)
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
  { devices = "cuda", tags = "full" }, function(t)
    local population, distances = genomes({ 5, 5, 5 }, 256, 0.25), {}
    population:initialize()
    population:express(materials, { require_muscle = true })
    for k, device in ipairs { t.device, engine.device "cpu" } do
      local simulation = engine.simulation(population, materials, engine.scene(ALL),
        { duration = 5, settle = 0.5 }, device)
      simulation:run()
      distances[k] = {}
      for robot = 1, population.count do
        local outcome = simulation:outcome(robot)
        if outcome.status == "done" then
          local from, to = outcome.center_start, outcome.center_end
          distances[k][robot] = math.sqrt((to[1] - from[1]) ^ 2 + (to[2] - from[2]) ^ 2)
        end
      end
    end
    local count, sum, squares = 0, 0, 0
    for robot, a in pairs(distances[1]) do
      local b = distances[2][robot]
      if b then count, sum, squares = count + 1, sum + (a - b), squares + (a - b) ^ 2 end
    end
    t:ok(count >= 100, ("only %d bodies walked on both"):format(count))
    local mean = sum / count
    local error_of_mean = math.sqrt((squares / count - mean ^ 2) / (count - 1))
    t:note(("%d bodies: mean difference %.3g m, its standard error %.3g m"):format(count, mean,
      error_of_mean))
    t:ok(math.abs(mean) <= 3 * error_of_mean, "the mean differs")
  end)

-- ---- always the same bits -----------------------------------------------------------------------

-- Everything that a robot's simulation produced.
local function results(simulation, robot)
  local positions, velocities = simulation:state(robot)
  local all = { outcome = simulation:outcome(robot), positions = positions:table(),
    velocities = velocities:table(), traces = {} }
  for kind in pairs(simulation.record) do
    all.traces[kind] = simulation:trace(robot, kind):table()
  end
  return all
end

local WALK = { scene = function() return ALL end, options = { duration = 0.06, settle = 0.02 } }

-- Runs twice, in slices, and with the state read in between.
local function check_slices(t, case, population, precision)
  local function run(slice, read)
    local simulation = begin(case, population, { precision = precision }, t.device)
    repeat
      local progress = simulation:advance(0, slice)
      if read then simulation:state(1) end
    until progress.finished
    return simulation
  end
  local whole = run(1e6)
  for _, other in ipairs { run(1e6), run(37), run(251, true) } do
    for robot = 1, population.count do
      t:same_bits(results(other, robot), results(whole, robot))
    end
  end
end

for _, case in ipairs(CASES) do
  suite:test(case.name .. ": again and in slices", { devices = "all",
    precisions = { "compensated", "double" } }, function(t)
    for i, lattice in ipairs(case.lattices) do
      -- the CPU has one kernel
      if i == 1 or t.device.kind ~= "cpu" then
        check_slices(t, case, (case.make or hollow)(lattice), t.precision)
      end
    end
  end)
end

for _, edge in ipairs { 5, 8 } do
  local lattice = { edge, edge, edge }
  -- the CPU has one kernel
  local devices = edge == 5 and "all" or "cuda"
  local function named(text) return ("%s: %dx%dx%d"):format(text, edge, edge, edge) end

  suite:test(named "again and in slices", { devices = devices, precisions = "all" }, function(t)
    check_slices(t, WALK, hollow(lattice), t.precision)
  end)

  suite:test(named "alone and in a large population", { devices = devices }, function(t)
    -- more than a GPU holds at once
    local count = t.device.kind == "cpu" and 16 or edge == 5 and 4096 or 600
    local function run(population, mask)
      local simulation = engine.simulation(population, materials, engine.scene(ALL),
        { time_step = 1e-4, duration = 0.06, settle = 0.02, record = { energy = 50 } }, t.device,
        mask)
      simulation:run()
      return simulation
    end
    local population = bodies.population(materials, lattice, count)
    local many = run(population)
    for _, robot in ipairs { 1, count / 2 + 1, count } do
      local one = results(run(bodies.population(materials, lattice, 1, { first = robot })), 1)
      t:same_bits(results(many, robot), one)
      local mask = {}
      for i = 1, count do mask[i] = i == robot end
      t:same_bits(results(run(population, mask), robot), one)
    end
  end)

  suite:test(named "a robot that diverges does not affect others", { devices = devices },
    function(t)
      local population = bodies.population(materials, lattice, 5)
      local calm = begin(WALK, population, {}, t.device)
      local shaken = begin(WALK, population, {}, t.device)
      local positions = (shaken:state(3)):table()
      local velocities = (select(2, shaken:state(2))):table()
      for _, p in ipairs(positions) do
        for axis = 1, 3 do p[axis] = 20 * p[axis] end
      end
      for _, v in ipairs(velocities) do v[3] = 2000 end
      shaken:place(3, positions)
      shaken:place(2, nil, velocities)
      calm:run()
      shaken:run()
      for robot, reason in pairs { [2] = "speed", [3] = "stretch" } do
        local outcome = shaken:outcome(robot)
        t:equal({ outcome.status, outcome.reason }, { "diverged", reason })
      end
      for _, robot in ipairs { 1, 4, 5 } do
        t:equal(shaken:outcome(robot).status, "done")
        t:same_bits(results(shaken, robot), results(calm, robot))
      end
    end)

  suite:test(named "a robot that moves too far in a step is coarse", { devices = devices,
    precisions = "all" }, function(t)
    local thrown = begin(WALK, bodies.population(materials, lattice, 3),
      { precision = t.precision }, t.device)
    -- a tenth of an edge in a step of 0.1 ms is 100 m/s
    for robot, speed in ipairs { 0, 80, 120 } do
      local velocities = (select(2, thrown:state(robot))):table()
      for _, v in ipairs(velocities) do v[3] = speed end
      thrown:place(robot, nil, velocities)
    end
    thrown:run()
    for robot, coarse in ipairs { false, false, true } do
      local outcome = thrown:outcome(robot)
      t:equal({ outcome.status, outcome.coarse }, { "done", coarse })
    end
  end)
end

suite:test("simulations that advance together keep their bits", { devices = "all" }, function(t)
  local list, alone = {}, {}
  for k = 1, 3 do
    local population = bodies.population(materials, { 4, 4, 4 }, 4, { first = 10 * k })
    list[k], alone[k] = begin(WALK, population, {}, t.device), begin(WALK, population, {}, t.device)
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
    for robot = 1, 4 do t:same_bits(results(list[k], robot), results(alone[k], robot)) end
  end
end)

return suite
