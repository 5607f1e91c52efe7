--- expression.lua: bodies of genomes: recorded ones on every device, and what holds for all. Ranges
--- and statuses are tested in tests/engine/genome/population_test.cpp.

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

suite:test("every body is one piece", { seeds = { 1, 2 } }, function(t)
  local robots = expressed(t, t.seed)
  local valid = 0
  for i = 1, COUNT do
    local voxels, solid, reached, todo = robots:voxels(i):table(), 0, 0, {}
    for x, plane in ipairs(voxels) do
      for y, row in ipairs(plane) do
        for z, material in ipairs(row) do
          if material > 0 then
            solid = solid + 1
            todo[1] = { x, y, z }
          end
        end
      end
    end
    while #todo > 0 do
      local x, y, z = unpack(table.remove(todo))
      if ((voxels[x] or {})[y] or {})[z] and voxels[x][y][z] > 0 then
        voxels[x][y][z], reached = 0, reached + 1
        for _, way in ipairs { -1, 1 } do
          for _, next_to in ipairs { { x + way, y, z }, { x, y + way, z }, { x, y, z + way } } do
            todo[#todo + 1] = next_to
          end
        end
      end
    end
    t:equal({ robots:body(i).voxels, reached }, { solid, solid })
    valid = valid + (robots:body(i).status == "valid" and 1 or 0)
  end
  t:ok(valid >= COUNT / 2, valid)
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
