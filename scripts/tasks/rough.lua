--- rough.lua: a task: walk over uneven land, which every generation draws anew.

local limax = require "limax"

local function terrain(seed)
  return limax.scenes.rough { seed = seed, roughness = 0.1, spacing = 0.25, size = 12 }.terrain
end

return limax.task {
  name = "rough", version = 1,
  about = {
    measured = "The distance along x, m, mean of three worlds.",
    passive = "-0.01 m measured: it slides off heights.",
    fixed = "a gait that happens to climb what is in its way.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { ground = false, terrain = terrain(1),
    actuation = { frequency = 3 } }, -- Hz
  trials = function(_, random)
    local list = {}
    for k = 1, 3 do list[k] = { effects = { terrain = terrain(random:integer(1e9)) } } end
    return list
  end,
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 100, generations = 45, repetitions = 1,
  fitness = { "distance", axis = "x" },
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
