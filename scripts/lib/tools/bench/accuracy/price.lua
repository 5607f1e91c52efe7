--- price.lua: wall time of one robot and one simulated second under several settings: they take
--- turns on the same robots and each keeps its best turn, so that what else the machine does falls
--- on none of them alone.

local engine = require "limax.engine"
local rescore = require "limax.evolution.rescore"
local sampling = require "limax.settings.settings"
local timing = require "limax.tools.bench.timing"

local price = {}

local ROUNDS = 3

-- Samples of a trace that stands for all that the experiment records: it keeps the steps on the
-- same samples, and at 50 Hz it lasts 200 s in 240 kB, longer than a robot's turns.
local SAMPLES = 1e4

-- Robot-seconds simulated so far.
local function simulated(simulation, count)
  local sum = 0
  for i = 1, count do
    local outcome = simulation:outcome(i)
    sum = sum + outcome.step * (outcome.time_step or 0)
  end
  return sum
end

--- Prices of settings, s of wall time per robot-second, by their place in the list; nil where every
--- robot failed before the first turn.
---@param robots limax.population.scored
---@param settings table[] see rescore.options
---@param seconds number of one turn
---@return table<integer, number>
function price.measure(robots, settings, seconds)
  local world, list, simulations = robots.world, {}, {}
  local rate = sampling.base_rate(world.config.record)
  for k, setting in ipairs(settings) do
    local options = rescore.options(world.config, setting)
    options.duration, options.record = SAMPLES / rate, { center_of_mass = rate }
    local simulation =
      engine.simulation(robots.engine, robots.materials, world.scene, options, world.device)
    simulations[k] = simulation
    -- the length of a step is learnt
    simulation:advance(seconds / 4)
    local before = simulated(simulation, #robots)
    list[k] = { run = function()
      simulation:advance(seconds)
      local done = simulated(simulation, #robots) - before
      before = before + done
      return done
    end }
  end
  local prices = {}
  for k, speed in ipairs(timing.best_rates(list, ROUNDS)) do
    prices[k] = speed > 0 and 1 / speed or nil
    simulations[k]:free "its price was known"
  end
  return prices
end

return price
