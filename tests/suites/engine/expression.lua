--- expression.lua: bodies of genomes: recorded ones on every device, and what holds for all. Ranges
--- and statuses are tested in tests/engine/genome/population_test.cpp, pieces in grid_test.cpp.

local limax = require "limax"
local suite = require("limax.test").suite "expression"

local COUNT = 24

-- An expressed population of this seed, and its encoding's options.
local function expressed(t, seed, sigma)
  local options = { lattice = { 4, 3, 3 }, sigma = sigma or 1, seed = seed }
  local robots = limax.engine.population {
    encoding = limax.engine.encoding(options), lattice = options.lattice, count = COUNT }
  robots:initialize()
  robots:express(limax.engine.materials "paper", { device = t.device, require_muscle = true })
  return robots, options
end

suite:test("bodies and weights are the recorded ones", { devices = "all", seeds = { 1, 2 } },
  function(t)
    local robots, options = expressed(t, t.seed)
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
    local robots, options = expressed(t, seed, sigma)
    local nx, ny, nz = unpack(options.lattice)
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

return suite
