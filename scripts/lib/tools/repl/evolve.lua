--- evolve.lua: evolves some generations at the prompt, with a line for each.

local engine = require "limax.engine"
local evolution = require "limax.evolution.evolve"
local experiment = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local names = require "limax.tools.repl.names"
local output = require "limax.base.output"
local schema = require "limax.engine.schema"

local evolve = {}

local DEFAULT = 5 -- generations

local function is_run(value)
  return type(value) == "table" and type(rawget(value, "history")) == "table"
end

local function run_of(what)
  if is_run(what) then return what end
  if type(what) ~= "table" then
    schema.refuse("evolve", "an experiment, its fields or a run", what)
  end
  return evolution.start(experiment.is(what) and what or experiment.new(what))
end

-- Runs generations and prints a line for each.
local function advance(run, generations)
  local next_robots = run:generations()
  for done = 1, generations do
    local began = host.clock()
    -- a generation that Ctrl-C interrupted is finished first
    local now = run.population
    local robots = now and not now.entry and now or next_robots()
    if not robots then
      if done == 1 then output.write("the run has ended\n") end
      break
    end
    robots:simulate():score()
    local entry = evolution.record(run, robots)
    output.write(("generation %d: best %.4g, mean %.4g, %d of %d scored, %.2f s\n"):format(
      entry.generation, entry.best, entry.mean, entry.scored, #robots, host.clock() - began))
    io.flush()
  end
end

--- Evolves some generations, prints a line for each, and returns the run, which can be continued.
--- After Ctrl-C the run so far is `_`.
---@param what table|limax.experiment|limax.run an experiment, its fields, or a run to continue
---@param generations? integer 5 if absent
---@return limax.run
function evolve.evolve(what, generations)
  generations = generations or DEFAULT
  if type(generations) ~= "number" or generations < 1 or generations % 1 ~= 0 then
    schema.refuse("evolve", "a whole number of generations from 1", generations)
  end
  local run = run_of(what)
  local fine, value, trace = host.protect(advance, run, generations)
  if not fine then
    if value == host.interrupt then
      names.remember(run)
      output.write(("\nthe run so far is _ (generations: %d); evolve(_) continues it\n"):format(
        #run.history))
    end
    failure.raise_again(value, trace)
  end
  return run
end

--- The best robot of a run's last scored generation.
---@param run limax.run
---@return limax.scored_robot
function evolve.champion(run)
  if not is_run(run) then schema.refuse("champion", "a run of evolve", run) end
  local last = run.history[#run.history]
  if not last then engine.fail "champion: this run has no scored generation yet" end
  local best = last.population.ranked[1]
  if not best then
    engine.fail(("champion: no robot of generation %d has a score"):format(last.generation))
  end
  return last.population[best]
end

return evolve
