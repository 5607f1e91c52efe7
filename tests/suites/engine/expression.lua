--- expression.lua: the recorded bodies of genomes, on every device. Ranges
--- and statuses are tested in tests/engine/genome/population_test.cpp, pieces in grid_test.cpp.

local limax = require "limax"
local suite = require("limax.test").suite "expression"

local COUNT = 24

-- An expressed population of an encoding.
local function expressed(t, options)
  local robots = limax.engine.population {
    encoding = limax.engine.encoding(options), lattice = options.lattice, count = COUNT }
  robots:initialize()
  robots:express(limax.engine.materials "paper", { device = t.device, require_muscle = true })
  return robots
end

suite:test("bodies and weights are the recorded ones", { devices = "all" },
  function(t)
    local options = { lattice = { 4, 3, 3 }, sigma = 1, seed = 1 }
    local robots = expressed(t, options)
    local bodies, weights = {}, {}
    for i = 1, COUNT do bodies[i] = robots:text(i, ".ecsb"):gsub("\n", "/") end
    for w, name in ipairs { "stiffness", "amplitude", "phase" } do
      weights[name] = robots:weights(1)[w]:table()
    end
    t:golden("bodies-1", { bodies = bodies, weights = weights })
  end)

suite:test("bodies of the other networks are the recorded ones", { devices = "all" }, function(t)
  local found = {}
  for _, network in ipairs { "cppn", "direct" } do
    local robots = expressed(t, { network = network, lattice = { 4, 3, 3 }, seed = 1 })
    local bodies = {}
    for i = 1, 6 do bodies[i] = robots:text(i, ".ecsb"):gsub("\n", "/") end
    found[network] = { bodies = bodies, weights = robots:weights(1)[2]:table() }
  end
  t:golden("networks", found)
end)
