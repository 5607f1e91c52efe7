--- lift.lua: a task: raise a block of 2 kg that lies on the body's back, and do not drop it. It
--- lies to the left or to the right of the middle, at a distance that each generation draws.

local limax = require "limax"

local ASIDE = 0.08 -- m

-- A little above the highest bodies.
local function block(aside)
  return { size = { 0.3, 0.3, 0.1 }, position = { 0.1, aside, 0.42 }, mass = 2 } -- m, kg
end

-- The mean height of the block in the second half of the run above that at t = 0, m, mean of both
-- worlds.
local function raised(robot)
  local sum = 0
  for _, trial in ipairs(robot.trials) do
    local places, height = trial:trace "block", 0
    local middle = math.floor(places.samples / 2)
    for k = middle + 1, places.samples do height = height + places[k][3] end
    sum = sum + height / (places.samples - middle) - places[1][3]
  end
  return sum / #robot.trials
end

return limax.task {
  name = "lift", version = 1,
  about = {
    measured = "The mean height of the block in the second half of the run above that at the start,"
      .. " m, mean of both worlds.",
    passive = "0.00 m measured: the block stays where it is.",
    fixed = "at most two thirds of what its muscles can raise: a sine does not hold.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  -- Hz: a body does not throw the block off, and the second half is half a period
  scene = limax.scenes.land { actuation = { frequency = 0.2 }, block = block(0) },
  trials = function(_, random)
    local aside = ASIDE * random:uniform()
    return { { effects = { block = block(aside) } }, { effects = { block = block(-aside) } } }
  end,
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  record = { block = 20 }, -- Hz
  population = 100, generations = 40, repetitions = 1,
  fitness = raised,
  small = { population = 12, generations = 6 },
}
