--- throw.lua: a task: throw a block of 1 kg that lies on the body's back far ahead.

local limax = require "limax"

local LYING = 0.17 -- m, the height of the block's centre below which it touches the ground

-- The distance along x of the block less the body's own until the block comes down, m; 0 if it
-- stays up.
local function thrown(robot)
  local block, body = robot:trace "block", robot:trace "center_of_mass"
  for k = 1, block.samples do
    if block[k][3] < LYING then
      return block[k][1] - block[1][1] - math.abs(body[k][1] - body[1][1])
    end
  end
  return 0
end

return limax.task {
  name = "throw", version = 1,
  about = {
    measured = "How far ahead the block comes down, m, less the distance that the robot moves; 0 if"
      .. " it stays up.",
    passive = "0.00 m measured: the block stays up.",
    fixed = "no limit: there is one world, and nothing in it has to be sensed.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land {
    actuation = { frequency = 3 }, -- Hz
    -- a little above the highest bodies: m, kg
    block = { size = { 0.2, 0.2, 0.2 }, position = { 0.15, 0.05, 0.42 }, mass = 1 },
  },
  simulation = { duration = 3, settle = 0.5, accuracy = "evolve" }, -- s
  record = { block = 50, center_of_mass = 50 }, -- Hz
  population = 100, generations = 100, repetitions = 1,
  fitness = thrown,
  small = { population = 12, generations = 6, ["simulation.duration"] = 2 },
}
