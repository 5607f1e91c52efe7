--- expression.lua: bodies of genomes: recorded ones on every device, and what holds for all. Ranges
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

suite:test("bodies and weights are the recorded ones", { devices = "all", seeds = { 1, 2 } },
  function(t)
    local options = { lattice = { 4, 3, 3 }, sigma = 1, seed = t.seed }
    local robots = expressed(t, options)
    local bodies, weights = {}, {}
    for i = 1, COUNT do bodies[i] = robots:text(i, ".ecsb"):gsub("\n", "/") end
    for w, name in ipairs { "stiffness", "amplitude", "phase" } do
      weights[name] = robots:weights(1)[w]:table()
    end
    t:golden(("bodies-%d"):format(t.seed), { bodies = bodies, weights = weights },
      { configuration = options })
  end)

suite:test("a smoother encoding gives bodies of larger pieces", function(t)
  -- neighbours of different material along x, per body
  local function edges(seed, sigma)
    local nx, ny, nz = 4, 3, 3
    local robots = expressed(t, { lattice = { nx, ny, nz }, sigma = sigma, seed = seed })
    local sum = 0
    for i = 1, COUNT do
      local voxels = robots:voxels(i):table()
      for x = 1, nx - 1 do
        for y = 1, ny do
          for z = 1, nz do
            sum = sum + (voxels[x][y][z] ~= voxels[x + 1][y][z] and 1 or 0)
          end
        end
      end
    end
    return sum / COUNT
  end
  t:statistically(function(seed) return edges(seed, 4) - edges(seed, 0.25) end,
    { seeds = 8, at_least = 1 })
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

suite:test("the engine breeds numbers of a script", { devices = "all" }, function(t)
  local encoding = limax.engine.encoding { lattice = { 2, 2, 2 }, network = "none", genes = 9 }
  local parents = limax.engine.population { encoding = encoding, count = COUNT }
  local children = limax.engine.population { encoding = encoding, count = COUNT }
  parents:initialize()
  t:raises('genomes of network "none" are expressed by the script',
    function() parents:express(limax.engine.materials "paper", { device = t.device }) end)
  local rates = { mutation_rate = 0.5, mutation_scale = 0.1, crossover_rate = 0.4, seed = 1,
    repetition = 1, generation = 1 }
  local all, half = {}, {}
  for i = 1, COUNT do all[i] = { i, 1 } end
  for i = 1, COUNT / 2 do half[i] = all[COUNT / 2 + i] end
  children:breed(parents, all, rates, t.device)
  local whole = children:genomes_bytes()
  children:initialize(COUNT / 2 + 1, nil, 5)
  t:ok(children:genomes_bytes() ~= whole)
  -- half of the children, by the numbers that they had as part of all
  children:breed(parents, half, rates, t.device, COUNT / 2 + 1)
  t:equal(children:genomes_bytes(), whole)
  local copy = limax.engine.population { encoding = encoding, count = COUNT }
  copy:set_genomes(children:genomes_array())
  t:equal(copy:genomes_bytes(), whole)
end)

return suite
