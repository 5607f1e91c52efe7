--- damage.lua: a task: walk on, although muscles of the left or of the right side stop at a time
--- that every generation draws anew.

local limax = require "limax"

local EARLY, LATE = 1, 3 -- s

-- All muscles of one side.
local function side_dies(time, side)
  return { time = time, from = { -1, side > 0 and 0.1 or -1, -1 },
    to = { 1, side > 0 and 1 or -0.1, 1 } }
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
  name = "damage", version = 1,
  about = {
    measured = "The distance along x less the distance to the side, m, mean of four worlds.",
    passive = "0.",
    fixed = "its walk until then, and a curve to the side of the dead muscles.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  -- Hz; damage acts through a controller
  scene = limax.scenes.land { actuation = { frequency = 3 }, control = "sine",
    damage = side_dies(EARLY, 1) },
  trials = function(_, random)
    local list = {}
    for _ = 1, 2 do
      local time = EARLY + (LATE - EARLY) * random:uniform()
      for side = -1, 1, 2 do
        list[#list + 1] = { effects = { damage = side_dies(time, side) } }
      end
    end
    return list
  end,
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 100, generations = 100, repetitions = 1,
  fitness = straight_on,
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
