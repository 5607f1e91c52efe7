--- walkers.lua: the populations whose ranking is measured, of shipped experiments: random bodies
--- (the first generation) and evolved ones (the last generation under the tier `evolve`); and the
--- price of settings on the same robots.

local cases = require "limax.tools.bench.cases"
local engine = require "limax.engine"
local evolve = require "limax.evolution.evolve"
local host = require "limax.host"
local rescore = require "limax.evolution.rescore"
local script = require "limax.base.script"
local settings = require "limax.settings.settings"
local tiers = require "limax.settings.tiers"

local walkers = {}

--- Files of scripts/experiments with overrides: the quickstart at two frequencies (fast gaits hop,
--- which is chaotic), the paper's, whose static friction is below the kinetic one, and the other
--- tasks; jumpers of small pieces of material, as in the table of ACCURACY.md.
walkers.CASES = {
  { name = "walk, 2 Hz", script = "walk.lua" },
  { name = "walk, 5 Hz", script = "walk.lua", set = { "scene.actuation.frequency=5" } },
  { name = "jump", script = "jump.lua", set = { "genome.sigma=1" } },
  { name = "paper", script = "paper.lua" },
  { name = "swim", script = "swim.lua" },
  { name = "climb", script = "climb.lua" },
  { name = "stairs", script = "stairs.lua" },
  { name = "grip", script = "grip.lua" },
  { name = "carry", script = "carry.lua" },
}

local function silent() end

--- An experiment of scripts/experiments with overrides.
---@param ... string[] further overrides
function walkers.experiment(case, ...)
  local all = {}
  for _, list in ipairs { case.set or {}, tiers.overrides "evolve", { "repetitions=1" }, ... } do
    for _, text in ipairs(list) do all[#all + 1] = text end
  end
  return script.run(host.home .. "/scripts/experiments/" .. case.script):override(all)
end

--- The first generation of an experiment, expressed and not simulated yet.
function walkers.random(experiment, device)
  return evolve.start(experiment, { device = device, say = silent }):generations()()
end

--- The last generation of an experiment.
function walkers.evolved(experiment, device)
  local last
  for robots in evolve.start(experiment, { device = device, say = silent }):generations() do
    last = robots:score()
  end
  return last
end

-- Rounds of measuring a price; and samples of the trace that replaces what the experiment records:
-- the steps stay on the same samples, and at 50 Hz it lasts longer than all rounds.
local ROUNDS, SAMPLES = 3, 1e4

-- Robot-seconds simulated so far.
local function simulated(simulation, count)
  local sum = 0
  for i = 1, count do
    local outcome = simulation:outcome(i)
    sum = sum + outcome.step * (outcome.time_step or 0)
  end
  return sum
end

--- Prices of settings on the same robots, s of wall time per robot-second, by index; nil if every
--- robot failed before the first round. The settings alternate and each keeps its best round, so
--- that other work on the machine affects all of them alike.
---@param list table[] see rescore.options
---@param seconds number of one round
function walkers.prices(robots, list, seconds)
  local world, slices, simulations = robots.world, {}, {}
  local rate = settings.base_rate(world.config.record)
  for k, setting in ipairs(list) do
    local options = rescore.options(world.config, setting)
    options.duration, options.record = SAMPLES / rate, { center_of_mass = rate }
    local simulation =
      engine.simulation(robots.engine, robots.materials, world.scene, options, world.device)
    simulations[k] = simulation
    -- the first slice measures the time of a step
    simulation:advance(seconds / 4)
    local before = simulated(simulation, #robots)
    slices[k] = { run = function()
      simulation:advance(seconds)
      local done = simulated(simulation, #robots) - before
      before = before + done
      return done
    end }
  end
  local prices = {}
  for k, speed in ipairs(cases.best_rates(slices, ROUNDS)) do
    prices[k] = speed > 0 and 1 / speed or nil
    simulations[k]:free "its price was measured"
  end
  return prices
end

return walkers
