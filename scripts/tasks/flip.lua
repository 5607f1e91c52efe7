--- flip.lua: a task: turn head over heels as often as possible. What counts is how far the
--- direction that is up in the body at the start turns around the y axis.

local limax = require "limax"

-- The turns of a body around y since t = 0. Its own up is the mean place of its masses, each
-- weighted by its height at t = 0 above their mean.
local function turns(robot)
  local places = robot:trace "position"
  local first, mean, start, angle = places[1]:table(), 0, nil, nil
  for _, place in ipairs(first) do mean = mean + place[3] / #first end
  for sample = 1, places.samples do
    local now, x, z = places[sample], 0, 0
    for m, place in ipairs(first) do
      local height, b = place[3] - mean, now[m]
      x, z = x + height * b[1], z + height * b[3]
    end
    local turned = math.atan2(x, z)
    start = start or turned
    -- the nearest angle to the one before
    local whole = math.floor(((angle or turned) - turned) / (2 * math.pi) + 0.5)
    angle = turned + 2 * math.pi * whole
  end
  return math.abs(angle - start) / (2 * math.pi)
end

return limax.task {
  name = "flip", version = 1,
  about = {
    measured = "The turns about the y axis, forwards or backwards, from the start to the end.",
    passive = "0.00 turns measured.",
    fixed = "no limit: there is one world, and nothing in it has to be sensed.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { actuation = { frequency = 3 } }, -- Hz
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  record = { position = 5 }, -- Hz: a turn takes longer than two samples
  population = 100, generations = 100, repetitions = 1,
  fitness = turns,
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
