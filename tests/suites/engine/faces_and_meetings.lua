--- faces_and_meetings.lua: effects between masses that no spring joins, on a GPU as on the CPU:
--- what presses on exposed faces, and parts of a body that meet. SI units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"

local suite = require("limax.test").suite "faces and meetings"

local materials = engine.materials "paper"
local PRECISIONS = { "single", "compensated", "mixed", "double" }
local INTEGRATORS = { "leapfrog", "symplectic_euler" }
local TIME_STEP = 1e-4

-- m, after some hundred steps: in double last bits stay the last bits, in fp32 roundings of places
-- of a metre add up; a mass that meets another a step earlier carries them farther
local TOLERANCE = { single = 3e-5, compensated = 3e-5, mixed = 3e-5, double = 1e-12 }

local WATER = { damping = true, actuation = { frequency = 5 },
  gravity = { acceleration = { 0, 0, -0.5 } },
  drag = { density = 200, current = { 0.5, -0.3, 0.1 } } }
local PARTS = { damping = true, self_collision = true }
-- every hook at once
local EVERYTHING = { gravity = true, ground = true, friction = true, damping = true,
  actuation = true, drag = { density = 10 }, self_collision = true,
  wind = { velocity = { 1, 0, 0 }, drag = 0.01 } }

-- One body of soft tissue: `is_there(x, y, z)`, each from 0.
local function body(lattice, is_there)
  local population = engine.population { lattice = lattice, count = 1 }
  local voxels, weights = {}, {}
  for z = 0, lattice[3] - 1 do
    for y = 0, lattice[2] - 1 do
      for x = 0, lattice[1] - 1 do
        voxels[#voxels + 1] = is_there(x, y, z) and 3 or 0
        weights[#weights + 1] = 1
      end
    end
  end
  population:set_body(1, voxels, { stiffness = weights, amplitude = weights, phase = weights })
  population:check(materials, { require_muscle = false })
  return population
end

-- Two legs on one foot, two voxels apart.
local function hairpin()
  return body({ 4, 1, 5 }, function(x, _, z) return z == 0 or x == 0 or x == 3 end)
end
local function sheet() return body({ 6, 5, 1 }, function() return true end) end

-- The legs thrown at each other, at 3 m/s.
local function clap(simulation)
  local places, speeds = simulation:state(1)
  places, speeds = places:table(), speeds:table()
  for i, place in ipairs(places) do
    if place[3] > 0.15 then speeds[i][1] = place[1] < 0.2 and 3 or -3 end
  end
  simulation:place(1, nil, speeds)
end
-- Everything within a few edges: far more partners than a list has room for.
local function crumple(simulation)
  local places = (simulation:state(1)):table()
  for i, place in ipairs(places) do
    -- each a little elsewhere, so that no two masses coincide
    places[i] = { 0.3 * place[1] + 1e-3 * (i % 7), 0.3 * place[2] + 1e-3 * (i % 5),
      place[3] + 1e-3 * (i % 11) }
  end
  simulation:place(1, places)
end
local function throw(simulation)
  for robot = 1, simulation.count do
    local speeds = (select(2, simulation:state(robot))):table()
    for i = 1, #speeds do speeds[i] = { 1.5, -0.5, 0.3 } end
    simulation:place(robot, nil, speeds)
  end
end

local CASES = {
  { name = "a swimming body", scene = WATER, begin = throw, duration = 0.05, lattices =
    { { 1, 1, 1 }, { 4, 3, 2 }, { 5, 5, 5 }, { 12, 3, 9 } } },
  { name = "legs that clap", scene = PARTS, begin = clap, duration = 0.08, make = hairpin },
  { name = "a crumpled sheet", scene = PARTS, begin = crumple, duration = 0.01, make = sheet },
  { name = "everything at once", scene = EVERYTHING, begin = throw, duration = 0.05,
    lattices = { { 5, 5, 5 }, { 10, 10, 3 } } },
}

local function populations(case)
  if case.make then return { case.make() } end
  local list = {}
  for k, lattice in ipairs(case.lattices) do
    list[k] = bodies.population(materials, lattice, 3, { hollow = true })
  end
  return list
end

local function begin(case, population, precision, integrator, device)
  local simulation = engine.simulation(population, materials, engine.scene(case.scene),
    { time_step = TIME_STEP, duration = case.duration, settle = 0.01, precision = precision,
      integrator = integrator, record = { center_of_mass = 100, energy = 100 } }, device)
  case.begin(simulation)
  return simulation
end

local function last_state(simulation, robot)
  local outcome = simulation:outcome(robot)
  if outcome.status ~= "done" then return outcome.reason end
  local places, speeds = simulation:state(robot)
  return { places:table(), speeds:table() }
end

local function check_energies(t, got, expected, precision)
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

for _, case in ipairs(CASES) do
  suite:test(case.name .. " moves as on the CPU", { devices = { "cuda" } }, function(t)
    local cpu, worst = engine.device "cpu", 0
    for _, population in ipairs(populations(case)) do
      for _, precision in ipairs(PRECISIONS) do
        for _, integrator in ipairs(INTEGRATORS) do
          local got = begin(case, population, precision, integrator, t.device)
          local expected = begin(case, population, precision, integrator, cpu)
          got:run()
          expected:run()
          for robot = 1, population.count do
            local a, b = last_state(got, robot), last_state(expected, robot)
            t:equal(type(a), type(b))
            if type(b) == "table" then
              t:near(a[1], b[1], { atol = TOLERANCE[precision] })
              for i, place in ipairs(b[1]) do
                for axis = 1, 3 do
                  worst = math.max(worst,
                    math.abs(a[1][i][axis] - place[axis]) / TOLERANCE[precision])
                end
              end
              check_energies(t, got:trace(robot, "energy"):table(),
                expected:trace(robot, "energy"):table(), precision)
            end
          end
          got:free()
          expected:free()
        end
      end
    end
    t:note(("%.2g of the tolerance is used"):format(worst))
  end)

  suite:test(case.name .. " has the same bits in slices", { devices = "all" }, function(t)
    for _, population in ipairs(populations(case)) do
      for _, precision in ipairs { "compensated", "double" } do
        local whole = begin(case, population, precision, "leapfrog", t.device)
        local sliced = begin(case, population, precision, "leapfrog", t.device)
        whole:run()
        repeat until sliced:advance(0, 37).finished
        for robot = 1, population.count do
          t:same_bits(last_state(sliced, robot), last_state(whole, robot))
        end
      end
    end
  end)
end

suite:test("parts meet, and the swimming body is slowed", { devices = "all" }, function(t)
  -- without the effect the last state is another
  for _, case in ipairs(CASES) do
    local lone = {}
    for name, value in pairs(case.scene) do
      if name ~= "drag" and name ~= "self_collision" then lone[name] = value end
    end
    local population = populations(case)[1]
    local with = begin(case, population, "double", "leapfrog", t.device)
    local without = begin({ scene = lone, begin = case.begin, duration = case.duration },
      population, "double", "leapfrog", t.device)
    with:run()
    without:run()
    local a, b = last_state(with, 1), last_state(without, 1)
    local apart = 0
    for i, place in ipairs(b[1]) do apart = math.max(apart, math.abs(place[1] - a[1][i][1])) end
    t:ok(apart > 1e-4, ("%s: %.3g m apart"):format(case.name, apart))
  end
end)

return suite
