--- expression.lua: genomes become bodies: the same bits on every device, in a golden and in any
--- part of a population; what must hold of every body.

local limax = require "limax"
local suite = require("limax.test").suite "expression"

local COUNT = 24

suite:fixture("materials", { shared = true }, function() return limax.engine.materials "paper" end)

local function options(seed, sigma)
  return { lattice = { 4, 3, 3 }, sigma = sigma or 1, seed = seed }
end

-- A population of this seed, expressed; its encoding's options for goldens.
local function expressed(t, seed, sigma, first, count)
  local given = options(seed, sigma)
  local robots = limax.engine.population {
    encoding = limax.engine.encoding(given), lattice = given.lattice, count = COUNT }
  robots:initialize()
  robots:express(t:fixture "materials", { device = t.device, require_muscle = true },
    first, count)
  return robots, given
end

local function letters(robots, i) return (robots:text(i, ".ecsb"):gsub("\n", "/")) end

suite:test("bodies and weights are the recorded ones", { devices = "all", seeds = { 1, 2 } },
  function(t)
    local robots, given = expressed(t, t.seed)
    local bodies, first = {}, {}
    for i = 1, COUNT do bodies[i] = letters(robots, i) end
    for w, name in ipairs { "stiffness", "amplitude", "phase" } do
      first[name] = robots:weights(1)[w]:table()
    end
    t:golden(("bodies-%d"):format(t.seed), { bodies = bodies, weights = first },
      { configuration = given })
  end)

suite:test("every body is one piece, and what it is not says so", { seeds = { 1, 2, 3 } },
  function(t)
    local robots, given = expressed(t, t.seed)
    local nx, ny, nz = unpack(given.lattice)
    local valid = 0
    for i = 1, COUNT do
      local voxels = robots:voxels(i):table()
      local todo, seen, reached, solid, muscles = {}, {}, 0, 0, 0
      for x = 1, nx do
        for y = 1, ny do
          for z = 1, nz do
            local material = voxels[x][y][z]
            if material > 0 then
              solid = solid + 1
              if #todo == 0 and solid == 1 then todo[1] = { x, y, z } end
            end
            if material == 1 or material == 2 then muscles = muscles + 1 end
          end
        end
      end
      while #todo > 0 do
        local x, y, z = unpack(table.remove(todo))
        local key = x + 100 * y + 10000 * z
        local inside = voxels[x] and voxels[x][y] and voxels[x][y][z] and voxels[x][y][z] > 0
        if inside and not seen[key] then
          seen[key], reached = true, reached + 1
          for axis = 1, 3 do
            for way = -1, 1, 2 do
              local place = { x, y, z }
              place[axis] = place[axis] + way
              todo[#todo + 1] = place
            end
          end
        end
      end
      local body = robots:body(i)
      t:equal({ body.voxels, reached }, { solid, solid })
      t:equal(body.status, solid == 0 and "no voxel" or muscles == 0 and "no muscle" or "valid")
      if body.status == "valid" then valid = valid + 1 end
    end
    t:ok(valid >= COUNT / 2, valid)
  end)

suite:test("a part of a population is expressed as the whole is", { devices = "all" },
  function(t)
    local whole, parts = expressed(t, 1), expressed(t, 1, 1, 1, 10)
    parts:express(t:fixture "materials", { device = t.device, require_muscle = true }, 11,
      COUNT - 10)
    for i = 1, COUNT do
      t:equal(letters(parts, i), letters(whole, i))
      t:same_bits(parts:weights(i):table(), whole:weights(i):table())
    end
  end)

suite:test("a smoother encoding gives bodies of larger pieces", function(t)
  -- neighbours of unlike material, per voxel
  local function edges(seed, sigma)
    local robots, given = expressed(t, seed, sigma)
    local nx, sum = given.lattice[1], 0
    for i = 1, COUNT do
      local voxels = robots:voxels(i):table()
      for x = 1, nx - 1 do
        for y = 1, given.lattice[2] do
          for z = 1, given.lattice[3] do
            sum = sum + (voxels[x][y][z] ~= voxels[x + 1][y][z] and 1 or 0)
          end
        end
      end
    end
    return sum / COUNT
  end
  t:statistically(function(seed) return edges(seed, 4) - edges(seed, 0.25) end,
    { seeds = 8, at_least = 1 })
  -- the statistic only says that nothing speaks against it
  t:ok(edges(1, 4) > edges(1, 0.25))
end)

return suite
