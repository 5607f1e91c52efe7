--- slippery.lua: a task: walk on, although ice begins at a place that every generation draws anew,
--- on the left in one world and on the right in the other.

local limax = require "limax"

local NEAR, FAR = 0.6, 1.2 -- m ahead, where the ice begins

-- Ground with a twentieth of the friction, beyond a place on one side.
local function ice(from, side)
  return { from = { from, side > 0 and 0 or -1e6, -1e6 }, to = { 1e6, side > 0 and 1e6 or 0, 1e6 },
    factor = 0.05 }
end

return limax.task {
  name = "slippery", version = 1,
  about = {
    measured = "The distance along x, m, mean of four worlds.",
    passive = "0.",
    fixed = "a gait that gets along on both: it cannot turn away from the ice.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { patches = ice(NEAR, 1), actuation = { frequency = 3 } }, -- Hz
  trials = function(_, random)
    local list = {}
    for _ = 1, 2 do
      local from = NEAR + (FAR - NEAR) * random:uniform()
      for side = -1, 1, 2 do list[#list + 1] = { effects = { patches = ice(from, side) } } end
    end
    return list
  end,
  simulation = { duration = 6, settle = 0.5, position = { 0, -0.15, 0 }, accuracy = "evolve" },
  population = 100, generations = 100, repetitions = 1,
  fitness = { "distance", axis = "x" },
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
