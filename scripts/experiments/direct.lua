--- direct.lua: an encoding of one's own. Every voxel has five genes: two choose its material (is it
--- there, and which), three are its weights. Shows the functions of an encoding; the library's
--- "direct" is the same idea in the engine. One repetition; about 20 seconds on two cores.
--- Run it with: limax run scripts/experiments/direct.lua

local limax = require "limax"

local PER_VOXEL = 5

local function squashed(gene) return 1 / (1 + math.exp(-gene)) end -- to 0 ... 1

local encoding = {
  genes = function(shape) return PER_VOXEL * shape.voxels end,

  express = function(robots)
    local kinds = robots.materials.count - 1 -- without the empty material, which is 0
    for _, i in ipairs(robots) do
      local genes, voxels, weights = robots:genes(i), robots:voxels(i), robots:weights(i)
      local stiffness, amplitude, phase = weights[1], weights[2], weights[3]
      for v = 1, #voxels do
        local g = PER_VOXEL * (v - 1)
        local there = genes[g + 1] > -0.5
        voxels[v] = there and math.min(kinds, 1 + math.floor(kinds * squashed(genes[g + 2]))) or 0
        stiffness[v], amplitude[v] = squashed(genes[g + 3]), squashed(genes[g + 4])
        phase[v] = squashed(genes[g + 5])
      end
    end
  end,

  -- a box of voxels comes from the second parent, so that neighbours stay together
  cross = function(robots)
    local n = robots.lattice
    for _, i in ipairs(robots) do
      local genes, random, _, second = robots:genes(i), robots:random(i), robots:parents(i)
      local least, most = {}, {}
      for axis = 1, 3 do
        local a, b = random:integer(n[axis]), random:integer(n[axis])
        least[axis], most[axis] = math.min(a, b) - 1, math.max(a, b) - 1
      end
      for z = least[3], most[3] do
        for y = least[2], most[2] do
          for x = least[1], most[1] do
            local g = PER_VOXEL * (x + n[1] * (y + n[2] * z))
            for k = 1, PER_VOXEL do genes[g + k] = second[g + k] end
          end
        end
      end
    end
  end,
}

return limax.experiment {
  name = "direct",
  genome = { encoding = encoding }, -- mutation: the engine's, each gene by itself
  scene = { gravity = true, ground = true, friction = true, damping = true,
    actuation = { frequency = 2 } },
  simulation = { duration = 5, settle = 0.5 },
  population = 30, generations = 20, repetitions = 1,
  fitness = "walk",
}
