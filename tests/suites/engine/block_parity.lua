--- block_parity.lua: the rigid block on a GPU as on the CPU, on every path, in every precision,
--- with both integrators that have one; and that no slice, neighbour or repetition changes a bit.
--- SI units.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"

local suite = require("limax.test").suite "block parity"

local materials = engine.materials "paper"
local PRECISIONS = { "single", "compensated", "mixed", "double" }
local INTEGRATORS = { "leapfrog", "symplectic_euler" }
local TIME_STEP = 1e-4

-- m, after some hundred steps, of masses and of the block: in double last bits stay the last bits;
-- in fp32 roundings of places of a metre add up, and a mass that touches a step earlier carries
-- them farther; places in a body of four metres are rounded four times as coarsely
local TOLERANCE = { single = 3e-5, compensated = 3e-5, mixed = 3e-5, double = 1e-11 }
local function tolerance_of(precision, lattice)
  return TOLERANCE[precision] * math.max(1, 0.1 * lattice[1])
end

local LAND = { gravity = true, ground = true, friction = true, damping = true, actuation = true }
local function with(block, more)
  local scene = { block = block }
  for _, part in ipairs { LAND, more or {} } do
    for name, value in pairs(part) do scene[name] = value end
  end
  return scene
end
-- all else that may act besides
local EVERYTHING = { drag = { density = 10 }, self_collision = true,
  wind = { velocity = { 1, 0, 0 }, drag = 0.01 },
  planes = { { normal = { -1, 0, 0.3 }, offset = -6 }, { normal = { 0, 1, 0 }, offset = -0.1 } },
  boxes = { from = { 0.2, -1, -1 }, to = { 0.6, 2, 0.01 } } }

-- one lattice for a block of threads, a cluster, and the grid; the last is flat
local CASES = {
  { name = "a body that runs into a block", velocity = { 2, 0.3, 0 }, duration = 0.03,
    scene = function(size)
      return with { position = { size[1] + 0.01, -0.05, 0 }, size = { 0.3, size[2], 0.2 },
        velocity = { 0, 0.5, 0 } }
    end, lattices = { { 3, 2, 2 }, { 5, 5, 5 }, { 10, 9, 8 }, { 40, 15, 1 } } },
  { name = "a block that lands on a body", velocity = { 0, 0, 0 }, duration = 0.03,
    scene = function(size)
      return with { position = { 0.05, 0.05, size[3] + 0.002 }, size = { 0.35, 0.25, 0.1 },
        velocity = { 0.4, 0.1, -1 }, spin = { 0.1, 0.2, 1 }, mass = 3 }
    end, lattices = { { 4, 3, 2 }, { 10, 9, 8 }, { 40, 15, 1 } } },
  { name = "everything at once", velocity = { 2, 0.3, 0.1 }, duration = 0.03,
    scene = function(size)
      return with({ position = { size[1] + 0.02, 0, 0.005 }, size = { 0.2, 0.3, 0.3 } }, EVERYTHING)
    end, lattices = { { 4, 4, 3 }, { 40, 15, 1 } } },
  -- both fly on, so that the robot's own origin follows them
  { name = "a block that is carried far", velocity = { 150, 0, 0 }, duration = 0.04,
    scene = function(size)
      return { gravity = true, damping = true, block = { position = { 0.05, 0.05, size[3] - 1e-3 },
        size = { 0.2, 0.2, 0.2 }, velocity = { 150, 0, 0 }, spin = { 0, 1, 3 } } }
    end, lattices = { { 3, 3, 2 }, { 40, 15, 1 } } },
}

local function begin(case, lattice, count, precision, integrator, device)
  local population = bodies.population(materials, lattice, count, { hollow = true })
  local size = { 0.1 * lattice[1], 0.1 * lattice[2], 0.1 * lattice[3] }
  return engine.simulation(population, materials, engine.scene(case.scene(size)),
    { time_step = TIME_STEP, duration = case.duration, settle = 0.01, precision = precision,
      velocity = case.velocity, integrator = integrator,
      record = { center_of_mass = 100, energy = 100, block = 200 } }, device)
end

