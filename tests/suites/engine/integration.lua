--- integration.lua: integrators, time steps and the energy ledger in scripts. SI units.

local limax = require "limax"
local evolution = require "support.evolution"

local steps = require("limax.test").suite "time steps"

local walker = limax.robot { voxels = "ecs\nece\n\nsbs\ncec" }

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
