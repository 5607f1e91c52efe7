--- gaps.lua: a task: cross trenches of 0.2 to 0.5 m, whose widths every generation draws anew. A
--- robot that falls into one stays there. The sensor `ahead` measures the ground in front of it.

local limax = require "limax"

local SPACING, LENGTH, DEPTH = 0.05, 8, 1 -- m
local FIRST, GROUND = 0.9, 0.6 -- m, the ground before the first trench and between two of them
local NARROW, WIDE = 0.2, 0.5 -- m

-- Heights from x = -1 m on; across, those of the border go on.
local function trenches(random)
  local from, to = FIRST, FIRST + NARROW + (WIDE - NARROW) * random:uniform()
  local heights = {}
  for i = 1, LENGTH / SPACING do
    local x = -1 + (i - 1) * SPACING
    if x > to then
      from = to + GROUND
      to = from + NARROW + (WIDE - NARROW) * random:uniform()
    end
    local height = x > from and -DEPTH or 0
    heights[i] = { height, height }
  end
  return { spacing = SPACING, origin = { -1, 0, 0 }, heights = heights }
end

return limax.task {
  name = "gaps", version = 1,
  about = {
    measured = "The distance along x, m, mean of three worlds.",
    passive = "0.00 m measured.",
    fixed = "a gait that steps over most widths: it cannot lengthen a step for a trench.",
  },
  lattice = { 5, 3, 4 }, -- voxels of 0.1 m
  genome = { sigma = 0.25 },
  scene = limax.scenes.land { ground = false, terrain = { heights = { { 0, 0 }, { 0, 0 } } },
    actuation = { frequency = 3 } }, -- Hz
  trials = function(_, random)
    local list = {}
    for k = 1, 3 do list[k] = { effects = { terrain = trenches(random) } } end
    return list
  end,
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 100, generations = 45, repetitions = 1,
  fitness = { "distance", axis = "x" },
  small = { population = 12, generations = 6, ["simulation.duration"] = 3 },
}
