--- fidelity.lua: where scores depend on the time step, the best robots are scored again at a finer
--- tier, and that is what the run keeps.

local evolution = require "support.evolution"
local host = require "limax.host"
local limax = require "limax"

local suite = require("limax.test").suite "fidelity"

-- A first generation, scored, and what was said about its step.
local function first_generation(fields)
  local said = {}
  fields.simulation = fields.simulation
    or { duration = 0.4, settle = 0.1, accuracy = "evolve" }
  local run = limax.start(evolution.small(fields), { say = function(text)
    if text:find "^at half" then said[#said + 1] = text end
  end })
  return run:generations()():score(), said
end

-- Half of the step gives half of the score.
local function of_step(robot) return robot.record.outcome.time_step end

suite:test("a loss at half of the step turns it on, until the best half is scored again",
  function(t)
    local robots, said = first_generation { fitness = of_step }
    t:ok(#said == 1 and said[1]:find("again at the tier publish, for about 3.0 times", 1, true),
      said[1])
    -- each finer score is lower than all others, so all robots get one
    for i, record in ipairs(robots.records) do
      t:near(record.fitness, 5e-5, { atol = 1e-9 })
      t:ok(record.first_fitness > 1.9e-4 and robots[i].record == record)
    end
    t:equal(robots.evaluations, 6)
  end)

suite:test("a step that the script names is only reported", function(t)
  local robots, said = first_generation { fitness = of_step,
    simulation = { duration = 0.4, settle = 0.1, time_step = 2e-4 } }
  t:ok(#said == 1 and said[1]:find('score 0.0001 in the mean instead of 0.0002: take'
    .. ' simulation.accuracy = "publish"', 1, true), said[1])
  t:equal({ robots.records[1].first_fitness, robots.evaluations }, { nil, 6 })
end)

suite:test("a fitness that depends on nothing, or `never`, leaves the scores alone", function(t)
  for _, fields in ipairs { { fitness = function(robot) return robot.id end },
    { fitness = of_step, rescore = "never" }, { fitness = of_step, scene = { gravity = true } } } do
    local robots, said = first_generation(fields)
    t:equal({ #said, robots.records[1].first_fitness, robots.evaluations }, { 0, nil, 6 })
  end
end)

suite:test("elites keep finer scores, and a champion's file replays to its own", function(t)
  local folder = t:folder() .. "/run"
  local history, run = evolution.finished({ fitness = "walk", rescore = "publish",
    simulation = { duration = 0.4, settle = 0.1, accuracy = "preview" } }, { out = folder })
  for k, entry in ipairs(history) do
    t:ok(entry.rescored >= 3 and entry.evaluations == (k == 1 and 6 or 4), entry.rescored)
    local robots = entry.population
    local best = robots[robots.ranked[1]]
    t:equal(best.fitness, entry.best)
    t:ok(best.record.first_fitness ~= nil)
    t:near(best.record.outcome.time_step, 5e-5, { atol = 2e-6 })
  end
  local path = host.file.list(folder .. "/r01/champions")
  local champion = limax.robot(folder .. "/r01/champions/" .. path[#path])
  local replayed, score = champion:replay()
  t:same_bits({ replayed.fitness, score }, { history[3].best, history[3].best })
  t:equal(run.world.fidelity.on, true)
end)
