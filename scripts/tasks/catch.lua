--- catch.lua: a task: stop a block that slides past at 2.5 m/s, on the left or on the right. It
--- comes after a second, and does not touch a body that stays where it is.

local limax = require "limax"

local SPEED = 4.5 -- m/s, at the start, 3.75 m ahead
local SLOW, FAST = 0.45, 0.65 -- m/s to the side: it passes 0.35 to 0.5 m beside the centre

local function block(velocity)
  return { size = { 0.2, 0.2, 0.2 }, mass = 2, position = { 4, 0.05, 0 }, -- m, kg
    velocity = { -SPEED, velocity, 0 } }
end

-- How far the block ends behind x = 0, where the body's back was at the start, m, negative, mean of
-- all worlds.
local function stopped(robot)
  local sum = 0
  for _, trial in ipairs(robot.trials) do
    sum = sum + math.min(trial:block().position[1], 0)
  end
  return sum / #robot.trials
end

return limax.task {
  name = "catch", version = 1,
  about = {
    measured = "How far the block gets past the place of the robot at the start, m, as a negative"
      .. " number, mean of four blocks.",
    passive = "-1.10 m measured: no block touches it.",
    fixed = "-0.55 m, half of that: it goes to one side only.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { friction = { static = 0.4, kinetic = 0.2 }, block = block(0),
    actuation = { frequency = 3 } }, -- Hz
  trials = function(_, random)
    local list = {}
    for _ = 1, 2 do
      local velocity = SLOW + (FAST - SLOW) * random:uniform()
      for side = -1, 1, 2 do
        list[#list + 1] = { effects = { block = block(side * velocity) } }
      end
    end
    return list
  end,
  -- s; no settling, in which the block would slide past
  simulation = { duration = 3, settle = 0, accuracy = "evolve" },
  population = 100, generations = 80, repetitions = 1,
  fitness = stopped,
  small = { population = 12, generations = 6 },
}
