--- target.lua: a task: reach a goal that lies to the left or to the right. Each generation draws
--- two directions, and every robot tries both and their mirror images.

local limax = require "limax"

local DISTANCE = 1.5 -- m
local NARROW, WIDE = math.rad(20), math.rad(60)

return limax.task {
  name = "target", version = 1,
  about = {
    measured = "How much nearer to the goal the centre of mass is at the end, m, mean of 4 goals.",
    passive = "0.00 m measured.",
    fixed = "along x at most 0.55 m in the mean: it cannot turn to both sides.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { actuation = { frequency = 3 }, target = true }, -- Hz
  trials = function(_, random)
    local list = {}
    for _ = 1, 2 do
      local angle = NARROW + (WIDE - NARROW) * random:uniform()
      for side = -1, 1, 2 do
        list[#list + 1] = { effects = { target = {
          position = { DISTANCE * math.cos(angle), side * DISTANCE * math.sin(angle), 0 } } } }
      end
    end
    return list
  end,
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 100, generations = 100, repetitions = 1,
  fitness = "target",
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
