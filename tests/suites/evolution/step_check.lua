--- step_check.lua: a run whose scores depend on the time step reports it, and keeps its scores.

local evolution = require "support.evolution"

local suite = require("limax.test").suite "step_check"

-- A finished run at the tier `evolve`, and the messages about its step.
local function finished(fields)
  local messages = {}
  fields.simulation = fields.simulation
    or { duration = 0.4, settle = 0.1, accuracy = "evolve" }
  local history = evolution.finished(fields, { say = function(text)
    if text:find "^at half" then messages[#messages + 1] = text end
  end })
  return messages, history
end

local function step(robot) return robot.record.outcome.time_step end

suite:test("a loss at half of the step is reported once, with a tier and its price", function(t)
  local messages, history = finished { fitness = step }
  t:equal(messages, { "at half of the time step the best 6 robots of generation 0 score 0.0001 in"
    .. ' the mean instead of 0.0002: take simulation.accuracy = "publish", for about 4.0 times'
    .. " the time" })
  for k, entry in ipairs(history) do
    t:near(entry.best, 2e-4, { atol = 1e-6 })
    t:equal(entry.evaluations, k == 1 and 6 or 4)
  end
  -- only scores of new robots of the last generation depend on the step
  messages = finished { fitness = function(robot)
    return robot.generation == 2 and step(robot) or 0
  end }
  t:ok(#messages == 1 and messages[1]:find("of generation 2 score", 1, true), messages[1])
  for _, fields in ipairs { { fitness = function(robot) return robot.id end },
    { fitness = step, scene = { gravity = true } },
    { fitness = step, simulation = { duration = 0.4, settle = 0.1, time_step = 2e-4 } } } do
    t:equal(finished(fields), {})
  end
end)