-- All that is to be known of a robot's end: numbers in a fixed order, and the reason of its end.
local function ending(simulation, robot)
  local outcome, list = simulation:outcome(robot), {}
  local function add(values)
    for _, value in ipairs(values) do list[#list + 1] = value end
  end
  local block = simulation:block(robot)
  for _, name in ipairs { "position", "orientation", "velocity", "angular_velocity" } do
    add(block[name])
  end
  for _, name in ipairs { "block_start", "block_middle", "block_end", "block_velocity" } do
    add(outcome[name])
  end
  list[#list + 1] = outcome.block_upright
  local places, speeds = simulation:state(robot)
  local path = simulation:trace(robot, "block")
  for _, rows in ipairs { places:table(), speeds:table(), path:table() } do
    for _, row in ipairs(rows) do add(row) end
  end
  return list, outcome.status .. (outcome.reason and ": " .. outcome.reason or "")
end

for _, case in ipairs(CASES) do
  suite:test(case.name .. " moves as on the CPU", { devices = { "cuda" } }, function(t)
    local cpu, worst = engine.device "cpu", 0
    for _, lattice in ipairs(case.lattices) do
      for _, precision in ipairs(PRECISIONS) do
        for _, integrator in ipairs(INTEGRATORS) do
          local got = begin(case, lattice, 2, precision, integrator, t.device)
          local expected = begin(case, lattice, 2, precision, integrator, cpu)
          got:run()
          expected:run()
          local tolerance = tolerance_of(precision, lattice)
          for robot = 1, 2 do
            local a, b = got:block(robot).position, expected:block(robot).position
            local p, q = (got:state(robot)):table(), (expected:state(robot)):table()
            p[#p + 1], q[#q + 1] = a, b
            t:near(p, q, { atol = tolerance })
            for i, place in ipairs(q) do
              for axis = 1, 3 do
                worst = math.max(worst, math.abs(p[i][axis] - place[axis]) / tolerance)
              end
            end
            local path, other = got:trace(robot, "block"), expected:trace(robot, "block")
            t:near(path:table(), other:table(), { atol = 10 * tolerance })
            local mine, its = got:outcome(robot), expected:outcome(robot)
            t:equal(mine.status, its.status)
            for _, name in ipairs { "block_start", "block_middle", "block_end" } do
              t:near(mine[name], its[name], { atol = tolerance })
            end
            t:near(mine.block_velocity, its.block_velocity, { atol = 1e3 * tolerance })
            t:near(mine.block_upright, its.block_upright, { atol = tolerance })
          end
          got:free()
          expected:free()
        end
      end
    end
    t:note(("%.2g of the tolerance is used"):format(worst))
  end)

  suite:test(case.name .. " has the same bits again, in slices and alone", { devices = "all" },
    function(t)
      for _, lattice in ipairs(case.lattices) do
        for _, precision in ipairs { "compensated", "double" } do
          local function run(count, slice)
            local simulation = begin(case, lattice, count, precision, "leapfrog", t.device)
            repeat until simulation:advance(0, slice).finished
            return simulation
          end
          local whole, again, sliced, alone = run(2, 1e6), run(2, 1e6), run(2, 37), run(1, 1e6)
          for robot = 1, 2 do
            local expected, status = ending(whole, robot)
            t:equal(status, "done")
            t:same_bits(ending(again, robot), expected)
            t:same_bits(ending(sliced, robot), expected)
          end
          t:same_bits(ending(alone, 1), (ending(whole, 1)))
        end
      end
    end)
end

suite:test("a block moves and is moved", { devices = "all" }, function(t)
  local case = CASES[1]
  local simulation = begin(case, { 3, 2, 2 }, 1, "compensated", "leapfrog", t.device)
  simulation:run()
  local outcome, path = simulation:outcome(1), simulation:trace(1, "block"):table()
  t:ok(outcome.block_velocity[1] > 0.1, "it was hit")
  t:equal(#path, 7)
  for axis = 1, 3 do
    t:same_bits(path[1][axis], outcome.block_start[axis])
    t:same_bits(path[4][axis], outcome.block_middle[axis])
    t:same_bits(path[7][axis], outcome.block_end[axis])
    t:same_bits(simulation:block(1).position[axis], outcome.block_end[axis])
    t:same_bits(simulation:block(1).velocity[axis], outcome.block_velocity[axis])
  end
end)

suite:test("a block that leaves the limits ends its robot", { devices = "all" }, function(t)
  local case = { velocity = { 0, 0, 0 }, duration = 0.1, scene = function()
    return { gravity = true, block = { position = { 5, 0, 0 }, velocity = { 0, 0, -999.5 } } }
  end }
  local simulation = begin(case, { 2, 2, 2 }, 1, "compensated", "leapfrog", t.device)
  simulation:run()
  local outcome = simulation:outcome(1)
  t:equal(outcome.status, "diverged")
  t:equal(outcome.reason, "speed")
  -- looked for at multiples of 64 steps: 0.5 / (9.81 1e-4) = 509.7
  t:equal(outcome.step, 512)
end)
