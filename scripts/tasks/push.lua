--- push.lua: a task: walk straight on although a kick from the left or the right comes at one of
--- four times: a change of velocity of 0.75 m/s within 50 ms. A GPU compiles a kernel for each of
--- the eight kicks, once, because numbers of a text are part of it.

local limax = require "limax"

local LASTS, KICK = 0.05, 0.75 -- s, m/s

-- A sideways change of velocity of all masses.
local function kick(at, velocity)
  return { force = "f = vec(0, t > at && t < at + lasts ? m * acceleration : 0, 0);",
    bound = { stiffness = 0, damping = 0 }, at = at, lasts = LASTS,
    acceleration = velocity / LASTS }
end

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
    passive = "less than 0: it slides to the side.",
    fixed = "its walk less what the kicks turn it: it cannot turn back.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { kick = kick(1, 0), actuation = { frequency = 3 } }, -- Hz
  trials = function(_, random)
    local list = {}
    for _ = 1, 2 do
      local at = 0.6 * random:integer(4) -- s
      for side = -1, 1, 2 do list[#list + 1] = { effects = { kick = kick(at, side * KICK) } } end
    end
    return list
  end,
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 100, generations = 100, repetitions = 1,
  fitness = straight_on,
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
