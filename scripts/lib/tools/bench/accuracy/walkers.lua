--- walkers.lua: the populations whose ranking is measured: random bodies, the first generation of a
--- shipped experiment, and evolved ones, its last generation after a short evolution under the tier
--- `evolve`.

local evolve = require "limax.evolution.evolve"
local host = require "limax.host"
local script = require "limax.base.script"
local tiers = require "limax.settings.tiers"

local walkers = {}

---@class limax.accuracy.case
---@field name string
---@field script string file in scripts/experiments
---@field set string[] overrides

--- The shipped scenes: the quickstart at two frequencies (fast gaits hop, and hopping is chaotic),
--- jumping, the paper's, with its static friction below the kinetic one, and the other tasks.
---@type limax.accuracy.case[]
walkers.CASES = {
  { name = "walk, 2 Hz", script = "walk.lua", set = {} },
  { name = "walk, 5 Hz", script = "walk.lua", set = { "scene.actuation.frequency=5" } },
  { name = "jump", script = "jump.lua", set = {} },
  { name = "paper", script = "paper.lua", set = {} },
  { name = "swim", script = "swim.lua", set = {} },
  { name = "climb", script = "climb.lua", set = {} },
  { name = "stairs", script = "stairs.lua", set = {} },
  { name = "grip", script = "grip.lua", set = {} },
  { name = "carry", script = "carry.lua", set = {} },
}

local function silent() end

--- An experiment of scripts/experiments, changed.
---@param case limax.accuracy.case
---@param changes string[] further overrides
---@return limax.experiment
function walkers.experiment(case, changes)
  local all = {}
  for _, list in ipairs { case.set, tiers.overrides "evolve", { "repetitions=1" }, changes }
  do
    for _, text in ipairs(list) do all[#all + 1] = text end
  end
  return script.run(host.home .. "/scripts/experiments/" .. case.script):override(all)
end

--- The first generation of an experiment, expressed and not simulated yet.
---@param experiment limax.experiment
---@param device limax.device
---@return limax.population.scored
function walkers.random(experiment, device)
  return evolve.start(experiment, { device = device, say = silent }):generations()()
end

--- The last generation of an experiment, and the wall time of simulating all of them, s.
---@param experiment limax.experiment
---@param device limax.device
---@return limax.population.scored
---@return number seconds
function walkers.evolved(experiment, device)
  local run = evolve.start(experiment, { device = device, say = silent })
  local last, seconds = nil, 0
  for robots in run:generations() do
    robots:score()
    last, seconds = robots, seconds + robots.timing.simulate
  end
  return last, seconds
end

return walkers
