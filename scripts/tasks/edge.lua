--- edge.lua: a task: the ground ends half a metre ahead, on the left in one world and on the right
--- in the other. A robot that feels the ground ahead can turn to the side that goes on.

local limax = require "limax"

local SPACING, LENGTH, WIDTH = 0.25, 7, 6 -- m
local EDGE, DEPTH = 1, 1 -- m

-- Ground that is missing beyond the edge on one side.
local function cliff(side)
  local heights = {}
  for i = 1, LENGTH / SPACING + 1 do
    heights[i] = {}
    for j = 1, WIDTH / SPACING + 1 do
      local x, y = -1 + (i - 1) * SPACING, -WIDTH / 2 + (j - 1) * SPACING
      heights[i][j] = x > EDGE and side * y > 0 and -DEPTH or 0
    end
  end
  return { spacing = SPACING, origin = { -1, -WIDTH / 2, 0 }, heights = heights }
end

-- The distance along x in worlds in which the robot did not fall, m, mean of both.
local function safe_distance(robot)
  local sum = 0
  for _, trial in ipairs(robot.trials) do
    local moved = trial:displacement()
    if moved[3] > -DEPTH / 4 then sum = sum + moved[1] end
  end
  return sum / #robot.trials
end

return limax.task {
  name = "edge", version = 1,
  about = {
    measured = "The distance along x, m, mean of both worlds; 0 in one in which the robot falls.",
    passive = "0.00 m measured.",
    fixed = "half of what a gait that turns can get: its side is missing in one of the worlds.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { ground = false, terrain = cliff(1), actuation = { frequency = 3 } },
  trials = { { effects = { terrain = cliff(1) } }, { effects = { terrain = cliff(-1) } } },
  simulation = { duration = 6, settle = 0.5, position = { 0, -0.15, 0 }, accuracy = "evolve" },
  population = 100, generations = 50, repetitions = 1,
  fitness = safe_distance,
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
