--- evolve.lua: evolves some generations at the prompt, with a line for each.

local engine = require "limax.engine"
local experiment = require "limax.experiment.experiment"
local failure = require "limax.base.failure"
local host = require "limax.host"
local schema = require "limax.engine.schema"
local start = require("limax.evolution.evolve").start

local evolve = {}

local DEFAULT = 5 -- generations

local function run_of(what)
  if type(what) ~= "table" then
    engine.fail("evolve: expected an experiment, its fields or a run, got " .. schema.show(what))
  end
  if rawget(what, "experiment") and rawget(what, "history") then return what end
  if not experiment.is(what) then what = experiment.new(what) end
  return start(what)
end

local function line_of(entry, robots, seconds)
  return ("generation %d: best %.4g, mean %.4g, %d of %d scored, %.2f s\n"):format(
    entry.generation, entry.best, entry.mean, entry.scored, #robots, seconds)
end

-- Runs generations and prints a line for each.
local function advance(run, generations)
  local next_robots = run:generations()
  for done = 1, generations do
    local began = host.clock()
    -- a generation that Ctrl-C interrupted is finished first
    local robots = run.upcoming == nil and run.population or next_robots()
    if not robots then
      if done == 1 then io.write("the run has ended\n") end
      break
    end
    robots:simulate():score():breed()
    io.write(line_of(run.history[#run.history], robots, host.clock() - began))
    io.flush()
  end
end

--- Evolves some generations of a run.
---@param what table|limax.experiment|limax.run
---@param keep fun(run: limax.run) receives a run that Ctrl-C has stopped
function evolve.some(what, generations, keep)
  generations = generations or DEFAULT
  if type(generations) ~= "number" or generations < 1 or generations % 1 ~= 0 then
    engine.fail(("evolve: expected a whole number of generations from 1, got %s"):format(
      schema.show(generations)))
  end
  local run = run_of(what)
  local fine, value, trace = host.protect(advance, run, generations)
  if not fine then
    if value == host.interrupt then
      keep(run)
      io.write(("\nthe run so far is _ (generations: %d); evolve(_) continues it\n"):format(
        #run.history))
    end
    failure.raise_again(value, trace)
  end
  return run
end

--- The best robot of the last scored generation.
function evolve.champion(run)
  if type(run) ~= "table" or type(rawget(run, "history")) ~= "table" then
    engine.fail("champion: expected a run of evolve, got " .. schema.show(run))
  end
  local last = run.history[#run.history]
  if not last then engine.fail "champion: this run has no scored generation yet" end
  local best = last.population.ranked[1]
  if not best then
    engine.fail(("champion: no robot of generation %d has a score"):format(last.generation))
  end
  return last.population[best]
end

return evolve
