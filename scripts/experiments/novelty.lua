--- novelty.lua: search without a goal. Shows novelty search: robots survive for where they end, not
--- for how far they get. The archive keeps six robots of each generation, and a robot is as novel
--- as its end is far from those of its 15 nearest neighbours. The fitness is only recorded.
--- One repetition; about half a minute on two cores.
--- Run it with: limax run scripts/experiments/novelty.lua

local limax = require "limax"

-- Where a robot ends along an axis, m from its start.
local function ends_at(axis)
  return { function(robot) return robot:distance { axis = axis } end, name = axis }
end

return limax.experiment {
  name = "novelty",
  simulation = { duration = 3, settle = 0.5, accuracy = "preview" }, -- s
  population = 60, generations = 40, repetitions = 1,
  fitness = "walk", -- m
  archive = { "novelty", descriptors = { ends_at "x", ends_at "y" }, k = 15, add = 6 },
  survival = "novelty",
  supervisor = "fixed",
}
