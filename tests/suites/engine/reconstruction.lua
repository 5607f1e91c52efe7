--- reconstruction.lua: the reconstruction of the scheme that the paper sketches, as scripts reach
--- it: it ends where a simulation ends, and says what it cannot do.

local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local fixture = require "support.binding.fixture"

local suite = require("limax.test").suite "reconstruction"

local materials = engine.materials "paper"
local STEPS = 1000
local OPTIONS = {
  integrator = "symplectic_euler", precision = "single", time_step = 1e-4, duration = 0.1,
}

suite:test("ends where a simulation on the CPU ends", { devices = { "cuda" } }, function(t)
  local population = bodies.population(materials, { 4, 3, 2 }, 5, { hollow = true })
  local scene = engine.scene(fixture.ALL)
  local seconds, centers =
    engine.reconstruction(population, materials, scene, OPTIONS, STEPS, t.device)
  t:ok(seconds > 0 and seconds < 10, seconds)
  t:equal(#centers, 5)
  local simulation = engine.simulation(population, materials, scene, OPTIONS, engine.device "cpu")
  simulation:run()
  for robot = 1, 5 do
    local outcome = simulation:outcome(robot)
    t:equal(outcome.step, STEPS)
    -- m: both sums in fp32, in another order
    t:near(centers[robot], outcome.center_end, { atol = 2e-5 })
  end
end)

suite:test("misuse is refused at its line", function(t)
  local population = fixture.robots(2)
  local scene, cpu = engine.scene(fixture.ALL), engine.device "cpu"
  local function there(pattern, call) fixture.raises_there(t, pattern, call) end
  there("runs on a GPU alone; this device is 'cpu'",
    function() engine.reconstruction(population, materials, scene, OPTIONS, STEPS, cpu) end)
  there("reconstruction: steps: expected an integer from 1 to 1000000000, got 0",
    function() engine.reconstruction(population, materials, scene, OPTIONS, 0, cpu) end)
  there("reconstruction: population: expected a population, got nil",
    function() engine.reconstruction(nil, materials, scene, OPTIONS, STEPS, cpu) end)
end)

return suite
