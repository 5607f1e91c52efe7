--- integration.lua: integrators, time steps and the energy ledger in scripts. SI units.

local limax = require "limax"
local evolution = require "support.evolution"

local steps = require("limax.test").suite "time steps"

local walker = limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }

local everywhere = { devices = "all" }

steps:test("auto is not coarse at the speed of the start and of the drop", everywhere, function(t)
  local function step_of(options)
    options.settle, options.duration, options.device = 0, 0.05, t.device
    options.record = { center_of_mass = 20 }
    local robot = walker:simulate(options)
    return robot.record.outcome.time_step, robot.coarse
  end
  local slow = step_of { time_step = "auto" }
  local fast, coarse = step_of { time_step = "auto", velocity = { 100, 0, 0 } }
  t:ok(slow > 1e-4)
  t:near(fast, 1e-4, { rtol = 1e-9 })
  -- at the limit some masses move farther; a fifth below none does
  t:equal(coarse, true)
  local _, finer = step_of { time_step = 8e-5, velocity = { 100, 0, 0 } }
  t:equal(finer, false)
  -- a tier's step is capped by a throw too
  t:ok(step_of { velocity = { 0, 0, -100 } } <= 1e-4)
end)

steps:test("coarse robots are counted in metrics and history", function(t)
  -- 12 mm and 8 mm per step; an edge is 100 mm
  local simulation = { duration = 0.4, settle = 0, time_step = 5e-4, velocity = { 24, 0, 0 } }
  local scene = { damping = true, actuation = true }
  local coarse = evolution.finished { generations = 1, simulation = simulation, scene = scene }[1]
  t:equal(coarse.coarse, coarse.scored)
  t:equal(coarse.population[coarse.champion.index].coarse, true)
  simulation.velocity = { 16, 0, 0 }
  local fine = evolution.finished { generations = 1, simulation = simulation, scene = scene }[1]
  t:equal(fine.coarse, 0)
  t:equal(fine.population[fine.champion.index].coarse, false)

end)

steps:test("a GPU refuses RK4 and the ledger by name", { devices = { "cuda" } }, function(t)
  local scene = limax.scenes.air()
  t:raises("rk4 runs on the cpu only",
    function() walker:simulate { scene = scene, integrator = "rk4", device = t.device } end)
  t:raises("the energy ledger exists on the cpu only",
    function() walker:simulate { scene = scene, record = { ledger = 50 }, device = t.device } end)
end)

steps:test("settling takes whole steps, not whole samples", function(t)
  local walk = walker:begin { settle = 0.05, time_step = 1e-3, device = "cpu" } -- 50 Hz
  t:near(walk.time, -0.05, { atol = 1e-12 })
end)

-- ---- energy -------------------------------------------------------------------------------------

local ledgers = require("limax.test").suite "ledger of energy"

ledgers:test("accounts for the energy of a walk", function(t)
  local robot = walker:simulate { settle = 0.2, duration = 1, device = "cpu",
    record = { ledger = 100, energy = 100 } }
  local ledger = robot:ledger()
  t:ok(ledger.muscles > 1 and ledger.damping < -1 and ledger.friction < -0.1
    and ledger.contact_damping < 0)
  t:equal(ledger.other, 0)
  t:ok(ledger.closure < 1e-3 and ledger.closure > 0, ledger.closure)
  local trace = robot:trace "ledger"
  t:equal({ trace:size(), trace.rate, trace.unit, trace.shape }, { 101, 100, "J", { 101, 9 } })
  t:equal(trace[1]:table()[5], 0)
end)
