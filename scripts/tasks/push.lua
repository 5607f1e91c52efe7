--- push.lua: a task: walk straight on although a kick comes from the left or from the right. Each
--- generation draws its time and its strength, and every robot takes it from both sides.

local limax = require "limax"

local SOFT, HARD = 0.5, 1 -- m/s

-- The distance along x less that to the side, m, mean of all worlds.
local function straight_on(robot)
  local sum = 0
  for _, trial in ipairs(robot.trials) do
    local moved = trial:displacement()
    sum = sum + moved[1] - math.abs(moved[2])
  end
  return sum / #robot.trials
end

return limax.task {
  name = "push", version = 1,
  about = {
    measured = "The distance along x less the distance to the side, m, mean of four kicks.",
    passive = "-0.01 m measured: it slides to the side.",
    fixed = "its walk less what the kicks turn it: it cannot turn back.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { kick = limax.scenes.kick(), actuation = { frequency = 3 } }, -- Hz
  trials = function(_, random)
    local list = {}
    for _ = 1, 2 do
      local time, speed = 0.5 + 2 * random:uniform(), SOFT + (HARD - SOFT) * random:uniform()
      for side = -1, 1, 2 do
        list[#list + 1] = { effects = { kick = limax.scenes.kick { time = time,
          velocity = { 0, side * speed, 0 } } } }
      end
    end
    return list
  end,
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 100, generations = 100, repetitions = 1,
  fitness = straight_on,
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
