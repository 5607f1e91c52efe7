--- same_bits.lua: on one machine a simulation always gives the same bits, however a population is
--- divided, on the CPU and on GPUs. SI units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local device_cases = require "support.device_cases"
local evolution = require "support.evolution"

local suite = require("limax.test").suite "same bits"

local materials = engine.materials "paper"
local begin, hollow = device_cases.begin, device_cases.hollow
local ALL = bodies.ALL

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

for _, case in ipairs(device_cases.list) do
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

for _, edge in ipairs { 5, 8, 10 } do
  local lattice = { edge, edge, edge }
  -- the CPU has one kernel
  local devices = edge == 5 and "all" or "cuda"
  local function named(text) return ("%s: %dx%dx%d"):format(text, edge, edge, edge) end

  suite:test(named "again and in slices", { devices = devices, precisions = "all" }, function(t)
    check_slices(t, WALK, hollow(lattice), t.precision)
  end)

  suite:test(named "singly and in a large population", { devices = devices }, function(t)
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
end

suite:test("a body too large for a cache: steps together and one by one", { devices = "cpu",
  integrators = { "leapfrog", "symplectic_euler" } }, function(t)
  local scene = evolution.with(ALL, { moving_spheres = { center = { 1, 1, -0.2 }, radius = 0.3,
    velocity = { 0, 0, 2 }, turns = 0.005 } })
  local population = bodies.population(materials, { 20, 20, 160 }, 1, { first = 2, hollow = true })
  local function run(slice)
    local simulation = engine.simulation(population, materials, engine.scene(scene), {
      time_step = 1e-4, duration = 0.01, settle = 0.003, velocity = { 1, 0.3, -0.5 },
      integrator = t.integrator, record = { energy = 100 } }, t.device)
    repeat until simulation:advance(0, slice).finished
    return results(simulation, 1)
  end
  t:same_bits(run(1e6), run(1))
end)

suite:test("simulations that advance together keep their bits", { devices = "all" }, function(t)
  local list, singly = {}, {}
  for k = 1, 3 do
    local population = bodies.population(materials, { 4, 4, 4 }, 4, { first = 10 * k })
    list[k] = begin(WALK, population, {}, t.device)
    singly[k] = begin(WALK, population, {}, t.device)
    singly[k]:run()
  end
  local finished
  repeat
    finished = true
    for _, progress in ipairs(engine.advance_together(list, 0.02)) do
      finished = finished and progress.finished
    end
  until finished
  for k = 1, 3 do
    for robot = 1, 4 do t:same_bits(results(list[k], robot), results(singly[k], robot)) end
  end
end)
